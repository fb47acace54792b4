"""Lines of sight, tangents and the nearest free point, as compiled kernels.

What is blocked is open: a line may run along an edge and through corners. Where two
outlines touch, no line passes between them. Everything within `TOUCH` of a line counts as
on it, so that rounding never decides.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.walls import (
    AFTER_X,
    AFTER_Y,
    BEFORE_X,
    BEFORE_Y,
    LENGTH,
    NEXT,
    TOUCH,
    TURN,
    TWIN,
    UX,
    UY,
    Indices,
    Walls,
    X,
    Y,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

LEFT, RIGHT, NEITHER = 0, 1, -1


# Kernels that are called often take the arrays of `Walls`, not the tuple: numba counts
# references whenever an array is taken out of a tuple.


@lean
def side_of(corners: Array, corner: int, dx: float, dy: float) -> int:
    """On which side of the line through a corner its blocked sector lies.

    Args:
        corners: as in `Walls`.
        corner: index of the corner.
        dx: x of the line's unit direction.
        dy: y of it.

    Returns:
        LEFT, RIGHT, or NEITHER if the line cuts into the sector.
    """
    s_before = dx * corners[corner, BEFORE_Y] - dy * corners[corner, BEFORE_X]
    s_after = dx * corners[corner, AFTER_Y] - dy * corners[corner, AFTER_X]
    on_before, on_after = abs(s_before) <= TOUCH, abs(s_after) <= TOUCH
    if on_before and on_after:  # the line runs along both edges
        along = dx * corners[corner, AFTER_X] + dy * corners[corner, AFTER_Y]
        return LEFT if along > 0.0 else RIGHT
    if corners[corner, TURN] <= 0.0:
        return NEITHER
    if (on_before or s_before > 0.0) and (on_after or s_after > 0.0):
        return LEFT
    if (on_before or s_before < 0.0) and (on_after or s_after < 0.0):
        return RIGHT
    return NEITHER


@lean
def may_be_tangent(corners: Array, corner: int, wx: float, wy: float) -> bool:
    """Quick necessary test of a line (wx, wy) [m], not normalised, through a corner."""
    if corners[corner, TURN] <= 0.0:
        return False
    slack = TOUCH * (abs(wx) + abs(wy))
    s_before = wx * corners[corner, BEFORE_Y] - wy * corners[corner, BEFORE_X]
    s_after = wx * corners[corner, AFTER_Y] - wy * corners[corner, AFTER_X]
    if s_before < -slack or s_after < -slack:
        return bool(s_before <= slack and s_after <= slack)
    return True


@lean
def tangent_side(corners: Array, links: Indices, corner: int, dx: float, dy: float) -> int:
    """Side of the obstacle that a taut path along (dx, dy) can wrap at a corner.

    Where outlines touch, all of them must lie on that side: a path that bends round one
    of them would otherwise pass between them.
    """
    side = side_of(corners, corner, dx, dy)
    twin = links[corner, TWIN]
    while side != NEITHER and twin != corner:
        if side_of(corners, twin, dx, dy) != side:
            return NEITHER
        twin = links[twin, TWIN]
    return side


@lean
def _enters(turn: float, s_before: float, s_after: float) -> bool:
    """Whether a ray from a corner runs strictly inside its blocked sector.

    `s_before` and `s_after` are the signs of the neighbours' side of the ray, 0 on it.
    """
    if turn > 0.0:
        return s_after < 0.0 and s_before > 0.0
    return s_after < 0.0 or s_before > 0.0


@lean
def _corner_blocks(
    corners: Array,
    links: Indices,
    corner: int,
    dx: float,
    dy: float,
    along: float,
    length: float,
    s_before: float,
    s_after: float,
) -> bool:
    """Whether a corner on the line blocks the segment: it lies `along` from its start.

    `s_before` and `s_after` are the distances of its neighbours left of the line.
    """
    s_before = 0.0 if abs(s_before) <= TOUCH else s_before
    s_after = 0.0 if abs(s_after) <= TOUCH else s_after
    turn = corners[corner, TURN]
    if along < length - TOUCH and _enters(turn, s_before, s_after):
        return True
    if along > TOUCH and _enters(turn, -s_before, -s_after):
        return True
    twin = links[corner, TWIN]
    if twin != corner and TOUCH < along < length - TOUCH:
        side = side_of(corners, corner, dx, dy)
        while twin != corner:
            if side_of(corners, twin, dx, dy) != side:
                return True
            twin = links[twin, TWIN]
    return False


@lean
def _ring_blocks(
    corners: Array,
    links: Indices,
    first: int,
    end: int,
    px: float,
    py: float,
    dx: float,
    dy: float,
    length: float,
) -> bool:
    """Whether the ring of corners [first, end) blocks the segment from p along (dx, dy)."""
    a = end - 1
    s_a = dx * (corners[a, Y] - py) - dy * (corners[a, X] - px)
    for b in range(first, end):
        s_b = dx * (corners[b, Y] - py) - dy * (corners[b, X] - px)
        if (s_a > TOUCH and s_b < -TOUCH) or (s_a < -TOUCH and s_b > TOUCH):
            # the edge crosses the line; p_left, q_left: the ends' distance left of the edge
            ux, uy = corners[a, UX], corners[a, UY]
            p_left = ux * (py - corners[a, Y]) - uy * (px - corners[a, X])
            q_left = p_left + length * (ux * dy - uy * dx)
            if max(p_left, q_left) > TOUCH and min(p_left, q_left) <= TOUCH:
                return True
        elif abs(s_b) <= TOUCH:
            along = dx * (corners[b, X] - px) + dy * (corners[b, Y] - py)
            if -TOUCH <= along <= length + TOUCH:
                c = first if b + 1 == end else b + 1
                s_c = dx * (corners[c, Y] - py) - dy * (corners[c, X] - px)
                if _corner_blocks(corners, links, b, dx, dy, along, length, s_a, s_c):
                    return True
        a, s_a = b, s_b
    return False


@lean
def sees(
    corners: Array,
    links: Indices,
    ring_start: Indices,
    boxes: Array,
    px: float,
    py: float,
    qx: float,
    qy: float,
) -> bool:
    """`line_of_sight` on the arrays of `Walls`."""
    wx, wy = qx - px, qy - py
    length = math.sqrt(wx * wx + wy * wy)
    if length <= TOUCH:
        return True
    dx, dy = wx / length, wy / length
    low_x, high_x = min(px, qx) - TOUCH, max(px, qx) + TOUCH
    low_y, high_y = min(py, qy) - TOUCH, max(py, qy) + TOUCH
    for ring in range(boxes.shape[0]):
        x0, y0, x1, y1 = boxes[ring, 0], boxes[ring, 1], boxes[ring, 2], boxes[ring, 3]
        if x0 > high_x or x1 < low_x or y0 > high_y or y1 < low_y:
            continue
        off = abs(dx * (0.5 * (y0 + y1) - py) - dy * (0.5 * (x0 + x1) - px))
        if off > 0.5 * (abs(dx) * (y1 - y0) + abs(dy) * (x1 - x0)) + TOUCH:
            continue
        if _ring_blocks(
            corners, links, ring_start[ring], ring_start[ring + 1], px, py, dx, dy, length
        ):
            return False
    return True


@lean
def line_of_sight(walls: Walls, px: float, py: float, qx: float, qy: float) -> bool:
    """Whether the segment from p to q is free. Both points must be free themselves."""
    return sees(walls.corners, walls.links, walls.ring_start, walls.ring_box, px, py, qx, qy)


@lean
def is_blocked(walls: Walls, x: float, y: float) -> bool:
    """Whether a point lies inside what is blocked (on an outline: either answer)."""
    corners, boxes = walls.corners, walls.ring_box
    inside = False
    for ring in range(boxes.shape[0]):
        if not (boxes[ring, 0] <= x <= boxes[ring, 2] and boxes[ring, 1] <= y <= boxes[ring, 3]):
            continue
        first, end = walls.ring_start[ring], walls.ring_start[ring + 1]
        a = end - 1
        for b in range(first, end):
            ay, by = corners[a, Y], corners[b, Y]
            if (ay > y) != (by > y):
                crossing = corners[a, X] + (y - ay) * (corners[b, X] - corners[a, X]) / (by - ay)
                if x < crossing:
                    inside = not inside
            a = b
    return bool(inside != (walls.bounded > 0.0))


@lean
def nearest_on_edge(
    corners: Array, links: Indices, a: int, x: float, y: float
) -> tuple[float, float]:
    """Nearest point of the edge from corner a to the next one [m]."""
    ux, uy = corners[a, UX], corners[a, UY]
    wx, wy = x - corners[a, X], y - corners[a, Y]
    along = min(max(wx * ux + wy * uy, 0.0), corners[a, LENGTH])
    if along == corners[a, LENGTH]:
        after = links[a, NEXT]
        return corners[after, X], corners[after, Y]
    return corners[a, X] + along * ux, corners[a, Y] + along * uy


@lean
def nearest_on_ring(walls: Walls, ring: int, x: float, y: float, out: Array) -> float:
    """Distance [m] to a ring; its nearest point is written to `out` (2,)."""
    corners, links = walls.corners, walls.links
    best = math.inf
    for a in range(walls.ring_start[ring], walls.ring_start[ring + 1]):
        nx, ny = nearest_on_edge(corners, links, a, x, y)
        square = (x - nx) * (x - nx) + (y - ny) * (y - ny)
        if square < best:
            best = square
            out[0], out[1] = nx, ny
    return math.sqrt(best)


@kernel
def push_out(walls: Walls, x: float, y: float, out: Array) -> float:
    """The nearest free point, written to `out` (2,), and the distance to it [m].

    Zero and the point itself if it is free; infinite if nothing is free.
    """
    out[0], out[1] = x, y
    if not is_blocked(walls, x, y):
        return 0.0
    best, boxes = math.inf, walls.ring_box
    point = np.empty(2)
    for ring in range(boxes.shape[0]):
        dx = max(boxes[ring, 0] - x, x - boxes[ring, 2], 0.0)
        dy = max(boxes[ring, 1] - y, y - boxes[ring, 3], 0.0)
        if dx * dx + dy * dy >= best * best:
            continue
        distance = nearest_on_ring(walls, ring, x, y, point)
        if distance < best:
            best = distance
            out[0], out[1] = point[0], point[1]
    return best
