"""When a goal is reached, driving through it or coming to rest, as compiled kernels."""

from __future__ import annotations

import math

from motm_wbc.basenav.cost_tiles import tiled_cost_to_go
from motm_wbc.basenav.staa_motion import arc, stopping_duration, stopping_span
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.geometry.jit import lean
from motm_wbc.geometry.wrapping import wrapped

_STILL = 1e-3  # [m] way below which a part of a step counts as turning on the spot
_ABEAM = 0.02  # [m] the goal may be ahead of a base that turns on the spot
_BEND = 0.25  # share of a way that the goal may lie before it: the base came round a bend


@lean
def passes_goal(
    problem: Problem,
    strictness: float,
    px: float,
    py: float,
    before: float,
    x: float,
    y: float,
    heading: float,
) -> float:
    """Where on the way from (px, py) to (x, y) the base passes the goal within tolerance.

    The goal counts as passed when the nearest point of the way is behind the base: one that
    is still getting nearer has more to gain, and it would otherwise stand still there.

    Args:
        problem: has the goal.
        strictness: share of the tolerances to be met.
        px: start of the way [m].
        py: start [m].
        before: heading there [rad].
        x: end of the way [m].
        y: end [m].
        heading: heading there [rad], not wrapped against `before`.

    Returns:
        Share of the way in [0, 1], or -1 if it does not.
    """
    goal = problem.goal
    dx, dy = x - px, y - py
    square = dx * dx + dy * dy
    ex, ey = goal[0] - px, goal[1] - py
    reach = strictness * problem.goal_distance
    if ex * ex + ey * ey > 2.0 * (square + reach * reach):
        return -1.0
    if square > _STILL * _STILL:
        share = (ex * dx + ey * dy) / square
        if share >= 1.0 or share < -_BEND:
            return -1.0
        share = max(share, 0.0)
    else:
        share = 1.0
        if abs(math.cos(heading) * ex + math.sin(heading) * ey) > _ABEAM:
            return -1.0
    ex, ey = ex - share * dx, ey - share * dy
    if ex * ex + ey * ey > reach * reach:
        return -1.0
    off = wrapped(before + share * (heading - before) - goal[2])
    return share if abs(off) <= strictness * problem.goal_angle else -1.0


@lean
def rest_pose(
    problem: Problem, x: float, y: float, heading: float, v: float, omega: float
) -> tuple[float, float, float]:
    """Pose at which the base comes to rest if it brakes now."""
    if v == 0.0 and omega == 0.0:
        return x, y, heading
    span = stopping_span(problem.drive, v, omega)
    rx, ry, _, _ = arc(x, y, math.cos(heading), math.sin(heading), v * span, omega * span)
    return rx, ry, heading + omega * span


@lean
def remaining_error(
    problem: Problem,
    strictness: float,
    x: float,
    y: float,
    heading: float,
    v: float,
    omega: float,
) -> tuple[float, float]:
    """What is missing to the goal at the pose of rest, and the time to get there.

    Args:
        problem: has the goal.
        strictness: share of the tolerances to be met.
        x: of the base [m].
        y: of the base [m].
        heading: of the base [rad].
        v: its speed [m/s].
        omega: its turn rate [rad/s].

    Returns:
        Error [s]: distance and angle at full speeds, infinite outside of the tolerances;
        braking time [s].
    """
    rx, ry, rest_heading = rest_pose(problem, x, y, heading, v, omega)
    goal = problem.goal
    off = math.hypot(goal[0] - rx, goal[1] - ry)
    turn = abs(wrapped(rest_heading - goal[2]))
    if off > strictness * problem.goal_distance or turn > strictness * problem.goal_angle:
        return math.inf, 0.0
    error = off / problem.drive.v_max + turn / problem.drive.omega_max
    return error, stopping_duration(problem.drive, v, omega)


@lean
def time_to_stop(
    problem: Problem, x: float, y: float, heading: float, v: float, omega: float
) -> float:
    """Cost-to-go of a goal that the base shall rest at [s].

    The papers' cost-to-go knows no speed: a base that rushes past is as good as one that
    stops. Here (not in the papers) the pose at rest after braking is looked at. If braking
    leads towards the goal, what is left after it is a way l = v_max C(pose at rest), driven
    with one acceleration and one deceleration from the present speed:

        peak = sqrt(a l + v^2),   t = (2 peak - v)/a   below v_max, trapezoidal above.

    If braking leads away from the goal, the base has to stop and then drive there.
    """
    drive = problem.drive
    here = tiled_cost_to_go(problem.tiles, x, y, heading)
    if v == 0.0 and omega == 0.0:
        return _time_over(drive.v_max * here, 0.0, drive.v_max, drive.a_max)
    rx, ry, rest_heading = rest_pose(problem, x, y, heading, v, omega)
    left = tiled_cost_to_go(problem.tiles, rx, ry, wrapped(rest_heading))
    braking = stopping_duration(drive, v, omega)
    speed = abs(v) if left < here else 0.0
    length = drive.v_max * left
    if speed == 0.0:
        return braking + _time_over(length, 0.0, drive.v_max, drive.a_max)
    return max(_time_over(length, speed, drive.v_max, drive.a_max), braking + left)


@lean
def _time_over(length: float, speed: float, v_max: float, a_max: float) -> float:
    """Least time over the braking way from `speed` and `length` [m] beyond, to rest [s]."""
    square = a_max * length + speed * speed
    if square <= v_max * v_max:
        return (2.0 * math.sqrt(square) - speed) / a_max
    return (2.0 * v_max - speed) / a_max + (square - v_max * v_max) / (a_max * v_max)
