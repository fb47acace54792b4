"""Solves for a `GoalField`: tangents to the goals, the backward search, the chains' exits."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.goal_field import EXTRA, HEADING, GoalField
from motm_wbc.basenav.graph import TangentGraph, sort_by_chain, tangents_at
from motm_wbc.basenav.outlines import Ellipse
from motm_wbc.basenav.pathrtr import BACKWARD, Speeds, end_turn
from motm_wbc.basenav.search import GoalTangents, Labels, nowhere, search_back
from motm_wbc.basenav.visibility import push_out
from motm_wbc.basenav.walls import TOUCH, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel


class GoalRoutes(NamedTuple):
    """What leads from the exits of a `GoalField` to its goals.

    Attributes:
        best: (e, 2) the exit that `exit_cost` is reached by, in each gear.
        leads_to: (e,) the state that the exit is, or -1 - goal tangent.
        successor: (s, 2) next state, or a goal tangent (see `search`), in each gear.
        length: (e, 2) way driven in the time `exit_cost` [m], in each gear.
    """

    best: Indices
    leads_to: Indices
    successor: Indices
    length: Array


@kernel
def free_goals(walls: Walls, goals: Array, speed: float) -> Array:
    """Goals (g, 3) as (g, 4) rows of `GoalField.goals`, at free places.

    What lies inside inflated obstacles is pushed out to the nearest free point; the distance
    counts at `speed` [m/s].
    """
    rows = np.empty((goals.shape[0], 4))
    for k in range(goals.shape[0]):
        push = push_out(walls, goals[k, X], goals[k, Y], rows[k])
        if push <= TOUCH or push == math.inf:
            rows[k, X], rows[k, Y] = goals[k, X], goals[k, Y]
        rows[k, HEADING] = goals[k, HEADING]
        rows[k, EXTRA] = push / speed if push > TOUCH else 0.0
    return rows


@kernel
def goal_tangents(walls: Walls, goals: Array, speeds: Speeds) -> GoalTangents:
    """Tangents from corners to goals (g, 4), as in `GoalField`, in sight of each other."""
    most = 2 * walls.corners.shape[0] * goals.shape[0]
    ends = np.empty((most, 2), dtype=np.int64)
    turn, length = np.empty(most), np.empty(most)
    cost = np.empty((most, 2))
    count = 0
    for goal in range(goals.shape[0]):
        x, y, heading = goals[goal, X], goals[goal, Y], goals[goal, HEADING]
        if goal == 0 or x != goals[goal - 1, X] or y != goals[goal - 1, Y]:
            seen = tangents_at(walls, x, y, True)
        for k in range(seen.chain.size):
            ends[count, 0], ends[count, 1] = seen.chain[k], goal
            turn[count], length[count] = seen.turn[k], seen.length[k]
            for gear in range(2):
                speed = speeds.backward if gear == BACKWARD else speeds.forward
                turned = end_turn(seen.angle[k], heading, gear) / speeds.turning
                drive = seen.length[k] / speed if speed > 0.0 else math.inf
                cost[count, gear] = turned + drive + goals[goal, EXTRA]
            count += 1
    return GoalTangents(ends[:count], turn[:count], cost[:count], length[:count])


@kernel
def _merge_exits(
    graph: TangentGraph, labels: Labels, goal_start: Indices, tangents: GoalTangents
) -> tuple[Indices, Array, Array, Array, Indices]:
    """States and goal tangents of each chain, in one ascending order.

    Returns:
        First exit of each chain; turn, costs and lengths of the exits; the state that each
        one is, or -1 - goal tangent.
    """
    total = graph.turn.size + tangents.turn.size
    start = np.empty_like(graph.chain_start)
    turn = np.empty(total)
    cost, length = np.empty((total, 2)), np.empty((total, 2))
    source = np.empty(total, dtype=np.int64)
    place = 0
    for chain in range(start.size - 1):
        start[chain] = place
        state, tangent = graph.chain_start[chain], goal_start[chain]
        last_state, last_tangent = graph.chain_start[chain + 1], goal_start[chain + 1]
        while state < last_state or tangent < last_tangent:
            if tangent == last_tangent or (
                state < last_state and graph.turn[state] <= tangents.turn[tangent]
            ):
                turn[place], source[place] = graph.turn[state], state
                for gear in range(2):
                    cost[place, gear] = labels.cost[state, gear]
                    length[place, gear] = labels.length[state, gear]
                state += 1
            else:
                turn[place], source[place] = tangents.turn[tangent], -1 - tangent
                for gear in range(2):
                    cost[place, gear] = tangents.cost[tangent, gear]
                    length[place, gear] = tangents.length[tangent]
                tangent += 1
            place += 1
    start[-1] = place
    return start, turn, cost, length, source


@kernel
def _best_onward(
    start: Indices, turn: Array, cost: Array, length: Array, turning: float
) -> Indices:
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
                        length[k, gear] = length[k + 1, gear]
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
def _ring_bounds(ring_start: Indices, chain_bound: Array) -> Array:
    """Least time to a goal from anywhere on each ring [s]."""
    bound = np.full(ring_start.size - 1, math.inf)
    for ring in range(bound.size):
        for chain in range(2 * ring_start[ring], 2 * ring_start[ring + 1]):
            bound[ring] = min(bound[ring], chain_bound[chain])
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
    found = goal_tangents(walls, goals, speeds)
    order, goal_start = sort_by_chain(found.ends[:, 0], found.turn, 2 * walls.corners.shape[0])
    tangents = GoalTangents(
        found.ends[order], found.turn[order], found.cost[order], found.length[order]
    )
    labels = search_back(graph, walls.corners, tangents, speeds, nowhere(), 0)
    start, turn, cost, length, source = _merge_exits(graph, labels, goal_start, tangents)
    best = _best_onward(start, turn, cost, length, speeds.turning)
    bound = _chain_bounds(start, cost)
    ring_bound = _ring_bounds(walls.ring_start, bound)
    field = GoalField(walls, start, turn, cost, bound, ring_bound, goals, speeds, ellipse)
    return field, GoalRoutes(best, source, labels.successor, length)
