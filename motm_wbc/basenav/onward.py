"""The ways from the candidates to the next target: times, lengths, where they begin."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.field_solver import GoalRoutes
from motm_wbc.basenav.goal_field import EXTRA, HEADING, GoalField, enter, first_move
from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.pathrtr import BACKWARD
from motm_wbc.basenav.ring import FREE
from motm_wbc.basenav.search import first_from
from motm_wbc.basenav.visibility import is_blocked
from motm_wbc.basenav.walls import TOUCH, Indices, X, Y
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
    longest = 0.0
    for i in range(poses.shape[0]):
        if rejections[i] == FREE:
            times[i], way, _ = way_on(field, routes, poses[i, X], poses[i, Y], poses[i, HEADING])
            longest = max(longest, way)
    return times, longest


@kernel
def way_on(
    field: GoalField, routes: GoalRoutes, x: float, y: float, heading: float
) -> tuple[float, float, float]:
    """The fastest way from a pose to a goal.

    Args:
        field: of the goals.
        routes: of the same solution.
        x: [m]; inside what is blocked as in `cost_to_go`.
        y: [m].
        heading: [rad].

    Returns:
        Time [s], infinite if there is no way; its length or, if there is none, that between
        the free points at its ends and back to them [m]; heading that it begins with [rad].
    """
    place = np.array([x, y])
    push = enter(field, x, y, heading, place) if is_blocked(field.walls, x, y) else 0.0
    pushed = field.goals[:, EXTRA].max() * field.speeds.forward
    time, gear, goal, chain = first_move(field, place[0], place[1], heading)
    if time == math.inf:
        apart = math.hypot(field.goals[0, X] - place[0], field.goals[0, Y] - place[1])
        return time, apart + 2.0 * (push + pushed), heading
    length = push + _way(field, routes, place[0], place[1], gear, goal, chain) + pushed
    begin = _beginning(field, x, y, heading, push, place, gear, goal, chain)
    return push / field.speeds.forward + time, length, begin


@kernel
def _beginning(
    field: GoalField,
    x: float,
    y: float,
    heading: float,
    push: float,
    place: Array,
    gear: int,
    goal: int,
    chain: int,
) -> float:
    """The heading that a way begins with [rad]."""
    if push > TOUCH:
        return math.atan2(place[1] - y, place[0] - x)
    if goal >= 0:
        dx, dy = field.goals[goal, X] - x, field.goals[goal, Y] - y
        if math.hypot(dx, dy) <= TOUCH:  # there already: only its heading is left
            toward = field.goals[goal, HEADING]
            return heading if math.isnan(toward) else float(toward)
    else:
        corner = chain // 2
        dx, dy = field.walls.corners[corner, X] - x, field.walls.corners[corner, Y] - y
    return math.atan2(dy, dx) + (math.pi if gear == BACKWARD else 0.0)


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
