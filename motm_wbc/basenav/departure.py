"""Whether, and in what time, the base can leave a place where it stands, as it really is.

PathRTR turns on the spot, as a point. A base that is longer than wide can't do that close
to a table: it has to be able to turn to where its way on begins, or to pull out straight,
back or ahead, until it can. A stop where neither is free is a trap.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.goal_field import HEADING, GoalField, enter, first_move
from motm_wbc.basenav.pathrtr import BACKWARD
from motm_wbc.basenav.ring import FREE
from motm_wbc.basenav.walls import TOUCH, Indices, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_TURN_STEP = 0.01  # [m] that the outline's farthest corner moves from check to check
_PULL_STEP = 0.04  # [m]
_PULL_LIMIT = 5.0  # how far to pull out straight, in radii of the outline


def pull_out_limit(outline: Outline) -> float:
    """How far a base pulls out straight at most [m]."""
    return _PULL_LIMIT * outline.radius


@kernel
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi) [rad]."""
    return (angle + math.pi) % math.tau - math.pi


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
def _way_on(field: GoalField, x: float, y: float, heading: float) -> tuple[float, float]:
    """Time to the goal [s], and the heading that the way there begins with [rad]."""
    place = np.empty(2)
    push = enter(field, x, y, heading, place)
    time, gear, goal, chain = first_move(field, place[0], place[1], heading)
    if time == math.inf:
        return math.inf, heading
    if push > TOUCH:
        dx, dy = place[0] - x, place[1] - y
    elif goal >= 0:
        dx, dy = field.goals[goal, X] - x, field.goals[goal, Y] - y
        if math.hypot(dx, dy) <= TOUCH:  # there already: only its heading is left
            toward = field.goals[goal, HEADING]
            return time, heading if math.isnan(toward) else toward
    else:
        corner = chain // 2
        dx, dy = field.walls.corners[corner, X] - x, field.walls.corners[corner, Y] - y
    begin = math.atan2(dy, dx)
    if push <= TOUCH and gear == BACKWARD:
        begin += math.pi
    return push / field.speeds.forward + time, begin


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
    edges: EdgeMap,
    outline: Outline,
    x: float,
    y: float,
    heading: float,
    margin: float,
    alpha_max: float,
) -> float:
    """Time to the goal [s] for a base at rest at a pose, infinite if it can't get away.

    It turns on the spot to where its way begins, if that sweep is free; else it first pulls
    out straight, back at the reverse speed or ahead, up to the first place where the sweep
    is free, and that is priced with its time. The footprint is checked each centimetre of
    the sweep and each 4 cm of pulling out.

    Args:
        field: of the goal.
        edges: the world, not inflated.
        outline: footprint.
        x: [m].
        y: [m].
        heading: [rad].
        margin: distance that the footprint keeps [m].
        alpha_max: angular acceleration; turning on the spot begins and ends at rest [rad/s^2].
    """
    time, begin = _way_on(field, x, y, heading)
    if time == math.inf:
        return time
    if turn_is_clear(edges, outline, x, y, heading, begin, margin):
        return time + turning_lag(wrapped(begin - heading), field.speeds.turning, alpha_max)
    best = math.inf
    c, s = math.cos(heading), math.sin(heading)
    for sense in (-1.0, 1.0):
        speed = field.speeds.forward if sense > 0.0 else field.speeds.backward
        if speed <= 0.0:
            continue
        for k in range(1, int(_PULL_LIMIT * outline.radius / _PULL_STEP) + 1):
            px, py = x + sense * k * _PULL_STEP * c, y + sense * k * _PULL_STEP * s
            if not is_clear(edges, outline, px, py, c, s, margin):
                break
            time, begin = _way_on(field, px, py, heading)
            if turn_is_clear(edges, outline, px, py, heading, begin, margin):
                lag = turning_lag(wrapped(begin - heading), field.speeds.turning, alpha_max)
                best = min(best, k * _PULL_STEP / speed + time + lag)
                break
    return best


@kernel
def departure_times(
    field: GoalField,
    edges: EdgeMap,
    outline: Outline,
    poses: Array,
    rejections: Indices,
    margin: float,
    alpha_max: float,
) -> Array:
    """`departure_time` of each of `poses` (m, 3) that is `FREE`; infinite for the others."""
    times = np.full(len(poses), math.inf)
    for i in range(len(poses)):
        if rejections[i] != FREE:
            continue
        x, y, heading = poses[i, 0], poses[i, 1], poses[i, 2]
        times[i] = departure_time(field, edges, outline, x, y, heading, margin, alpha_max)
    return times
