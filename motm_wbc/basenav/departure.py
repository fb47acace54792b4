"""Whether, and in what time, the base can leave a place where it stands, as it really is.

PathRTR turns on the spot, as a point. A base that is longer than wide can't do that close
to a table: it has to be able to turn to where its way on begins, or to pull out straight,
back or ahead, until it can. A stop where neither is free is a trap.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.field_solver import GoalRoutes
from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.goal_field import GoalField
from motm_wbc.basenav.onward import way_on
from motm_wbc.basenav.ring import FREE
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.geometry.wrapping import wrapped

_TURN_STEP = 0.01  # [m] that the outline's farthest corner moves from check to check
_PULL_STEP = 0.04  # [m]
_PULL_LIMIT = 5.0  # how far to pull out straight, in radii of the outline


def pull_out_limit(outline: Outline) -> float:
    """How far a base pulls out straight at most [m]."""
    return _PULL_LIMIT * outline.radius


@kernel
def turn_is_clear(
    edges: EdgeMap,
    outline: Outline,
    x: float,
    y: float,
    start: float,
    end: float,
    margin: float,
) -> bool:
    """Whether the base can turn on the spot, the shorter way, between two headings [rad]."""
    turn = wrapped(end - start)
    count = max(1, math.ceil(abs(turn) * outline.radius / _TURN_STEP))
    for k in range(count + 1):
        heading = start + turn * k / count
        if not is_clear(edges, outline, x, y, math.cos(heading), math.sin(heading), margin):
            return False
    return True


@kernel
def turning_lag(turn: float, rate: float, acceleration: float) -> float:
    """What a turn from rest to rest takes longer than `turn`/`rate` [s].

    Args:
        turn: [rad].
        rate: largest turn rate [rad/s].
        acceleration: largest angular acceleration [rad/s^2].
    """
    angle = abs(turn)
    if angle < rate * rate / acceleration:  # the full rate is never reached
        return 2.0 * math.sqrt(angle / acceleration) - angle / rate
    return rate / acceleration


@kernel
def departure_time(
    field: GoalField,
    routes: GoalRoutes,
    edges: EdgeMap,
    outline: Outline,
    x: float,
    y: float,
    heading: float,
    margin: float,
    alpha_max: float,
) -> tuple[float, float]:
    """Time to the goal for a base at rest at a pose.

    It turns on the spot to where its way begins, if that sweep is free; else it first pulls
    out straight, back at the reverse speed or ahead, up to the first place where the sweep
    is free, and that is priced with its time. The footprint is checked each centimetre of
    the sweep and each 4 cm of pulling out.

    Args:
        field: of the goal.
        routes: of the same solution.
        edges: the world, not inflated.
        outline: footprint.
        x: [m].
        y: [m].
        heading: [rad].
        margin: distance that the footprint keeps [m].
        alpha_max: angular acceleration; turning on the spot begins and ends at rest [rad/s^2].

    Returns:
        Time [s], infinite if it can't get away; the longest of all ways that were looked at
        to find it, with what is pulled out before [m].
    """
    time, longest, begin = way_on(field, routes, x, y, heading)
    if time == math.inf:
        return time, longest
    if turn_is_clear(edges, outline, x, y, heading, begin, margin):
        lag = turning_lag(wrapped(begin - heading), field.speeds.turning, alpha_max)
        return time + lag, longest
    best = math.inf
    c, s = math.cos(heading), math.sin(heading)
    for sense in (-1.0, 1.0):
        speed = field.speeds.forward if sense > 0.0 else field.speeds.backward
        if speed <= 0.0:
            continue
        for k in range(1, int(_PULL_LIMIT * outline.radius / _PULL_STEP) + 1):
            pulled = k * _PULL_STEP
            px, py = x + sense * pulled * c, y + sense * pulled * s
            if not is_clear(edges, outline, px, py, c, s, margin):
                break
            time, way, begin = way_on(field, routes, px, py, heading)
            longest = max(longest, pulled + way)
            if turn_is_clear(edges, outline, px, py, heading, begin, margin):
                lag = turning_lag(wrapped(begin - heading), field.speeds.turning, alpha_max)
                best = min(best, pulled / speed + time + lag)
                break
    return best, longest


@kernel
def departure_times(
    field: GoalField,
    routes: GoalRoutes,
    edges: EdgeMap,
    outline: Outline,
    poses: Array,
    rejections: Indices,
    margin: float,
    alpha_max: float,
) -> tuple[Array, Array]:
    """`departure_time` of each of `poses` (m, 3) that is `FREE`.

    Returns:
        (m,) time [s], infinite for the others; (m,) longest way [m], zero for the others.
    """
    times, ways = np.full(len(poses), math.inf), np.zeros(len(poses))
    for i in range(len(poses)):
        if rejections[i] == FREE:
            x, y, heading = poses[i, 0], poses[i, 1], poses[i, 2]
            times[i], ways[i] = departure_time(
                field, routes, edges, outline, x, y, heading, margin, alpha_max
            )
    return times, ways
