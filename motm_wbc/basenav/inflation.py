"""Obstacles grown by a disc, and united: the free space of a point robot.

An inflated outline contains the exact one: its corners circumscribe the arc, so that no
path comes nearer to the obstacle than the radius (inscribed arcs would cut it short).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from motm_wbc.basenav.obstacle import Solid
from motm_wbc.geometry.arrays import Array

_QUARTER_SEGMENTS = 4
_ARC = 0.5 * math.pi / _QUARTER_SEGMENTS  # [rad] largest turn between outline segments


def snap_grid(extent: float) -> float:
    """Grid to which outlines are rounded before they are united [m].

    Outlines that meet up to rounding then meet exactly, at common corners; 1e-11 m within
    1 km of the origin, coarser beyond, as doubles are.
    """
    decades = math.ceil(math.log10(max(extent, 1000.0)))
    return float(10.0 ** (decades - 14))


def free_space(
    solids: Sequence[Solid], boundary: Array | None, radius: float
) -> tuple[MultiPolygon, bool]:
    """What a disc's centre can't (or, inside a boundary, can) be at.

    Args:
        solids: simple polygons, holes allowed.
        boundary: (n, 2) counter-clockwise outline that the disc must stay in, or None.
        radius: of the disc [m].

    Returns:
        The blocked region and False, or, if there is a boundary, the free region and True.
        Both are noded: where two outlines touch, both have a corner.
    """
    outlines = [solid.outline for solid in solids]
    every = outlines if boundary is None else [*outlines, boundary]
    grid = snap_grid(max((float(np.abs(points).max()) for points in every), default=0.0))
    grown = [piece for solid in solids for piece in _grow(solid, radius)]
    blocked = shapely.union_all(grown, grid_size=grid)
    if boundary is None:
        return _polygons(blocked, grid), False
    outside = boundary[::-1]  # blocked on the left of its edges, as for obstacles
    rim = [Polygon(piece) for piece in _offset_pieces(outside, radius)] if radius > 0.0 else []
    free = shapely.difference(
        Polygon(boundary), shapely.union_all([blocked, *rim], grid_size=grid), grid_size=grid
    )
    return _polygons(free, grid), True


def _polygons(geometry: shapely.Geometry, grid: float) -> MultiPolygon:
    """Polygons of a geometry, without slivers thinner than rounding."""
    parts = shapely.get_parts(geometry)
    return MultiPolygon(
        [
            part
            for part in parts
            if part.geom_type == "Polygon" and part.area > 10.0 * grid * part.length
        ]
    )


def _grow(solid: Solid, radius: float) -> Iterator[Polygon]:
    """Polygons whose union is the solid grown by a disc."""
    convex = not solid.holes and (_turns(solid.outline) >= 0.0).all()
    if convex and radius > 0.0:
        yield Polygon(np.vstack([_fan(*corner, radius) for corner in _corners(solid.outline)]))
        return
    yield Polygon(solid.outline, solid.holes)
    if radius > 0.0:
        for ring in solid.rings:
            yield from (Polygon(piece) for piece in _offset_pieces(ring, radius))


def _offset_pieces(ring: Array, radius: float) -> Iterator[Array]:
    """Strips along the edges and sectors at the corners, on the right of the ring."""
    following = np.roll(ring, -1, axis=0)
    for point, (start, turn), after in zip(ring, _normals(ring), following, strict=True):
        end = start + turn  # normal angle of the outgoing edge
        offset = radius * np.array([math.cos(end), math.sin(end)])
        yield np.array([point, after, after + offset, point + offset])
        if turn > 0.0:
            first = point + radius * np.array([math.cos(start), math.sin(start)])
            arc = _fan(point, start, turn, radius)
            yield np.vstack([point[None], first[None], arc, (point + offset)[None]])


def _corners(ring: Array) -> Iterator[tuple[Array, float, float]]:
    for point, (start, turn) in zip(ring, _normals(ring), strict=True):
        yield point, start, turn


def _normals(ring: Array) -> Iterator[tuple[float, float]]:
    """For each corner: angle of the incoming edge's outer normal, and its turn [rad]."""
    incoming = ring - np.roll(ring, 1, axis=0)
    for edge, turn in zip(incoming, _turns(ring), strict=True):
        yield math.atan2(edge[1], edge[0]) - 0.5 * math.pi, float(turn)


def _turns(ring: Array) -> Array:
    incoming = ring - np.roll(ring, 1, axis=0)
    outgoing = np.roll(incoming, -1, axis=0)
    cross = incoming[:, 0] * outgoing[:, 1] - incoming[:, 1] * outgoing[:, 0]
    return np.asarray(np.arctan2(cross, (incoming * outgoing).sum(axis=1)))


def _fan(point: Array, start: float, turn: float, radius: float) -> Array:
    """Corners of the outline that circumscribes the arc about a convex corner."""
    count = max(1, math.ceil(turn / _ARC - 1e-9))
    step = turn / count
    angles = start + step * (np.arange(count) + 0.5)
    outer = radius / math.cos(0.5 * step)
    return np.asarray(point + outer * np.column_stack([np.cos(angles), np.sin(angles)]))
