"""A plan driven from a state: the states along it, whether it leads to the goal, its cost."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.footprint_check import is_clear
from motm_wbc.basenav.jit import kernel
from motm_wbc.basenav.proximity import largest_under
from motm_wbc.basenav.staa_admissible import RATE_OMEGA, RATE_V, TARGET_OMEGA, TARGET_V
from motm_wbc.basenav.staa_goal import passes_goal, remaining_error
from motm_wbc.basenav.staa_motion import arc, travel, velocity_after, wrapped
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.geometry.arrays import Array

DURATION = 4
"""Column of a plan's actions that follows rate and target of v and of omega."""

_STILL = 1e-9  # [s] or [m/s]


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
) -> tuple[Array, float]:
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
        to the first collision; the cost to the goal [s], infinite if it is not reached.
    """
    spacing = problem.drive.step / checks
    most = 1
    for k in range(actions.shape[0]):
        most += max(int(math.ceil(actions[k, DURATION] / spacing - _STILL)), 1)
    states = np.empty((most, 6))
    x, y = problem.start[0], problem.start[1]
    c, s = problem.start[2], problem.start[3]
    states[0] = np.array([0.0, x, y, heading, v, omega])
    count, time, cost = 1, 0.0, 0.0
    for k in range(actions.shape[0]):
        rate_v, target_v = actions[k, RATE_V], actions[k, TARGET_V]
        rate_w, target_w = actions[k, RATE_OMEGA], actions[k, TARGET_OMEGA]
        duration = actions[k, DURATION]
        parts = max(int(math.ceil(duration / spacing - _STILL)), 1)
        way = turned = 0.0
        for part in range(1, parts + 1):
            at = duration * part / parts
            ways = travel(v, target_v, rate_v, at), travel(omega, target_w, rate_w, at)
            px, py, before = x, y, heading
            x, y, c, s = arc(x, y, c, s, ways[0] - way, ways[1] - turned)
            heading += ways[1] - turned
            way, turned = ways
            if not is_clear(problem.world, problem.outline, x, y, c, s, problem.margin):
                return states[:count], math.inf
            states[count] = np.array(
                [
                    time + at,
                    x,
                    y,
                    wrapped(heading),
                    velocity_after(v, target_v, rate_v, at),
                    velocity_after(omega, target_w, rate_w, at),
                ]
            )
            count += 1
            if problem.stop:
                continue
            share = passes_goal(problem, 1.0, px, py, before, x, y, heading)
            if share >= 0.0:
                last, first = states[count - 1], states[count - 2]
                turn = wrapped(last[3] - first[3])
                last[:] = first + share * (last - first)
                last[3] = wrapped(first[3] + share * turn)
                error, _ = remaining_error(problem, 1.0, last[1], last[2], last[3], 0.0, 0.0)
                return states[:count], cost + last[0] + problem.weight * error
        time += duration
        v = velocity_after(v, target_v, rate_v, duration)
        omega = velocity_after(omega, target_w, rate_w, duration)
        near = largest_under(problem.grid, problem.samples, x, y, c, s)
        cost += problem.proximity * near * duration / problem.drive.step
    if problem.stop:
        error, duration = remaining_error(problem, 1.0, x, y, heading, v, omega)
        return states[:count], cost + time + duration + problem.docking * error
    return states[:count], math.inf
