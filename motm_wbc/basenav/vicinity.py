"""What of a world matters to paths between two places: what meets an ellipse about them.

A path of length L between two places, and all that it touches, lies in the ellipse
|p - first| + |p - second| <= L. So a world that keeps what meets the ellipse, and leaves
out the rest, blocks the same there, and nowhere more. Its optimum is therefore a lower
bound of the whole world's; if it is no longer than L, it meets nothing that was left out,
and is the whole world's optimum. What can't be reached in it can't be reached at all.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from motm_wbc.basenav.form import Form
from motm_wbc.basenav.inflation import OUTER, Box, grow_convex, offset_pieces
from motm_wbc.basenav.outlines import Ellipse, Outlines, relations
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array

_LARGE = 64  # corners from which on an outline is cut to what is near
_MAP = 256  # corners from which on only what is near is inflated
_LEAST_LENGTH = 0.25  # [m]
_CELLS = 32.0  # cells in the length of an ellipse


def rounded_up(ellipse: Ellipse) -> Ellipse:
    """An ellipse that contains the given one, out of a grid of them.

    Places that lie near each other share one, so that what was derived for one serves the
    others; and which one it is depends on nothing but the arguments.
    """
    length = max(ellipse.length, _LEAST_LENGTH)
    cell = 2.0 ** math.floor(math.log2(length / _CELLS))
    x0, y0, x1, y1 = (cell * round(value / cell) for value in ellipse[:4])
    most = length + 1.5 * cell  # either focus moves by half a cell's diagonal at most
    return Ellipse(x0, y0, x1, y1, cell * math.ceil(most / cell))


def blocked_near(
    forms: tuple[Form, ...],
    poses: Array,
    outlines: Outlines,
    chosen: Indices,
    radius: float,
    clip: Box | None = None,
) -> list[shapely.Polygon]:
    """Polygons of some solids grown by a disc, not united yet.

    Args:
        forms: of all solids.
        poses: (s, 3) of all solids.
        outlines: of all solids, moved.
        chosen: which ones are wanted.
        radius: of the disc [m].
        clip: box about which outlines of many corners are wanted, the rest of them may be
            missing; None: all.
    """
    convex = np.array([forms[k].convex for k in chosen], dtype=bool)
    first = outlines.first_ring[chosen[convex]]
    starts, ends = outlines.ring_start[first], outlines.ring_start[first + 1]
    parts = grow_convex(outlines.points, starts, ends, radius)
    for k in chosen[~convex]:
        if clip is None:
            parts += forms[k].grown(radius, poses[k])
            continue
        if forms[k].corners < _MAP:
            grown = forms[k].grown(radius, poses[k])
            parts += [piece for part in grown for piece in clipped(part, clip)]
            continue
        rings = forms[k].rings_at(poses[k])
        parts += clipped(shapely.Polygon(rings[0], rings[1:]), clip)
        if radius > 0.0:
            room = OUTER * radius
            about = (clip[0] - room, clip[1] - room, clip[2] + room, clip[3] + room)
            parts += [piece for ring in rings for piece in offset_pieces(ring, radius, about)]
    return parts


def clipped(polygon: shapely.Polygon, box: Box) -> list[shapely.Polygon]:
    """The polygons of what lies in a box; those of few corners stay whole."""
    if shapely.get_num_coordinates(polygon) < _LARGE:
        return [polygon]
    inside = shapely.clip_by_rect(polygon, *box)
    if not shapely.is_valid(inside):
        inside = shapely.intersection(polygon, shapely.box(*box))
    return [part for part in shapely.get_parts(inside) if part.geom_type == "Polygon"]


def relations_grown(outlines: Outlines, ellipse: Ellipse, radius: float) -> Indices:
    """How solids that are grown by a disc lie to an ellipse, see `relations`; or nearer."""
    return relations(outlines, ellipse._replace(length=ellipse.length + 2.0 * OUTER * radius))


def box_about(ellipse: Ellipse) -> Box:
    """A box that an ellipse lies in with room to spare: cuts along it don't touch the ellipse."""
    x0, y0, x1, y1 = ellipse.box
    spare = ellipse.length / _CELLS
    return x0 - spare, y0 - spare, x1 + spare, y1 + spare
