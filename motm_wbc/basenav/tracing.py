"""The polyline of the fastest path, out of a solved field."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.field_solver import GoalRoutes
from motm_wbc.basenav.goal_field import GoalField, enter, first_move
from motm_wbc.basenav.graph import TangentGraph, chain_turn
from motm_wbc.basenav.search import first_from
from motm_wbc.basenav.walls import X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel


@kernel
def _chain_of(graph: TangentGraph, state: int) -> int:
    """The chain that a state lies on."""
    low, high = 0, graph.chain_start.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if graph.chain_start[middle] <= state:
            low = middle
        else:
            high = middle
    return low


@kernel
def trace(
    field: GoalField,
    routes: GoalRoutes,
    graph: TangentGraph,
    x: float,
    y: float,
    heading: float,
) -> tuple[Array, int, float]:
    """The fastest path from a pose to the one goal of a field.

    Returns:
        (k, 2) points from the free point that the pose is pushed out to up to the goal,
        empty if there is no path; gear; distance pushed out [m].
    """
    corners = field.walls.corners
    place = np.empty(2)
    push = enter(field, x, y, heading, place)
    time, gear, goal, chain = first_move(field, place[0], place[1], heading)
    if time == math.inf:
        return np.empty((0, 2)), gear, push
    points = np.empty((corners.shape[0] + 2, 2))
    points[0] = place
    count = 1
    if goal < 0:
        cx, cy = corners[chain // 2, X], corners[chain // 2, Y]
        points[1, 0], points[1, 1] = cx, cy
        count = 2
        angle = math.atan2(cy - place[1], cx - place[0])
        turn = chain_turn(corners, chain // 2, chain % 2, angle)
        end = field.chain_start[chain + 1]
        nearest = first_from(field.exit_turn, field.chain_start[chain], end, turn)
        state = routes.leads_to[routes.best[nearest, gear]]
        while state >= 0:
            after = routes.successor[state, gear]
            if graph.leaves[state] == 1 and after == graph.partner[state]:
                corner = _chain_of(graph, after) // 2
                points[count, 0], points[count, 1] = corners[corner, X], corners[corner, Y]
                count += 1
            state = after
    points[count] = field.goals[0, :2]
    return points[: count + 1], gear, push
