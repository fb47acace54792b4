"""Orientation of a tool that approaches from above, and its error."""

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


def rotation_error(R_target: Array, R_current: Array) -> Array:
    """(3,) rotation vector [rad], world axes, that turns `R_current` into `R_target`."""
    R = R_target @ R_current.T
    cosine = min(max(0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0), -1.0), 1.0)
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    angle = math.acos(cosine)
    if angle < 1e-6:
        return 0.5 * skew
    if angle > math.pi - 1e-4:
        return _half_turn(R, angle)
    return np.asarray(skew * (0.5 * angle / math.sin(angle)))


def _half_turn(R: Array, angle: float) -> Array:
    """Rotation vector near 180 degrees, where the skew part vanishes."""
    outer = 0.5 * (R + np.eye(3))
    column = int(np.argmax(np.diag(outer)))
    axis = outer[:, column] / math.sqrt(max(outer[column, column], 1e-12))
    return np.asarray(angle * axis / max(float(np.linalg.norm(axis)), 1e-12))
