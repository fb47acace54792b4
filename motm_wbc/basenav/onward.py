"""Times from the candidates to the next target, with the lengths of the ways there."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.field_solver import GoalRoutes
from motm_wbc.basenav.goal_field import EXTRA, HEADING, GoalField, enter, first_move
from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.ring import FREE
from motm_wbc.basenav.search import first_from
from motm_wbc.basenav.visibility import is_blocked
from motm_wbc.basenav.walls import Indices, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel


@kernel
def onward_times(
    field: GoalField, routes: GoalRoutes, poses: Array, rejections: Indices
) -> tuple[Array, float]:
    """`cost_to_go` of some poses.

    Args:
        field: of the next target.
        routes: of the same solution.
        poses: (m, 3).
        rejections: (m,) those that are not `FREE` are left out.

    Returns:
        (m,) time from each pose [s], infinite if there is no path, or it was left out; the
        longest way driven in these times [m], or, where there is none, between the free
        points at its ends and back to them.
    """
    times = np.full(poses.shape[0], math.inf)
    place = np.empty(2)
    longest, pushed = 0.0, field.goals[:, EXTRA].max() * field.speeds.forward
    for i in range(poses.shape[0]):
        if rejections[i] != FREE:
            continue
        x, y, heading = poses[i, X], poses[i, Y], poses[i, HEADING]
        push = 0.0
        if is_blocked(field.walls, x, y):
            push = enter(field, x, y, heading, place)
            x, y = place[0], place[1]
        time, gear, goal, chain = first_move(field, x, y, heading)
        if time < math.inf:
            times[i] = push / field.speeds.forward + time
            way = pushed + _way(field, routes, x, y, gear, goal, chain)
        else:
            apart = math.hypot(field.goals[0, X] - x, field.goals[0, Y] - y)
            way = apart + push + 2.0 * pushed
        longest = max(longest, push + way)
    return times, longest


@kernel
def _way(
    field: GoalField, routes: GoalRoutes, x: float, y: float, gear: int, goal: int, chain: int
) -> float:
    """Length of the way that begins with a first move [m]."""
    if goal >= 0:
        return math.hypot(field.goals[goal, X] - x, field.goals[goal, Y] - y)
    corners = field.walls.corners
    dx, dy = corners[chain // 2, X] - x, corners[chain // 2, Y] - y
    turn = chain_turn(corners, chain // 2, chain % 2, math.atan2(dy, dx))
    reached = first_from(
        field.exit_turn, field.chain_start[chain], field.chain_start[chain + 1], turn
    )
    return math.hypot(dx, dy) + float(routes.length[reached, gear])
