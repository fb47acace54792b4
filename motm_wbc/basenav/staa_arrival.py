"""What to do at the goal, where the steps of the search are too coarse."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.staa_admissible import ACCELERATION, ALPHA
from motm_wbc.basenav.staa_goal import remaining_error
from motm_wbc.basenav.staa_motion import stopping_duration
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_root import Root
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.geometry.angles import wrap


def arrival_action(problem: Problem, root: Root, parameters: StaaParameters) -> int | None:
    """The first action of a base that is as good as at its goal, None if it is not."""
    if problem.stop:
        return _docking_action(problem, root)
    return _holding_action(root, parameters) if _is_past(problem, root) else None


def _docking_action(problem: Problem, root: Root) -> int | None:
    """What to do if braking now would end at the goal: brake, or come nearer first.

    Commands are compared by the error that is left when the base brakes after them. At rest
    it stays.
    """
    x, y, heading = (float(value) for value in root.pose)
    error, duration = remaining_error(problem, 1.0, x, y, heading, root.v, root.omega)
    if math.isinf(error) or not root.admissible[root.brake]:
        return None
    best, least = root.brake, problem.docking * error + duration
    if root.v == 0.0 and root.omega == 0.0:
        return best
    drive, period = problem.drive, problem.drive.period
    for index in np.flatnonzero(root.admissible[:-1]):
        x, y, heading = (float(value) for value in root.rests[index])
        error, _ = remaining_error(problem, 1.0, x, y, heading, 0.0, 0.0)
        a, alpha = root.table[index, ACCELERATION], root.table[index, ALPHA]
        after = stopping_duration(drive, root.v + a * period, root.omega + alpha * period)
        cost = problem.docking * error + period + after
        if cost < least:
            best, least = int(index), cost
    return best


def _is_past(problem: Problem, root: Root) -> bool:
    """Whether a goal to be driven through is within tolerance and no longer ahead."""
    offset = problem.goal[:2] - root.pose[:2]
    if math.hypot(*offset) > problem.goal_distance:
        return False
    if abs(wrap(problem.goal[2] - root.pose[2])) > problem.goal_angle:
        return False
    direction = np.array([math.cos(root.pose[2]), math.sin(root.pose[2])])
    return float(offset @ direction) * (1.0 if root.v >= 0.0 else -1.0) <= 0.0


def _holding_action(root: Root, p: StaaParameters) -> int | None:
    """Keep the velocity, if that is safe: a goal driven through is no reason to slow."""
    hold = (p.linear_actions // 2) * p.angular_actions + p.angular_actions // 2
    return next((action for action in (hold, root.brake) if root.admissible[action]), None)
