"""What can be seen and wrapped from the places of a tile, for `cost_tiles`.

A tile is taken as the disc about it: what holds for all places of the disc, does for the tile.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.goal_field import GoalField
from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.pathrtr import BACKWARD
from motm_wbc.basenav.search import SAME_TURN, first_from
from motm_wbc.basenav.visibility import LEFT
from motm_wbc.basenav.walls import (
    AFTER_X,
    AFTER_Y,
    BEFORE_X,
    BEFORE_Y,
    RING,
    TOUCH,
    TURN,
    Indices,
    Walls,
    X,
    Y,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

HIDDEN = -1
"""Instead of an end: the place can't be seen from anywhere in the tile."""

_SLACK = 1e-7  # [s], [m] and [rad]: far above rounding, far below what matters
_NEAR = 0.7  # [rad] spread above which all of a chain counts


class WayList(NamedTuple):
    """Ways from a tile that may be tangents, in any order.

    Attributes:
        least: (k,) least time to the goal from anywhere in the tile, without the first turn [s].
        angle: (k,) direction of the corner from the tile's centre [rad].
        spread: (k,) how far the direction may be off that from elsewhere [rad].
        chain: (k,) chain that is driven to.
        gear: (k,) in which.
    """

    least: Array
    angle: Array
    spread: Array
    chain: Indices
    gear: Indices


@lean
def rings_at(walls: Walls, cx: float, cy: float, half: float, rings: Indices, count: int) -> int:
    """Append the outlines whose boxes meet a square to `rings`; its new length."""
    for ring in range(walls.ring_box.shape[0]):
        low_x, low_y, high_x, high_y = walls.ring_box[ring]
        reach = half + _SLACK
        if low_x > cx + reach or high_x < cx - reach:
            continue
        if low_y > cy + reach or high_y < cy - reach:
            continue
        rings[count] = ring
        count += 1
    return count


@lean
def _spans(
    walls: Walls, ring: int, cx: float, cy: float, radius: float,
    dx: float, dy: float, length: float,
) -> bool:  # fmt: skip
    """Whether an outline crosses every line from the disc about c to the place at `length`.

    It does if it lies wholly between the two and has corners on both sides of all the lines.
    """
    left = right = False
    widest = radius / math.sqrt(length * length - radius * radius)
    for corner in range(walls.ring_start[ring], walls.ring_start[ring + 1]):
        wx, wy = walls.corners[corner, X] - cx, walls.corners[corner, Y] - cy
        along, beside = dx * wx + dy * wy, dx * wy - dy * wx
        if along <= radius + _SLACK or along >= length - _SLACK:
            return False
        limit = (length - along) * widest + _SLACK
        left = left or beside > limit
        right = right or beside < -limit
    return left and right


@lean
def hiding_rings(
    walls: Walls,
    convex: Indices,
    cx: float,
    cy: float,
    radius: float,
    tx: float,
    ty: float,
    corner: int,
    rings: Indices,
    count: int,
) -> int:
    """Append to `rings` the outlines that may hide a place from some of the disc.

    Args:
        walls: outlines.
        convex: (r,) 1 for those that only turn left.
        cx: centre of the disc [m].
        cy: centre [m].
        radius: of the disc [m].
        tx: the place [m].
        ty: the place [m].
        corner: that the place is, -1 if it is none. A tangent never enters the outline that
            it touches, if that is convex.
        rings: numbers of outlines.
        count: how many there are.

    Returns:
        How many there are then, or `HIDDEN`.
    """
    own = -1
    if corner >= 0 and convex[walls.links[corner, RING]] == 1:
        own = walls.links[corner, RING]
    wx, wy = tx - cx, ty - cy
    length = math.sqrt(wx * wx + wy * wy)
    far = length > 1.5 * radius
    dx, dy = (wx / length, wy / length) if far else (1.0, 0.0)
    low_x, high_x = min(cx - radius, tx) - _SLACK, max(cx + radius, tx) + _SLACK
    low_y, high_y = min(cy - radius, ty) - _SLACK, max(cy + radius, ty) + _SLACK
    for ring in range(walls.ring_box.shape[0]):
        x0, y0, x1, y1 = walls.ring_box[ring]
        if ring == own or x0 > high_x or x1 < low_x or y0 > high_y or y1 < low_y:
            continue
        if far:
            off = abs(dx * (0.5 * (y0 + y1) - cy) - dy * (0.5 * (x0 + x1) - cx))
            if off > 0.5 * (abs(dx) * (y1 - y0) + abs(dy) * (x1 - x0)) + radius + _SLACK:
                continue
            if _spans(walls, ring, cx, cy, radius, dx, dy, length):
                return HIDDEN
        rings[count] = ring
        count += 1
    return count


@lean
def _may_wrap(corners: Array, corner: int, side: int, wx: float, wy: float, radius: float) -> bool:
    """Whether a corner, (wx, wy) from the disc's centre, can be wrapped from somewhere in it."""
    bx, by = corners[corner, BEFORE_X], corners[corner, BEFORE_Y]
    ax, ay = corners[corner, AFTER_X], corners[corner, AFTER_Y]
    sign = 1.0 if side == LEFT else -1.0
    before = sign * (wx * by - wy * bx) + radius * math.sqrt(bx * bx + by * by)
    after = sign * (wx * ay - wy * ax) + radius * math.sqrt(ax * ax + ay * ay)
    return bool(before >= -_SLACK and after >= -_SLACK)


@lean
def _least_onward(field: GoalField, chain: int, gear: int, low: float, high: float) -> float:
    """Least time from a chain on [s], reached with a turn in [low, high] [rad]."""
    end = field.chain_start[chain + 1]
    least = math.inf
    for k in range(first_from(field.exit_turn, field.chain_start[chain], end, low), end):
        turn = max(field.exit_turn[k] - high, 0.0) / field.speeds.turning
        least = min(least, field.exit_cost[k, gear] + turn)
        if field.exit_turn[k] > high + SAME_TURN:
            break
    return least


@kernel
def find_ways(field: GoalField, cx: float, cy: float, radius: float) -> WayList:
    """All ways that may be tangents from somewhere in a disc, in sight or not."""
    corners, speeds = field.walls.corners, field.speeds
    most = 4 * corners.shape[0]
    least, angles, spreads = np.empty(most), np.empty(most), np.empty(most)
    chains, gears = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    count = 0
    for corner in range(corners.shape[0]):
        if corners[corner, TURN] <= 0.0:
            continue
        wx, wy = corners[corner, X] - cx, corners[corner, Y] - cy
        for side in range(2):
            chain = 2 * corner + side
            if field.chain_bound[chain] == math.inf:
                continue
            if not _may_wrap(corners, corner, side, wx, wy, radius):
                continue
            length, angle = math.sqrt(wx * wx + wy * wy), math.atan2(wy, wx)
            spread = math.asin(radius / length) + _SLACK if length > radius else math.pi
            low, high = -math.inf, math.inf
            if spread < _NEAR:
                turn = chain_turn(corners, corner, side, angle)
                low, high = turn - spread, turn + spread
            for gear in range(2):
                speed = speeds.backward if gear == BACKWARD else speeds.forward
                if speed <= 0.0:
                    continue
                bound = _least_onward(field, chain, gear, low, high)
                if bound == math.inf:
                    continue
                bound += max(length - radius - TOUCH, 0.0) / speed - _SLACK
                least[count], angles[count], spreads[count] = bound, angle, spread
                chains[count], gears[count] = chain, gear
                count += 1
    return WayList(least[:count], angles[:count], spreads[:count], chains[:count], gears[:count])
