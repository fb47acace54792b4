"""Exact PathRTR time from any pose to a goal, out of one backward search for each goal.

A query is the straight line to the goal, or a tangent from the pose to a corner and the
remaining time from there, which depends on the direction of arrival.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.outlines import Ellipse
from motm_wbc.basenav.pathrtr import BACKWARD, FORWARD, Speeds, end_turn, turn_between
from motm_wbc.basenav.search import first_from
from motm_wbc.basenav.visibility import (
    NEITHER,
    is_blocked,
    may_be_tangent,
    nearest_on_edge,
    nearest_on_ring,
    push_out,
    sees,
    tangent_side,
)
from motm_wbc.basenav.walls import TOUCH, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

# columns of GoalField.goals
HEADING, EXTRA = 2, 3


class GoalField(NamedTuple):
    """What a query needs; arrays and floats only, so that kernels take it as one argument.

    Attributes:
        walls: outlines of the free space.
        chain_start: (2 n + 1,) first exit of each chain (see `graph`).
        exit_turn: (e,) turn at which each exit lies on its chain [rad], ascending.
        exit_cost: (e, 2) time to a goal from there [s], by this exit or a later one of the
            chain, forward and backward.
        chain_bound: (2 n,) least time to a goal from anywhere on a chain [s].
        ring_bound: (r,) the same of all chains of a ring.
        goals: (g, 4) x, y [m], heading [rad] or NaN if free, time added [s].
        speeds: speeds of the base.
        ellipse: where the outlines are the whole world's; beyond, some may be missing.
    """

    walls: Walls
    chain_start: Indices
    exit_turn: Array
    exit_cost: Array
    chain_bound: Array
    ring_bound: Array
    goals: Array
    speeds: Speeds
    ellipse: Ellipse


@lean
def by_chain(
    chain_start: Indices,
    exit_turn: Array,
    exit_cost: Array,
    chain: int,
    turn: float,
    gear: int,
    turning: float,
) -> float:
    """Time to a goal [s] once a path has reached a chain with the given turn [rad]."""
    end = chain_start[chain + 1]
    k = first_from(exit_turn, chain_start[chain], end, turn)
    if k == end:
        return math.inf
    return float(exit_cost[k, gear] + abs(exit_turn[k] - turn) / turning)


@lean
def _by_corner(
    corners: Array,
    chain_start: Indices,
    exit_turn: Array,
    exit_cost: Array,
    speeds: Speeds,
    chain: int,
    x: float,
    y: float,
    heading: float,
) -> tuple[float, int]:
    """Time to the goal [s] from (x, y) by the tangent to a chain, and the better gear."""
    dx, dy = corners[chain // 2, X] - x, corners[chain // 2, Y] - y
    angle, length = math.atan2(dy, dx), math.sqrt(dx * dx + dy * dy)
    turn = chain_turn(corners, chain // 2, chain % 2, angle)
    turned = end_turn(angle, heading, FORWARD)
    ahead = by_chain(chain_start, exit_turn, exit_cost, chain, turn, FORWARD, speeds.turning)
    ahead += turned / speeds.turning + length / speeds.forward
    if speeds.backward > 0.0 and length / speeds.backward < ahead:
        turned = end_turn(angle, heading, BACKWARD)
        back = by_chain(chain_start, exit_turn, exit_cost, chain, turn, BACKWARD, speeds.turning)
        back += turned / speeds.turning + length / speeds.backward
        if back < ahead:
            return back, BACKWARD
    return ahead, FORWARD


@lean
def _straight(
    goals: Array, speeds: Speeds, goal: int, x: float, y: float, heading: float
) -> tuple[float, int]:
    """Time straight to a goal [s], and the better gear."""
    dx, dy = goals[goal, X] - x, goals[goal, Y] - y
    length = math.sqrt(dx * dx + dy * dy)
    toward, extra = goals[goal, HEADING], goals[goal, EXTRA]
    if length <= TOUCH:
        return turn_between(heading, toward) / speeds.turning + extra, FORWARD
    direction = math.atan2(dy, dx)
    turned = end_turn(direction, heading, FORWARD) + end_turn(direction, toward, FORWARD)
    ahead = turned / speeds.turning + length / speeds.forward
    if speeds.backward > 0.0 and length / speeds.backward < ahead:
        turned = end_turn(direction, heading, BACKWARD) + end_turn(direction, toward, BACKWARD)
        back = turned / speeds.turning + length / speeds.backward
        if back < ahead:
            return back + extra, BACKWARD
    return ahead + extra, FORWARD


@kernel
def _ring_bounds(boxes: Array, ring_bound: Array, speed: float, x: float, y: float) -> Array:
    """(r,) lower bound of the time to a goal over the corners of each ring [s]."""
    bounds = np.empty(boxes.shape[0])
    for ring in range(bounds.size):
        dx = max(boxes[ring, 0] - x, x - boxes[ring, 2], 0.0)
        dy = max(boxes[ring, 1] - y, y - boxes[ring, 3], 0.0)
        bounds[ring] = ring_bound[ring] + math.sqrt(dx * dx + dy * dy) / speed
    return bounds


@kernel
def _best_goal(
    field: GoalField, x: float, y: float, heading: float, limit: float
) -> tuple[float, int, int]:
    """Least time straight to a goal in sight [s], its gear, and the goal; -1 if not < `limit`."""
    corners, links = field.walls.corners, field.walls.links
    ring_start, boxes = field.walls.ring_start, field.walls.ring_box
    goals, speeds = field.goals, field.speeds
    speed = max(speeds.forward, speeds.backward)
    best, best_gear, best_goal = limit, FORWARD, -1
    place, seen = -1, False
    for goal in range(goals.shape[0]):
        gx, gy = goals[goal, X], goals[goal, Y]
        dx, dy = gx - x, gy - y
        if math.sqrt(dx * dx + dy * dy) / speed + goals[goal, EXTRA] >= best:
            continue
        time, gear = _straight(goals, speeds, goal, x, y, heading)
        if time < best:
            if place < 0 or goals[place, X] != gx or goals[place, Y] != gy:
                place, seen = goal, sees(corners, links, ring_start, boxes, x, y, gx, gy)
            if seen:
                best, best_gear, best_goal = time, gear, goal
    return best, best_gear, best_goal


@kernel
def _best_chain(field: GoalField, x: float, y: float, heading: float) -> tuple[float, int, int]:
    """Least time by a corner in sight [s], its gear, and the chain; -1 if there is none.

    Rings of corners are looked at in order of a lower bound of their times, and a line of
    sight is tested only for what would be the best so far.
    """
    corners, links = field.walls.corners, field.walls.links
    ring_start, boxes = field.walls.ring_start, field.walls.ring_box
    chain_start, exit_turn, exit_cost = field.chain_start, field.exit_turn, field.exit_cost
    chain_bound, speeds = field.chain_bound, field.speeds
    speed = max(speeds.forward, speeds.backward)
    best, best_gear, best_chain = math.inf, FORWARD, -1
    bounds = _ring_bounds(boxes, field.ring_bound, speed, x, y)
    for _ in range(bounds.size):
        ring = np.argmin(bounds)
        if bounds[ring] >= best:
            break
        bounds[ring] = math.inf
        for corner in range(ring_start[ring], ring_start[ring + 1]):
            cx, cy = corners[corner, X], corners[corner, Y]
            dx, dy = cx - x, cy - y
            if not may_be_tangent(corners, corner, dx, dy):
                continue
            length = math.sqrt(dx * dx + dy * dy)
            if length <= TOUCH:
                continue
            side = tangent_side(corners, links, corner, dx / length, dy / length)
            if side == NEITHER or length / speed + chain_bound[2 * corner + side] >= best:
                continue
            time, gear = _by_corner(
                corners, chain_start, exit_turn, exit_cost, speeds, 2 * corner + side, x, y, heading
            )
            if time < best and sees(corners, links, ring_start, boxes, x, y, cx, cy):
                best, best_gear, best_chain = time, gear, 2 * corner + side
    return best, best_gear, best_chain


@kernel
def first_move(field: GoalField, x: float, y: float, heading: float) -> tuple[float, int, int, int]:
    """Best first move from a free pose.

    Returns:
        Time to the goal [s], infinite if there is no path; gear; the goal driven to
        directly or -1; else the chain driven to.
    """
    many = field.goals.shape[0] > 1
    if not many:
        time, gear, goal = _best_goal(field, x, y, heading, math.inf)
        if goal >= 0:
            return time, gear, goal, -1  # nothing is faster
    best, best_gear, chain = _best_chain(field, x, y, heading)
    if many:  # most of them are ruled out by what is known by now
        time, gear, goal = _best_goal(field, x, y, heading, best)
        if goal >= 0:
            return time, gear, goal, -1
    return best, best_gear, -1, chain


@kernel
def _enter_and_move(
    field: GoalField, x: float, y: float, heading: float, place: Array
) -> tuple[float, float]:
    """`enter`, and the time to the goal from there [s]."""
    distance = push_out(field.walls, x, y, place)
    if distance <= TOUCH:
        place[0], place[1], distance = x, y, 0.0
    time = first_move(field, place[0], place[1], heading)[0]
    if distance == 0.0 or time < math.inf:
        return distance, time
    point = np.empty(2)
    best = math.inf
    for ring in range(field.walls.ring_box.shape[0]):
        away = nearest_on_ring(field.walls, ring, x, y, point)
        if away < best:
            found = first_move(field, point[0], point[1], heading)[0]
            if found < math.inf:
                best, time = away, found
                place[0], place[1] = point[0], point[1]
    return (best if best < math.inf else distance), time


@kernel
def enter(field: GoalField, x: float, y: float, heading: float, place: Array) -> float:
    """Distance from a pose to where its path to the goal enters free space [m].

    Zero for a free pose. From inside what is blocked it is the nearest free point; if the
    goal can't be reached from there, the nearest point of another outline from which it can.
    The point is written to `place` (2,).
    """
    return _enter_and_move(field, x, y, heading, place)[0]


@lean
def known_time(field: GoalField, x: float, y: float) -> float:
    """Time [s] up to which all paths from a place to the goals lie in the ellipse.

    A path of length l from p to g is no farther from either end than l in all: its points
    lie in the ellipse about p and g of that length, so in one about other foci that is
    longer by the foci's distances from p and g.
    """
    ellipse = field.ellipse
    length = ellipse.length
    for goal in range(field.goals.shape[0]):
        gx, gy = field.goals[goal, X], field.goals[goal, Y]
        ahead = math.hypot(x - ellipse.first_x, y - ellipse.first_y)
        ahead += math.hypot(gx - ellipse.second_x, gy - ellipse.second_y)
        back = math.hypot(x - ellipse.second_x, y - ellipse.second_y)
        back += math.hypot(gx - ellipse.first_x, gy - ellipse.first_y)
        length = min(length, ellipse.length - min(ahead, back))
    return float(length / max(field.speeds.forward, field.speeds.backward))


@kernel
def _pushed_within(field: GoalField, x: float, y: float, heading: float, known: float) -> float:
    """Time from the nearest place of any edge that a path of at most `known` [s] leads from.

    If there is none, a lower bound: `known`, or the time straight to the nearest goal.
    """
    corners, links, goals = field.walls.corners, field.walls.links, field.goals
    speed = field.speeds.forward
    fastest = max(speed, field.speeds.backward)
    away = np.empty(corners.shape[0])
    for a in range(away.size):
        nx, ny = nearest_on_edge(corners, links, a, x, y)
        away[a] = math.hypot(nx - x, ny - y)
    for a in np.argsort(away, kind="mergesort"):
        if away[a] / speed > known:
            break
        nx, ny = nearest_on_edge(corners, links, a, x, y)
        if away[a] / speed + _to_nearest(goals, nx, ny) / fastest > known:
            continue
        time = float(away[a] / speed + first_move(field, nx, ny, heading)[0])
        if time <= known:
            return time
    return float(max(known, _to_nearest(goals, x, y) / fastest))


@kernel
def _to_nearest(goals: Array, x: float, y: float) -> float:
    """Distance to the nearest goal [m]."""
    least = math.inf
    for goal in range(goals.shape[0]):
        least = min(least, math.hypot(goals[goal, X] - x, goals[goal, Y] - y))
    return least


@kernel
def cost_to_go(field: GoalField, x: float, y: float, heading: float) -> float:
    """Exact PathRTR time from a pose to the goal, in the better gear.

    A pose inside what is blocked (an inflated obstacle, say) counts as pushed out to the
    nearest free point that the goal can be reached from, with the heading that it has; the
    distance is added as driven at full forward speed. So the time is infinite only where
    no path leads to the goal at all.

    In a part of the world (`World.near`), a path that leaves its ellipse may be shorter than
    in the whole world, or closed there. So the time of a free pose is a lower bound, exact
    if such a path fits into the ellipse. A pose inside what is blocked may be pushed to the
    wrong side for the sake of a path that is closed: there, a path that fits into the
    ellipse is looked for, farther and farther away. What is found is exact or a lower bound;
    if there is none, then that no path fits is the lower bound.

    Args:
        field: field of the goal.
        x: [m].
        y: [m].
        heading: [rad], NaN if it is free.

    Returns:
        Time [s]; infinite if there is no path.
    """
    if not is_blocked(field.walls, x, y):
        return first_move(field, x, y, heading)[0]
    push, time = _enter_and_move(field, x, y, heading, np.empty(2))
    time += push / field.speeds.forward
    if math.isinf(time) or math.isinf(field.ellipse.length):
        return time
    known = known_time(field, x, y)
    return time if time <= known else _pushed_within(field, x, y, heading, known)
