"""Rotations and poses as matrices."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_SMALL = 1e-8  # [rad]; below, the first-order term is exact to a double's precision


def pose(rotation: Array, position: Array | tuple[float, ...]) -> Array:
    """(4, 4) pose of a rotation (3, 3) and a position (3,) [m]."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = position
    return T


def inverse_pose(T: Array) -> Array:
    """(4, 4) inverse of a pose."""
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def planar_pose(base_pose: Array) -> Array:
    """(4, 4) pose of (x [m], y [m], heading [rad]) on the floor."""
    c, s = math.cos(base_pose[2]), math.sin(base_pose[2])
    return np.array(
        [
            [c, -s, 0.0, base_pose[0]],
            [s, c, 0.0, base_pose[1]],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def axis_angle(axis: Array, angle: float) -> Array:
    """(3, 3) rotation about `axis` (3,), which need not be of unit length (Rodrigues)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K))


def rpy_rotation(rpy: Array | tuple[float, ...]) -> Array:
    """(3, 3) rotation of roll, pitch, yaw about fixed axes [rad], as URDF has it."""
    roll, pitch, yaw = (float(angle) for angle in rpy)
    x, y, z = np.eye(3)
    return np.asarray(axis_angle(z, yaw) @ axis_angle(y, pitch) @ axis_angle(x, roll))


def rpy_from_rotation(R: Array) -> Array:
    """(3,) roll, pitch, yaw [rad] of a rotation; yaw is zero where pitch is +-90 degrees."""
    horizontal = math.hypot(R[0, 0], R[1, 0])
    pitch = math.atan2(-R[2, 0], horizontal)
    if horizontal > _SMALL:
        return np.array([math.atan2(R[2, 1], R[2, 2]), pitch, math.atan2(R[1, 0], R[0, 0])])
    return np.array([math.atan2(-R[1, 2], R[1, 1]), pitch, 0.0])


@kernel
def rotation_vector(R: Array) -> Array:
    """(3,) axis times angle in [0, pi] of a rotation, the logarithm on SO(3) [rad].

    It goes by way of the quaternion, which is taken from its largest element (Shepperd,
    "Quaternion from rotation matrix", JGC 1978). So nothing cancels: neither near no turn,
    where the trace says little, nor near half a turn, where the skew part vanishes.
    """
    a, b, c = R[0, 0], R[1, 1], R[2, 2]
    trace = a + b + c
    if trace >= max(a, b, c):
        w, x, y, z = 1.0 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    elif a >= max(b, c):
        w, x, y, z = R[2, 1] - R[1, 2], 1.0 + a - b - c, R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]
    elif b >= c:
        w, x, y, z = R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], 1.0 + b - a - c, R[1, 2] + R[2, 1]
    else:
        w, x, y, z = R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1.0 + c - a - b
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return np.zeros(3)
    scale = math.copysign(2.0 * math.atan2(sine, abs(w)) / sine, w)
    return np.array((scale * x, scale * y, scale * z))


@kernel
def rotation_error(R_target: Array, R: Array) -> Array:
    """(3,) rotation vector [rad], world axes, that turns `R` into `R_target`.

    exp(vector) R = R_target; its length is in [0, pi].
    """
    turn = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                turn[i, j] += R_target[i, k] * R[j, k]
    return rotation_vector(turn)
