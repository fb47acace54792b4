"""Which places are joined at all: the free space falls into rooms, told apart by outlines.

A room lies inside the outline that encloses it (a hole of what is blocked, or a boundary),
the innermost one; outside of all of them there is one more. Finding it takes no graph.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.visibility import is_blocked, nearest_on_ring
from motm_wbc.basenav.walls import LENGTH, NEXT, UX, UY, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_OUTSIDE, _UNKNOWN = -1, -2
_BESIDE = 1e-6  # [m] so near to an outline, rounding could decide which side of it one is on


@kernel
def _doubled_area(walls: Walls, ring: int) -> float:
    """Twice the signed area of a ring; negative where what is free lies inside [m^2]."""
    corners = walls.corners
    first = walls.ring_start[ring]
    area = 0.0
    for a in range(first, walls.ring_start[ring + 1]):
        b = walls.links[a, NEXT]
        ax, ay = corners[a, X] - corners[first, X], corners[a, Y] - corners[first, Y]
        bx, by = corners[b, X] - corners[first, X], corners[b, Y] - corners[first, Y]
        area += ax * by - ay * bx
    return area


@kernel
def _encloses(walls: Walls, ring: int, x: float, y: float) -> bool:
    corners = walls.corners
    inside = False
    for a in range(walls.ring_start[ring], walls.ring_start[ring + 1]):
        b = walls.links[a, NEXT]
        ay, by = corners[a, Y], corners[b, Y]
        if (ay > y) != (by > y):
            crossing = corners[a, X] + (y - ay) * (corners[b, X] - corners[a, X]) / (by - ay)
            inside = inside != (x < crossing)
    return inside


@kernel
def _room_at(walls: Walls, x: float, y: float) -> int:
    """The innermost ring that encloses a place with what is free inside; or `_OUTSIDE`."""
    room, least = _OUTSIDE, math.inf
    for ring in range(walls.ring_box.shape[0]):
        box = walls.ring_box[ring]
        if not (box[0] <= x <= box[2] and box[1] <= y <= box[3]):
            continue
        area = _doubled_area(walls, ring)
        if area < 0.0 and -area < least and _encloses(walls, ring, x, y):
            room, least = ring, -area
    return room


@kernel
def _room_of(walls: Walls, x: float, y: float) -> int:
    """The room of a place, or that it is pushed out to; `_UNKNOWN` where rings touch."""
    nearest, distance, second = -1, math.inf, math.inf
    point = np.empty(2)
    for ring in range(walls.ring_box.shape[0]):
        away = nearest_on_ring(walls, ring, x, y, point)
        if away < distance:
            nearest, distance, second = ring, away, distance
        else:
            second = min(second, away)
    if distance > _BESIDE and not is_blocked(walls, x, y):
        return _room_at(walls, x, y)
    if nearest < 0 or second - distance <= _BESIDE:
        return _UNKNOWN
    if _doubled_area(walls, nearest) < 0.0:
        return nearest
    a = walls.ring_start[nearest]  # rings touch at corners only: not halfway along an edge
    half = 0.5 * walls.corners[a, LENGTH]
    return _room_at(
        walls,
        walls.corners[a, X] + half * walls.corners[a, UX],
        walls.corners[a, Y] + half * walls.corners[a, UY],
    )


@kernel
def may_be_joined(walls: Walls, start: Array, goal: Array) -> bool:
    """Whether a path can lead from one place to another: if not, surely none does.

    A place inside what is blocked counts as pushed out: the goal to the nearest free point,
    the start to any outline.

    Args:
        walls: all outlines of a world.
        start: (2,) [m].
        goal: (2,) [m].
    """
    if is_blocked(walls, start[0], start[1]):
        return True
    begin, end = _room_of(walls, start[0], start[1]), _room_of(walls, goal[0], goal[1])
    return begin in (end, _UNKNOWN) or end == _UNKNOWN
