"""Rotations between matrices and quaternions (x, y, z, w), as the physics engine wants them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from motm_wbc.geometry.arrays import Array


def yaw_quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Quaternion of a turn about the vertical [rad]."""
    return (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def quaternion(rotation: Array) -> tuple[float, float, float, float]:
    """Quaternion of a rotation matrix (3, 3), by its largest component (Shepperd 1978)."""
    trace = float(np.trace(rotation))
    diagonal = [float(rotation[i, i]) for i in range(3)]
    i = int(np.argmax([*diagonal, trace]))
    if i == 3:
        w = 0.5 * math.sqrt(1.0 + trace)
        x = (rotation[2, 1] - rotation[1, 2]) / (4.0 * w)
        y = (rotation[0, 2] - rotation[2, 0]) / (4.0 * w)
        z = (rotation[1, 0] - rotation[0, 1]) / (4.0 * w)
        return (float(x), float(y), float(z), w)
    j, k = (i + 1) % 3, (i + 2) % 3
    parts = [0.0, 0.0, 0.0]
    parts[i] = 0.5 * math.sqrt(1.0 + 2.0 * diagonal[i] - trace)
    parts[j] = float(rotation[j, i] + rotation[i, j]) / (4.0 * parts[i])
    parts[k] = float(rotation[k, i] + rotation[i, k]) / (4.0 * parts[i])
    w = float(rotation[k, j] - rotation[j, k]) / (4.0 * parts[i])
    return (parts[0], parts[1], parts[2], w)


def pose_matrix(position: Sequence[float], orientation: Sequence[float]) -> Array:
    """(4, 4) pose from a position [m] and a unit quaternion."""
    x, y, z, w = orientation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), position[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), position[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), position[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
