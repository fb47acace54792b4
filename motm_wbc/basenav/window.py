"""The intermediate target: where the global path leaves a window about the base."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.geometry import se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array


def local_target(
    planner: GlobalPlanner, pose: Array, goal: Array, side: float, ahead: float
) -> tuple[Array, bool]:
    """The pose at which the global path leaves the window (STAA*, local planning).

    Args:
        planner: plans the path.
        pose: (3,) of the base.
        goal: (3,) where the path ends.
        side: of the window, a square that turns with the base [m].
        ahead: how far ahead of the base its centre lies [m].

    Returns:
        (3,) with the path's heading there, or the goal if the path stays inside; whether
        it is the goal.

    Raises:
        NoPath: there is no path.
    """
    path = planner.plan((pose[0], pose[1], pose[2]), (goal[0], goal[1], goal[2]))
    points = se2.to_local(pose, path.points) - np.array([ahead, 0.0])
    for index in range(len(points) - 1):
        share = _exit_share(points[index], points[index + 1], 0.5 * side)
        if share < 1.0:
            first, second = path.points[index], path.points[index + 1]
            way = second - first
            turned = math.pi if path.backward else 0.0
            heading = wrap(math.atan2(way[1], way[0]) + turned)
            return np.array([*(first + share * way), heading]), False
    return goal, True


def _exit_share(first: Array, second: Array, half: float) -> float:
    """Share of the way from `first` to `second` at which a square is left; 1 if it is not."""
    share = 1.0
    for start, way in zip(first, second - first, strict=True):
        if way != 0.0 and abs(start + way) > half:
            share = min(share, max((math.copysign(half, way) - start) / way, 0.0))
    return share
