"""Polygons united, so that outlines that meet up to rounding meet exactly."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from motm_wbc.basenav.outlines import clusters
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_APART = 1e-8  # [m] what is nearer than this may only have met up to rounding; > TOUCH


def snap_grid(extent: float) -> float:
    """Grid to which outlines are rounded where they meet [m].

    Outlines that meet up to rounding then meet exactly, at common corners; 1e-11 m within
    1 km of the origin, coarser beyond, as doubles are.
    """
    decades = math.ceil(math.log10(max(extent, 1000.0)))
    return float(10.0 ** (decades - 14))


def united(
    parts: Sequence[shapely.Polygon], grid: float, without: Sequence[shapely.Polygon] = ()
) -> list[shapely.Polygon]:
    """Polygons of a union, less others; noded: where two touch, both have a corner.

    Rounding to a grid costs five times the union itself. So it is only done where the
    plain union leaves a corner next to an edge that is not its own: there, outlines met
    up to rounding, and whether they touch is for the grid to decide.

    Args:
        parts: what is united.
        grid: from `snap_grid` [m].
        without: what is cut out of the union.
    """
    pieces: list[shapely.Polygon] = []
    for group in _groups([*parts, *without], len(parts), grid):
        kept, cut = group
        if len(kept) == 1 and not cut:
            pieces += kept
        elif kept:
            pieces += _combined(kept, cut, grid)
    return pieces


def _groups(
    shapes: list[shapely.Polygon], count: int, grid: float
) -> list[tuple[list[shapely.Polygon], list[shapely.Polygon]]]:
    """Shapes that may meet, together: those before `count`, and the others."""
    if not shapes:
        return []
    margin = max(_APART, 10.0 * grid)
    box = shapely.bounds(shapes) + margin * np.array([-1.0, -1.0, 1.0, 1.0])
    found: dict[int, tuple[list[shapely.Polygon], list[shapely.Polygon]]] = {}
    for index, label in enumerate(clusters(box).tolist()):
        found.setdefault(label, ([], []))[index >= count].append(shapes[index])
    return list(found.values())


def _combined(
    kept: list[shapely.Polygon], cut: list[shapely.Polygon], grid: float
) -> list[shapely.Polygon]:
    for size in (None, grid):
        united = shapely.union_all(kept, grid_size=size)
        if cut:
            united = shapely.difference(
                united, shapely.union_all(cut, grid_size=size), grid_size=size
            )
        parts = _polygons(united, grid, fill=not cut)
        if size is None and parts and not _almost_touches(parts, grid):
            break
    return parts


def _polygons(geometry: shapely.Geometry, grid: float, fill: bool) -> list[shapely.Polygon]:
    """Polygons of a geometry, without slivers thinner than rounding.

    Args:
        geometry: of any kind.
        grid: to which what meets is rounded [m].
        fill: close holes that are such slivers too: gaps between what met.
    """
    parts = [part for part in shapely.get_parts(geometry) if not _is_sliver(part, grid)]
    return [_filled(part, grid) for part in parts] if fill else parts


def _is_sliver(part: shapely.Geometry, grid: float) -> bool:
    return part.geom_type != "Polygon" or bool(part.area <= 10.0 * grid * part.length)


def _filled(part: shapely.Polygon, grid: float) -> shapely.Polygon:
    holes = [hole for hole in part.interiors if not _is_sliver(shapely.Polygon(hole), grid)]
    return part if len(holes) == len(part.interiors) else shapely.Polygon(part.exterior, holes)


def _almost_touches(parts: list[shapely.Polygon], grid: float) -> bool:
    """Whether a corner lies next to a corner or an edge other than those beside it."""
    _, points, (ring_start, _) = shapely.to_ragged_array(parts)
    starts = np.asarray(ring_start, dtype=np.int64)
    order = np.argsort(points[:, 0], kind="stable")
    return bool(_has_near_miss(points, starts, order, max(_APART, 10.0 * grid)))


@kernel
def _is_near(points: Array, corner: int, a: int, b: int, apart: float) -> bool:
    """Whether a corner is nearer than `apart` to the edge from a to b."""
    ex, ey = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    wx, wy = points[corner, 0] - points[a, 0], points[corner, 1] - points[a, 1]
    square = ex * ex + ey * ey
    along = 0.0 if square == 0.0 else min(max((wx * ex + wy * ey) / square, 0.0), 1.0)
    dx, dy = wx - along * ex, wy - along * ey
    return bool(dx * dx + dy * dy <= apart * apart)


@kernel
def _has_near_miss(points: Array, ring_start: Indices, order: Indices, apart: float) -> bool:
    """`order` sorts the corners of the closed rings by x."""
    ring_of = np.empty(points.shape[0], dtype=np.int64)
    for ring in range(ring_start.size - 1):
        ring_of[ring_start[ring] : ring_start[ring + 1]] = ring
    xs = points[order, 0]
    for ring in range(ring_start.size - 1):
        first, last = ring_start[ring], ring_start[ring + 1] - 1  # `last` repeats `first`
        for a in range(first, last):
            b = a + 1
            if math.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) <= apart:
                return True
            low = min(points[a, 0], points[b, 0]) - apart
            high = max(points[a, 0], points[b, 0]) + apart
            low_y = min(points[a, 1], points[b, 1]) - apart
            high_y = max(points[a, 1], points[b, 1]) + apart
            k = np.searchsorted(xs, low)
            while k < xs.size and xs[k] <= high:
                corner = order[k]
                k += 1
                if points[corner, 1] < low_y or points[corner, 1] > high_y:
                    continue
                if ring_of[corner] == ring:
                    own = first if corner == last else corner
                    if own in (a, first if b == last else b):
                        continue
                if _is_near(points, corner, a, b, apart):
                    return True
    return False
