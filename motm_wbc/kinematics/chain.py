"""Compiled kinematics of a tree of joints: poses, Jacobian by inputs, bias accelerations.

Spatial vectors are linear, then angular, both in world axes; the linear part is the velocity
of the body's point at the world's origin (Featherstone, "Rigid Body Dynamics Algorithms",
2008, chapter 2, with the two halves swapped).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import kernel

FIXED, TURNING, SLIDING = 0, 1, 2
"""Kinds of joints; revolute and continuous ones both turn."""
FIRST_ARM_POSITION = 3
"""Where the arm begins in the vector of positions: base x, y, yaw, arm, fingers."""


class Chain(NamedTuple):
    """A tree of m joint frames; frame 0 is the world, and a parent comes before its children.

    Attributes:
        parent: (m,) index of the frame that each joint is mounted on.
        kind: (m,) `FIXED`, `TURNING` or `SLIDING`.
        rotation: (m, 3, 3) of each frame in its parent's, at position zero.
        translation: (m, 3) of each frame in its parent's, at position zero [m].
        axis: (m, 3) unit vector in the joint's own frame.
        source: (m,) index into the vector of positions, -1 for none.
    """

    parent: IntArray
    kind: IntArray
    rotation: Array
    translation: Array
    axis: Array
    source: IntArray


def moved_by_arm(chain: Chain, joint: int, n_arm: int) -> Array:
    """(n_arm,) 1.0 for each arm joint that moves the joint frame `joint`, else 0.0."""
    moves = np.zeros(n_arm)
    while joint > 0:
        number = int(chain.source[joint]) - FIRST_ARM_POSITION
        if 0 <= number < n_arm:
            moves[number] = 1.0
        joint = int(chain.parent[joint])
    return moves


@kernel
def forward(chain: Chain, positions: Array, rotations: Array, translations: Array) -> None:
    """Poses of all joint frames in the world.

    Args:
        chain: the joints, m frames.
        positions: base x, y [m], yaw [rad], arm joints, fingers [rad or m].
        rotations: (m, 3, 3), is written.
        translations: (m, 3) [m], is written.
    """
    for i in range(3):
        translations[0, i] = 0.0
        for j in range(3):
            rotations[0, i, j] = 1.0 if i == j else 0.0
    for k in range(1, len(chain.parent)):
        at = chain.parent[k]
        for i in range(3):
            a, b, c = rotations[at, i, 0], rotations[at, i, 1], rotations[at, i, 2]
            shift = chain.translation[k]
            translations[k, i] = translations[at, i] + a * shift[0] + b * shift[1] + c * shift[2]
            for j in range(3):
                rotations[k, i, j] = (
                    a * chain.rotation[k, 0, j]
                    + b * chain.rotation[k, 1, j]
                    + c * chain.rotation[k, 2, j]
                )
        if chain.kind[k] == TURNING:
            _turn(rotations[k], chain.axis[k], positions[chain.source[k]])
        elif chain.kind[k] == SLIDING:
            _slide(translations[k], rotations[k], chain.axis[k], positions[chain.source[k]])


@kernel
def input_jacobian(
    chain: Chain,
    base_kind_is_differential: bool,
    base_pose: Array,
    n_arm: int,
    rotations: Array,
    translations: Array,
    J: Array,
) -> None:
    """Spatial velocity that each input gives to a body which all inputs move.

    Args:
        chain: the joints, m frames.
        base_kind_is_differential: the base's inputs are (v, omega), else (v_x, v_y, omega);
            without a sideways column no solution can slide.
        base_pose: (3,) x [m], y [m], heading [rad].
        n_arm: number of arm joints.
        rotations: (m, 3, 3) of `forward`.
        translations: (m, 3) of `forward` [m].
        J: (6, n_base + n_arm), is written.
    """
    x, y, heading = base_pose[0], base_pose[1], base_pose[2]
    c, s = math.cos(heading), math.sin(heading)
    turn = 1 if base_kind_is_differential else 2
    _write_column(J, 0, c, s, 0.0, 0.0, 0.0, 0.0)
    if not base_kind_is_differential:
        _write_column(J, 1, -s, c, 0.0, 0.0, 0.0, 0.0)
    _write_column(J, turn, y, -x, 0.0, 0.0, 0.0, 1.0)
    for k in range(1, len(chain.parent)):
        number = chain.source[k] - FIRST_ARM_POSITION
        if number < 0 or number >= n_arm:
            continue
        R, p, axis = rotations[k], translations[k], chain.axis[k]
        d = R[0, 0] * axis[0] + R[0, 1] * axis[1] + R[0, 2] * axis[2]
        e = R[1, 0] * axis[0] + R[1, 1] * axis[1] + R[1, 2] * axis[2]
        f = R[2, 0] * axis[0] + R[2, 1] * axis[1] + R[2, 2] * axis[2]
        column = turn + 1 + number
        if chain.kind[k] == SLIDING:
            _write_column(J, column, d, e, f, 0.0, 0.0, 0.0)
        else:
            _write_column(
                J, column, p[1] * f - p[2] * e, p[2] * d - p[0] * f, p[0] * e - p[1] * d, d, e, f
            )


@kernel
def place(
    chain: Chain,
    base_kind_is_differential: bool,
    n_arm: int,
    positions: Array,
    rotations: Array,
    translations: Array,
    J: Array,
) -> None:
    """`forward` and `input_jacobian` in one call, for callers that are not compiled."""
    forward(chain, positions, rotations, translations)
    input_jacobian(
        chain, base_kind_is_differential, positions[:3], n_arm, rotations, translations, J
    )


@kernel
def frame_pose(
    rotations: Array, translations: Array, joint: int, placement: Array, T: Array
) -> None:
    """Pose in the world of a frame that is fixed to a joint frame.

    Args:
        rotations: (m, 3, 3) of `forward`.
        translations: (m, 3) of `forward` [m].
        joint: index of the joint frame.
        placement: (4, 4) pose in the joint frame.
        T: (4, 4), is written.
    """
    for i in range(3):
        a, b, c = rotations[joint, i, 0], rotations[joint, i, 1], rotations[joint, i, 2]
        for j in range(4):
            T[i, j] = a * placement[0, j] + b * placement[1, j] + c * placement[2, j]
        T[i, 3] += translations[joint, i]
    T[3, 0], T[3, 1], T[3, 2], T[3, 3] = 0.0, 0.0, 0.0, 1.0


@kernel
def place_points(
    rotations: Array, translations: Array, joints: IntArray, points: Array, placed: Array
) -> None:
    """Positions in the world of points that are fixed to joint frames.

    Args:
        rotations: (m, 3, 3) of `forward`.
        translations: (m, 3) of `forward` [m].
        joints: (k,) joint frame of each group of points.
        points: (k, c, 3) in the joint frames [m].
        placed: (k, c, 3) in the world [m], is written.
    """
    for k in range(len(joints)):
        R, p = rotations[joints[k]], translations[joints[k]]
        for c in range(points.shape[1]):
            x, y, z = points[k, c, 0], points[k, c, 1], points[k, c, 2]
            for i in range(3):
                placed[k, c, i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z + p[i]


@kernel
def jacobian_at(J_world: Array, point: Array, J: Array) -> None:
    """Velocity of a point, not of the one at the world's origin.

    Args:
        J_world: (6, n) of `input_jacobian`.
        point: (3,) in the world [m].
        J: (6, n) linear velocity of the point, then angular velocity, is written.
    """
    x, y, z = point[0], point[1], point[2]
    for k in range(J_world.shape[1]):
        a, b, c = J_world[3, k], J_world[4, k], J_world[5, k]
        _write_column(
            J, k,
            J_world[0, k] + b * z - c * y,
            J_world[1, k] + c * x - a * z,
            J_world[2, k] + a * y - b * x,
            a, b, c,
        )  # fmt: skip


@kernel
def bias_acceleration(
    J_world: Array, moved_by: Array, n_base: int, x: Array, point: Array, out: Array
) -> None:
    """Acceleration of a frame while all inputs keep their values: Jdot x.

    The classical one: see `spatial_bias`, then omega x v of the frame's origin.

    Args:
        J_world: (6, n_inputs) of `input_jacobian`.
        moved_by: (n_inputs,) nonzero for each input that moves the frame.
        n_base: number of base inputs, the first columns.
        x: (n_inputs,) inputs [m/s or rad/s].
        point: (3,) the frame's origin in the world [m].
        out: (6,) linear [m/s^2] of the point, then angular [rad/s^2], is written.
    """
    twist = np.empty(6)
    spatial_bias(J_world, moved_by, n_base, x, twist, out)
    a0, a1, a2 = point_acceleration(twist, out, point)
    out[0], out[1], out[2] = a0, a1, a2


@kernel
def point_acceleration(twist: Array, spatial: Array, point: Array) -> tuple[float, float, float]:
    """Acceleration of a body's point [m/s^2] from its spatial velocity and acceleration."""
    p0, p1, p2 = point[0], point[1], point[2]
    w0, w1, w2, b0, b1, b2 = twist[3], twist[4], twist[5], spatial[3], spatial[4], spatial[5]
    u0, u1, u2 = (
        twist[0] + w1 * p2 - w2 * p1, twist[1] + w2 * p0 - w0 * p2, twist[2] + w0 * p1 - w1 * p0
    )  # fmt: skip
    return (
        spatial[0] + b1 * p2 - b2 * p1 + w1 * u2 - w2 * u1,
        spatial[1] + b2 * p0 - b0 * p2 + w2 * u0 - w0 * u2,
        spatial[2] + b0 * p1 - b1 * p0 + w0 * u1 - w1 * u0,
    )


@kernel
def spatial_bias(
    J_world: Array, moved_by: Array, n_base: int, x: Array, twist: Array, out: Array
) -> None:
    """Spatial velocity of a frame, and its spatial acceleration while all inputs are held.

    The sum over the joints from mount to frame of V_before x S_k x_k in spatial algebra
    (Featherstone 2008, sections 2.9 to 2.11), then omega x v of the frame's origin, which turns
    the spatial acceleration into the classical one. The base moves on an arc: its twist is
    constant in its own frame, so its own spatial acceleration is zero.

    The inputs that move one frame lie on one path from the world to it. So the mask is all
    that is needed, also in a tree: every marked column before the k-th belongs to a joint
    that carries joint k. It would not be enough for a mask that is no such path, or for
    columns of which a child comes before its parent.

    Args:
        J_world: (6, n_inputs) of `input_jacobian`.
        moved_by: (n_inputs,) nonzero for each input that moves the frame.
        n_base: number of base inputs, the first columns.
        x: (n_inputs,) inputs [m/s or rad/s].
        twist: (6,) spatial velocity [m/s, rad/s], is written.
        out: (6,) spatial acceleration [m/s^2, rad/s^2], is written.
    """
    v0, v1, v2, w0, w1, w2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    a0, a1, a2, b0, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(x)):
        if moved_by[k] == 0:
            continue
        r = x[k]
        m0, m1, m2 = r * J_world[0, k], r * J_world[1, k], r * J_world[2, k]
        n0, n1, n2 = r * J_world[3, k], r * J_world[4, k], r * J_world[5, k]
        if k >= n_base:
            a0 += w1 * m2 - w2 * m1 + v1 * n2 - v2 * n1
            a1 += w2 * m0 - w0 * m2 + v2 * n0 - v0 * n2
            a2 += w0 * m1 - w1 * m0 + v0 * n1 - v1 * n0
            b0 += w1 * n2 - w2 * n1
            b1 += w2 * n0 - w0 * n2
            b2 += w0 * n1 - w1 * n0
        v0, v1, v2 = v0 + m0, v1 + m1, v2 + m2
        w0, w1, w2 = w0 + n0, w1 + n1, w2 + n2
    twist[0], twist[1], twist[2], twist[3], twist[4], twist[5] = v0, v1, v2, w0, w1, w2
    out[0], out[1], out[2], out[3], out[4], out[5] = a0, a1, a2, b0, b1, b2


@kernel
def _turn(R: Array, axis: Array, angle: float) -> None:
    """Turn a frame, (3, 3) in place, about a unit vector in it (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    d = 1.0 - c
    for i in range(3):
        a, b, e = R[i, 0], R[i, 1], R[i, 2]
        R[i, 0] = a * (c + d * x * x) + b * (d * x * y + s * z) + e * (d * x * z - s * y)
        R[i, 1] = a * (d * x * y - s * z) + b * (c + d * y * y) + e * (d * y * z + s * x)
        R[i, 2] = a * (d * x * z + s * y) + b * (d * y * z - s * x) + e * (c + d * z * z)


@kernel
def _slide(p: Array, R: Array, axis: Array, distance: float) -> None:
    """Move a frame's origin, (3,) in place, along a unit vector in the frame."""
    for i in range(3):
        p[i] += distance * (R[i, 0] * axis[0] + R[i, 1] * axis[1] + R[i, 2] * axis[2])


@kernel
def _write_column(
    J: Array, k: int, v0: float, v1: float, v2: float, w0: float, w1: float, w2: float
) -> None:
    J[0, k], J[1, k], J[2, k] = v0, v1, v2
    J[3, k], J[4, k], J[5, k] = w0, w1, w2
