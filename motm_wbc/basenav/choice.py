"""Which candidate is chosen, given what each one costs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.parameters import PlacementParameters, smallest_gap
from motm_wbc.basenav.pathrtr import turn_between
from motm_wbc.basenav.ring import FREE, UNREACHABLE
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

NONE = -1


class Rules(NamedTuple):
    """What the choice is made by; see `PlacementParameters`.

    Attributes:
        weight: of the way on to the next target.
        tie_slack: candidates within this of the cheapest are equal [s]; 0: the cheapest.
        hold: 1.0 if the last choice is held on to, else 0.0.
        hysteresis: how much cheaper another one must then be [s].
        distance: places nearer than this may be the same candidate's [m].
        angle: headings nearer than this may be [rad].
    """

    weight: float
    tie_slack: float
    hold: float
    hysteresis: float
    distance: float
    angle: float


def rules_of(parameters: PlacementParameters) -> Rules:
    """The rules that the parameters ask for."""
    p = parameters
    half_spacing = math.pi / p.count
    return Rules(
        weight=p.weight,
        tie_slack=p.tie_slack if p.ties_to_next else 0.0,
        hold=1.0 if p.hold else 0.0,
        hysteresis=p.hysteresis,
        distance=half_spacing * p.radius,
        angle=min(half_spacing, 0.5 * smallest_gap(p.headings)),
    )


class Choice(NamedTuple):
    """All candidates' costs, and the choice.

    Attributes:
        leg1: (m,) time from the robot [s], infinite where rejected.
        costs: (m,) [s], infinite where rejected.
        rejections: (m,) index into `REASONS`.
        selected: the choice, -1 if all are rejected.
        least: cost of the cheapest [s].
        next_reachable: whether the next target can be reached from a legal candidate.
    """

    leg1: Array
    costs: Array
    rejections: Indices
    selected: int
    least: float
    next_reachable: bool


@kernel
def choose(
    poses: Array,
    barred: Indices,
    leg1: Array,
    leg2: Array,
    restarts: Array,
    expected: float,
    open_end: bool,
    rules: Rules,
    previous: Array,
) -> Choice:
    """Rank all candidates: C(robot -> i) + w C(i -> next), with what waiting changes.

    Args:
        poses: (m, 3) candidates.
        barred: (m,) index into `REASONS`, why the base can't stand there.
        leg1: (m,) time from the robot [s].
        leg2: (m,) time on to the next target [s]; zeros without one. If none reaches it, it
            is left out.
        restarts: (m,) what setting out from rest costs beside driving through [s].
        expected: time until the robot is no longer needed here [s] (see `waiting`).
        open_end: nothing is known of that time.
        rules: of the choice.
        previous: (3,) goal of the last step, NaN if there is none.
    """
    count = poses.shape[0]
    rejections = barred.copy()
    free, next_reachable = False, False
    for i in range(count):
        if rejections[i] == FREE and leg1[i] == math.inf:
            rejections[i] = UNREACHABLE
        if rejections[i] == FREE:
            free = True
            next_reachable = next_reachable or leg2[i] < math.inf
    next_reachable = next_reachable or not free
    costs, ways = np.full(count, math.inf), np.full(count, math.inf)
    least = math.inf
    for i in range(count):
        if next_reachable and rejections[i] == FREE and leg2[i] == math.inf:
            rejections[i] = UNREACHABLE
        if rejections[i] == FREE:
            ways[i] = leg1[i]
            leaving = time_until_leaving(leg1[i], restarts[i], expected, open_end)
            costs[i] = leaving + (rules.weight * leg2[i] if next_reachable else 0.0)
            least = min(least, costs[i])
    selected = select(poses, costs, leg2, previous, rules)
    return Choice(ways, costs, rejections, selected, least, next_reachable)


@kernel
def time_until_leaving(leg1: float, restart: float, expected: float, open_end: bool) -> float:
    """Time from now until the base can leave a place, and what it leaves slower by.

    Args:
        leg1: time to the place [s].
        restart: what setting out from rest costs there beside driving through [s].
        expected: time from now until the robot is no longer needed [s].
        open_end: nothing is known of that time: the base has to stop wherever it goes.

    Returns:
        [s]: the longer of way and wait, and the restart where the base has to stop; a short
        wait is driven out by going slower.
    """
    idle = max(expected - leg1, 0.0)
    return leg1 + idle + (restart if open_end else min(idle, restart))


@kernel
def select(poses: Array, costs: Array, leg2: Array, previous: Array, rules: Rules) -> int:
    """The cheapest candidate; ties go toward the next target; the last choice is held.

    Candidates on the way cost nearly the same, and which of them is the cheapest changes
    from step to step. Of those within the slack the one with the least way on is taken. The
    last choice stands unless another is cheaper by more than the hysteresis, or lies nearer
    to the next target: that is progress, and never held up.

    Args:
        poses: (m, 3) candidates.
        costs: (m,) [s], infinite where rejected.
        leg2: (m,) time on to the next target [s].
        previous: (3,) goal of the last step, NaN if there is none.
        rules: of the choice.

    Returns:
        Index of the choice, -1 if all are rejected.
    """
    least = math.inf
    for i in range(costs.size):
        least = min(least, costs[i])
    if least == math.inf:
        return NONE
    chosen = NONE
    for i in range(costs.size):
        if costs[i] <= least + rules.tie_slack and (
            chosen == NONE
            or leg2[i] < leg2[chosen]
            or (leg2[i] == leg2[chosen] and costs[i] < costs[chosen])
        ):
            chosen = i
    if rules.hold > 0.0:
        kept = match(poses, previous, rules)
        if (
            kept != NONE
            and costs[kept] <= costs[chosen] + rules.hysteresis
            and leg2[kept] <= leg2[chosen]
        ):
            return kept
    return chosen


@kernel
def match(poses: Array, previous: Array, rules: Rules) -> int:
    """The candidate that `previous` was, though the object may have moved a little; else -1."""
    best, nearest = NONE, math.inf
    for i in range(poses.shape[0]):
        apart = math.hypot(poses[i, 0] - previous[0], poses[i, 1] - previous[1])
        turned = turn_between(previous[2], poses[i, 2])
        if apart < rules.distance and turned < rules.angle:
            off = apart / rules.distance + turned / rules.angle
            if off < nearest:
                best, nearest = i, off
    return best
