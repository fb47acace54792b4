"""Orientation of a tool that approaches from above."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array


def top_down(yaw: float) -> Array:
    """(3, 3) R_world_task: z straight down, x at `yaw` [rad] in the horizontal plane."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


def yaw_of(R_world_task: Array) -> float:
    """Yaw [rad] of the x axis of a frame whose z points about downward."""
    return math.atan2(R_world_task[1, 0], R_world_task[0, 0])
