"""Solves for a `GoalField`: tangents to the goals, the backward search, the chains' exits."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.goal_field import EXTRA, HEADING, GoalField
from motm_wbc.basenav.graph import TangentGraph, chain_turn
from motm_wbc.basenav.outlines import Ellipse
from motm_wbc.basenav.pathrtr import BACKWARD, Speeds, end_turn
from motm_wbc.basenav.search import remaining_times
from motm_wbc.basenav.visibility import (
    NEITHER,
    line_of_sight,
    may_be_tangent,
    tangent_side,
)
from motm_wbc.basenav.walls import TOUCH, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel


class GoalRoutes(NamedTuple):
    """What leads from the exits of a `GoalField` to its goals.

    Attributes:
        best: (e, 2) the exit that `exit_cost` is reached by, in each gear.
        leads_to: (e,) the state that the exit is, or -1 - goal tangent.
        successor: (s, 2) next state, or a goal tangent (see `search`), in each gear.
    """

    best: Indices
    leads_to: Indices
    successor: Indices


@kernel
def _goal_tangents(walls: Walls, goals: Array, speeds: Speeds) -> tuple[Indices, Array]:
    """Tangents from corners to goals in sight.

    Returns:
        (t, 2) chain and goal; (t, 3) turn on the chain [rad], time [s] in either gear.
    """
    corners = walls.corners
    most = 2 * corners.shape[0] * goals.shape[0]
    ends = np.empty((most, 2), dtype=np.int64)
    values = np.empty((most, 3))
    count = 0
    for goal in range(goals.shape[0]):
        x, y, heading = goals[goal, X], goals[goal, Y], goals[goal, HEADING]
        for corner in range(corners.shape[0]):
            dx, dy = x - corners[corner, X], y - corners[corner, Y]
            if not may_be_tangent(corners, corner, dx, dy):
                continue
            length = math.sqrt(dx * dx + dy * dy)
            if length <= TOUCH:
                continue
            side = tangent_side(corners, walls.links, corner, dx / length, dy / length)
            if side == NEITHER or not line_of_sight(
                walls, corners[corner, X], corners[corner, Y], x, y
            ):
                continue
            angle = math.atan2(dy, dx)
            ends[count, 0], ends[count, 1] = 2 * corner + side, goal
            values[count, 0] = chain_turn(corners, corner, side, angle)
            for gear in range(2):
                speed = speeds.backward if gear == BACKWARD else speeds.forward
                turned = end_turn(angle, heading, gear) / speeds.turning
                drive = length / speed if speed > 0.0 else math.inf
                values[count, 1 + gear] = turned + drive + goals[goal, EXTRA]
            count += 1
    return ends[:count], values[:count]


@kernel
def _sort_by_chain(ends: Indices, values: Array, chains: int) -> tuple[Indices, Indices]:
    """Order of the goal tangents by chain, then turn, and the first one of each chain."""
    start = np.zeros(chains + 1, dtype=np.int64)
    for k in range(ends.shape[0]):
        start[ends[k, 0] + 1] += 1
    for chain in range(chains):
        start[chain + 1] += start[chain]
    filled = start[:-1].copy()
    order = np.empty(ends.shape[0], dtype=np.int64)
    for k in range(ends.shape[0]):
        chain = ends[k, 0]
        place = filled[chain]
        filled[chain] += 1
        while place > start[chain] and values[order[place - 1], 0] > values[k, 0]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = k
    return order, start


@kernel
def _merge_exits(
    graph: TangentGraph, chain_cost: Array, goal_start: Indices, goal_turn: Array, goal_cost: Array
) -> tuple[Indices, Array, Array, Indices]:
    """States and goal tangents of each chain, in one ascending order.

    Returns:
        First exit of each chain; turn and costs of the exits; the state that each one is, or
        -1 - goal tangent.
    """
    total = graph.turn.size + goal_turn.size
    start = np.empty_like(graph.chain_start)
    turn = np.empty(total)
    cost = np.empty((total, 2))
    source = np.empty(total, dtype=np.int64)
    place = 0
    for chain in range(start.size - 1):
        start[chain] = place
        state, tangent = graph.chain_start[chain], goal_start[chain]
        last_state, last_tangent = graph.chain_start[chain + 1], goal_start[chain + 1]
        while state < last_state or tangent < last_tangent:
            if tangent == last_tangent or (
                state < last_state and graph.turn[state] <= goal_turn[tangent]
            ):
                turn[place], source[place] = graph.turn[state], state
                cost[place, 0], cost[place, 1] = chain_cost[state, 0], chain_cost[state, 1]
                state += 1
            else:
                turn[place], source[place] = goal_turn[tangent], -1 - tangent
                cost[place, 0], cost[place, 1] = goal_cost[tangent, 0], goal_cost[tangent, 1]
                tangent += 1
            place += 1
    start[-1] = place
    return start, turn, cost, source


@kernel
def _best_onward(start: Indices, turn: Array, cost: Array, turning: float) -> Indices:
    """Lowers each exit's cost to that of going on to a later one; which one that is."""
    best = np.empty(cost.shape, dtype=np.int64)
    for gear in range(2):
        for chain in range(start.size - 1):
            for k in range(start[chain + 1] - 1, start[chain] - 1, -1):
                best[k, gear] = k
                if k + 1 < start[chain + 1]:
                    onward = cost[k + 1, gear] + (turn[k + 1] - turn[k]) / turning
                    if onward < cost[k, gear]:
                        cost[k, gear] = onward
                        best[k, gear] = best[k + 1, gear]
    return best


@kernel
def _chain_bounds(start: Indices, cost: Array) -> Array:
    """Least time to a goal from anywhere on each chain [s]."""
    bound = np.full(start.size - 1, math.inf)
    for chain in range(bound.size):
        for k in range(start[chain], start[chain + 1]):
            bound[chain] = min(bound[chain], cost[k, 0], cost[k, 1])
    return bound


@kernel
def solve_field(
    walls: Walls, graph: TangentGraph, goals: Array, speeds: Speeds, ellipse: Ellipse
) -> tuple[GoalField, GoalRoutes]:
    """The field of the time to the best of some goals.

    Args:
        walls: outlines of the free space.
        graph: their tangent graph.
        goals: (g, 4) as in `GoalField`, at free places.
        speeds: speeds of the base.
        ellipse: where the outlines are the whole world's.
    """
    ends, values = _goal_tangents(walls, goals, speeds)
    order, goal_start = _sort_by_chain(ends, values, 2 * walls.corners.shape[0])
    goal_turn = values[order, 0]
    goal_cost = values[order, 1:]
    chain_cost = np.full((graph.turn.size, 2), math.inf)
    successor = np.full((graph.turn.size, 2), -1)
    for gear in range(2 if speeds.backward > 0.0 else 1):
        speed = speeds.backward if gear == BACKWARD else speeds.forward
        cost, then = remaining_times(
            graph, goal_start, goal_turn, goal_cost[:, gear].copy(), speed, speeds.turning
        )
        chain_cost[:, gear] = cost
        successor[:, gear] = then
    start, turn, cost_on, source = _merge_exits(graph, chain_cost, goal_start, goal_turn, goal_cost)
    best = _best_onward(start, turn, cost_on, speeds.turning)
    bound = _chain_bounds(start, cost_on)
    field = GoalField(walls, start, turn, cost_on, bound, goals, speeds, ellipse)
    return field, GoalRoutes(best, source, successor)
