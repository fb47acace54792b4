"""A plan driven from a state: the states along it, whether it leads to the goal, its cost."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.footprint_check import is_clear
from motm_wbc.basenav.movers import half_way, meets_mover, nearness_of_movers
from motm_wbc.basenav.proximity import largest_under
from motm_wbc.basenav.staa_admissible import RATE_OMEGA, RATE_V, TARGET_OMEGA, TARGET_V
from motm_wbc.basenav.staa_child import heuristic
from motm_wbc.basenav.staa_goal import passes_goal, remaining_error
from motm_wbc.basenav.staa_motion import arc, travel, velocity_after
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean
from motm_wbc.geometry.wrapping import wrapped

DURATION = 4
"""Column of a plan's actions that follows rate and target of v and of omega."""

_STILL = 1e-9  # [s]
_GOES_ON, _COLLISION, _PASSED = range(3)


def remaining_actions(actions: Array, elapsed: float) -> Array:
    """The actions of a plan (k, 5) that are left after `elapsed` [s]."""
    ends = np.cumsum(actions[:, DURATION])
    left = np.minimum(ends - elapsed, actions[:, DURATION])
    rest = actions[left > _STILL].copy()
    rest[:, DURATION] = left[left > _STILL]
    return rest


@kernel
def follow(
    problem: Problem, heading: float, v: float, omega: float, actions: Array, checks: int
) -> tuple[Array, float, bool]:
    """Drive a sequence of actions from the problem's start.

    Args:
        problem: world and goal.
        heading: at the start [rad].
        v: speed at the start [m/s].
        omega: turn rate at the start [rad/s].
        actions: (k, 5) rate and target of v and of omega, duration [s].
        checks: poses of a whole step.

    Returns:
        (n, 6) time [s], x, y [m], heading [rad], v [m/s], omega [rad/s], up to the goal or
        to the first collision; the cost of the way and of what is left to the goal from its
        end [s], infinite after a collision; whether the goal is reached.
    """
    step = problem.drive.step
    most = 1
    for k in range(actions.shape[0]):
        most += _parts(actions[k, DURATION], step / checks)
    states = np.empty((most, 6))
    states[0] = np.array([0.0, problem.start[0], problem.start[1], heading, v, omega])
    count, cost = 1, 0.0
    for k in range(actions.shape[0]):
        count, outcome = _follow_action(problem, actions[k], step / checks, states, count)
        last = states[count - 1]
        if outcome == _COLLISION:
            return states[:count], math.inf, False
        if outcome == _PASSED:
            error, _ = remaining_error(problem, 1.0, last[1], last[2], last[3], 0.0, 0.0)
            return states[:count], cost + last[0] + problem.weight * error, True
        c, s = math.cos(last[3]), math.sin(last[3])
        near = largest_under(problem.grid, problem.samples, last[1], last[2], c, s)
        beside = nearness_of_movers(problem.movers, problem.outline, last[1], last[2], last[0])
        price = problem.proximity * near + problem.moving * beside
        cost += price * actions[k, DURATION] / step
    last = states[count - 1]
    cost += last[0]
    if problem.stop:
        error, rest = remaining_error(problem, 1.0, last[1], last[2], last[3], last[4], last[5])
        if error < math.inf:
            return states[:count], cost + rest + problem.docking * error, True
    left = heuristic(problem, last[1], last[2], last[3], last[4], last[5])
    return states[:count], cost + problem.weight * left, False


@lean
def _parts(duration: float, spacing: float) -> int:
    return max(math.ceil(duration / spacing - _STILL), 1)


@kernel
def _follow_action(
    problem: Problem, action: Array, spacing: float, states: Array, count: int
) -> tuple[int, int]:
    """Append the states along one action; their number and what came of it."""
    time, x, y, heading, v, omega = states[count - 1]
    c, s = math.cos(heading), math.sin(heading)
    parts = _parts(action[DURATION], spacing)
    way = turned = 0.0
    for part in range(1, parts + 1):
        at = action[DURATION] * part / parts
        ways = travel(v, action[TARGET_V], action[RATE_V], at)
        turns = travel(omega, action[TARGET_OMEGA], action[RATE_OMEGA], at)
        px, py, before = x, y, heading
        x, y, c, s = arc(x, y, c, s, ways - way, turns - turned)
        heading += turns - turned
        grown = problem.margin + half_way(
            problem.movers, problem.outline, ways - way, turns - turned, spacing
        )
        way, turned = ways, turns
        if not is_clear(problem.world, problem.outline, x, y, c, s, problem.margin):
            return count, _COLLISION
        if meets_mover(problem.movers, problem.outline, grown, x, y, c, s, time + at):
            return count, _COLLISION
        state = states[count]
        count += 1
        state[0], state[1], state[2], state[3] = time + at, x, y, wrapped(heading)
        state[4] = velocity_after(v, action[TARGET_V], action[RATE_V], at)
        state[5] = velocity_after(omega, action[TARGET_OMEGA], action[RATE_OMEGA], at)
        if problem.stop:
            continue
        share = passes_goal(problem, 1.0, px, py, before, x, y, heading)
        if share >= 0.0:
            first = states[count - 2]
            turn = wrapped(state[3] - first[3])
            state[:] = first + share * (state - first)
            state[3] = wrapped(first[3] + share * turn)
            return count, _PASSED
    return count, _GOES_ON
