"""Obstacles grown by a disc: the free space of a point robot.

An inflated outline contains the exact one: its corners circumscribe the arc, so that no
path comes nearer to the obstacle than the radius (inscribed arcs would cut it short).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import Polygon

from motm_wbc.basenav.union import united
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

Box: TypeAlias = tuple[float, float, float, float]
"""x and y of the lower, then of the upper bound [m]."""

_EVERYWHERE = (-math.inf, -math.inf, math.inf, math.inf)
_QUARTER_SEGMENTS = 4
_ARC = 0.5 * math.pi / _QUARTER_SEGMENTS  # [rad] largest turn between outline segments
OUTER = 1.0 / math.cos(0.5 * _ARC)
"""An inflated outline is at most `OUTER` x radius away from its obstacle."""


def grow_convex(
    points: Array, starts: Indices, ends: Indices, radius: float
) -> list[shapely.Polygon]:
    """Convex polygons grown by a disc, all at once.

    Args:
        points: (n, 2) corners [m].
        starts: (s,) first corner of each polygon, counter-clockwise.
        ends: (s,) one past the last one.
        radius: of the disc [m].
    """
    corners, ring = _fans(points, starts, ends, radius)
    return list(shapely.polygons(shapely.linearrings(corners, indices=ring)))


def grow(rings: tuple[Array, ...], radius: float) -> tuple[shapely.Polygon, ...]:
    """Polygons that a polygon (outline and holes) grown by a disc consists of.

    Args:
        rings: (n, 2) each, with what is blocked on their left [m].
        radius: of the disc [m].
    """
    solid = Polygon(rings[0], rings[1:])
    if radius == 0.0:
        return (solid,)
    rims = [piece for ring in rings for piece in offset_pieces(ring, radius)]
    return tuple(united([solid, *rims]))


def shrink(boundary: Array, radius: float) -> tuple[shapely.Polygon, ...]:
    """Polygons that are left of a floor where the disc's centre must stay.

    Args:
        boundary: (n, 2) counter-clockwise outline of the floor [m].
        radius: of the disc [m].
    """
    floor = Polygon(boundary)
    if radius == 0.0:
        return (floor,)
    rim = united(offset_pieces(boundary[::-1], radius))
    return tuple(united([floor], without=rim))


def offset_pieces(ring: Array, radius: float, box: Box | None = None) -> list[shapely.Polygon]:
    """Strips along the edges and sectors at the convex corners, on the right of a ring.

    Args:
        ring: (n, 2) [m].
        radius: of the disc [m].
        box: only those of edges that may meet it; None: all.
    """
    bounds = np.array(_EVERYWHERE if box is None else box)
    corners, piece = _offsets(np.ascontiguousarray(ring), radius, bounds)
    return list(shapely.polygons(shapely.linearrings(corners, indices=piece)))


@kernel
def _corner(points: Array, before: int, here: int, after: int) -> tuple[float, float]:
    """Angle of the incoming edge's outer normal at a corner, and the turn there [rad]."""
    ix, iy = points[here, 0] - points[before, 0], points[here, 1] - points[before, 1]
    ox, oy = points[after, 0] - points[here, 0], points[after, 1] - points[here, 1]
    turn = math.atan2(ix * oy - iy * ox, ix * ox + iy * oy)
    return math.atan2(iy, ix) - 0.5 * math.pi, turn


@kernel
def turning(ring: Array) -> tuple[float, float, float]:
    """How a ring turns to the left at its corners: least, most, and in all [rad]."""
    least, most, total = math.inf, -math.inf, 0.0
    count = ring.shape[0]
    for here in range(count):
        after = 0 if here + 1 == count else here + 1
        _, turn = _corner(ring, here - 1 if here > 0 else count - 1, here, after)
        least, most, total = min(least, turn), max(most, turn), total + turn
    return least, most, total


@kernel
def _fan(
    x: float, y: float, start: float, turn: float, radius: float, out: Array, count: int
) -> int:
    """Writes the corners that circumscribe the arc about a convex corner; how many there are.

    They go to `out` from row `count` on; returns the row after the last one.
    """
    steps = max(1, math.ceil(turn / _ARC - 1e-9))
    step = turn / steps
    outer = radius / math.cos(0.5 * step)
    for k in range(steps):
        angle = start + step * (k + 0.5)
        out[count, 0] = x + outer * math.cos(angle)
        out[count, 1] = y + outer * math.sin(angle)
        count += 1
    return count


@kernel
def _fans(points: Array, starts: Indices, ends: Indices, radius: float) -> tuple[Array, Indices]:
    """Closed rings of convex polygons grown by a disc: corners, and the ring of each."""
    total = 0
    for k in range(starts.size):
        total += ends[k] - starts[k] + 4 * _QUARTER_SEGMENTS + 2
    out = np.empty((total, 2))
    ring = np.empty(total, dtype=np.int64)
    count = 0
    for k in range(starts.size):
        first = count
        for here in range(starts[k], ends[k]):
            if radius == 0.0:
                out[count] = points[here]
                count += 1
                continue
            before = ends[k] - 1 if here == starts[k] else here - 1
            after = starts[k] if here + 1 == ends[k] else here + 1
            start, turn = _corner(points, before, here, after)
            count = _fan(points[here, 0], points[here, 1], start, turn, radius, out, count)
        out[count] = out[first]
        count += 1
        ring[first:count] = k
    return out[:count], ring[:count]


@kernel
def _offset(ring: Array, a: int, b: int, radius: float) -> tuple[float, float]:
    """From the edge between two corners to its outline on the right [m].

    One for the pieces on either side of a corner: they then meet to the bit.
    """
    ex, ey = ring[b, 0] - ring[a, 0], ring[b, 1] - ring[a, 1]
    length = math.hypot(ex, ey)
    return radius * ey / length, -radius * ex / length


@kernel
def _offsets(ring: Array, radius: float, box: Array) -> tuple[Array, Indices]:
    """Closed rings of the pieces of `offset_pieces`: corners, and the piece of each."""
    corners = ring.shape[0]
    most = corners * (5 + 4 + 2 * _QUARTER_SEGMENTS + 1)
    out = np.empty((most, 2))
    piece = np.empty(most, dtype=np.int64)
    count, pieces = 0, 0
    for here in range(corners):
        before = here - 1 if here > 0 else corners - 1
        after = 0 if here + 1 == corners else here + 1
        x, y, ax, ay = ring[here, 0], ring[here, 1], ring[after, 0], ring[after, 1]
        if max(x, ax) < box[0] or min(x, ax) > box[2] or max(y, ay) < box[1] or min(y, ay) > box[3]:
            continue
        dx, dy = _offset(ring, here, after, radius)
        first = count
        out[count, 0], out[count, 1] = x, y
        out[count + 1, 0], out[count + 1, 1] = ax, ay
        out[count + 2, 0], out[count + 2, 1] = ax + dx, ay + dy
        out[count + 3, 0], out[count + 3, 1] = x + dx, y + dy
        out[count + 4, 0], out[count + 4, 1] = x, y
        count += 5
        piece[first:count] = pieces
        pieces += 1
        start, turn = _corner(ring, before, here, after)
        if turn > 0.0:
            first = count
            bx, by = _offset(ring, before, here, radius)
            out[count, 0], out[count, 1] = x, y
            out[count + 1, 0], out[count + 1, 1] = x + bx, y + by
            count = _fan(x, y, start, turn, radius, out, count + 2)
            out[count, 0], out[count, 1] = x + dx, y + dy
            out[count + 1, 0], out[count + 1, 1] = x, y
            count += 2
            piece[first:count] = pieces
            pieces += 1
    return out[:count], piece[:count]
