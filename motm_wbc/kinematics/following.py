"""Compiled: an arm that follows a moving pose, one step of its joint speeds at a time.

Each step is a Newton step on the pose error, in the metric of the joints' speed limits, with a
wish in the nullspace. A joint that would leave the box of its step is held at the box's edge
and the step solved again without it (Flacco et al., "Motion control of redundant robots under
joint constraints: saturation in the null space", ICRA 2012).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, BoolArray, IntArray
from motm_wbc.geometry.distance import segment_prism, segment_segment
from motm_wbc.geometry.jit import kernel
from motm_wbc.geometry.prism import outline_edges
from motm_wbc.kinematics.chain import FIRST_ARM_POSITION, Chain, place
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.rotations import rotation_error

_NEWTON_STEPS = 5
_DAMPING = 1e-10  # of a step's normal equations, whose rows are metres in the joints' metric
_ALIGNED = 1e-9  # sine below which two axes are parallel


class ArmNumbers(NamedTuple):
    """What the kernels know of a robot; its base stands at the origin.

    Attributes:
        chain: the tree of joints, m frames.
        positions: vector of positions with the gripper open, base and arm at zero.
        q_lower: (n_arm,) [rad or m].
        q_upper: (n_arm,) [rad or m].
        v_max: (n_arm,) [rad/s or m/s].
        tool_joint: joint frame that the tool is fixed to.
        T_joint_tool: (4, 4) its pose there.
        capsule_joint: (k,) joint frame that each capsule moves with.
        capsule_ends: (k, 2, 3) in those frames [m].
        radius: (k,) of the capsules [m].
        self_pairs: (p, 2) capsules that must keep apart.
        base_pairs: (b,) capsules that must keep off the base's body.
        base_edges: (n, 7) outline of the base's body.
        base_height: of the base's body over the floor [m].
    """

    chain: Chain
    positions: Array
    q_lower: Array
    q_upper: Array
    v_max: Array
    tool_joint: int
    T_joint_tool: Array
    capsule_joint: IntArray
    capsule_ends: Array
    radius: Array
    self_pairs: IntArray
    base_pairs: IntArray
    base_edges: Array
    base_height: float


class _Work(NamedTuple):
    """Arrays that a step writes into."""

    positions: Array
    rotations: Array
    translations: Array
    J_world: Array
    J: Array
    error: Array
    gram: Array
    y: Array
    step: Array
    held: BoolArray
    closest: Array


def arm_numbers(model: RobotModel) -> ArmNumbers:
    """The numbers of a robot for the kernels of this file."""
    fingers = model.finger_positions(model.description.gripper.max_width)
    joint, placement = model.tool_frame
    return ArmNumbers(
        chain=model.chain,
        positions=np.concatenate((np.zeros(FIRST_ARM_POSITION + model.n_arm), fingers)),
        q_lower=np.asarray(model.q_lower, dtype=float),
        q_upper=np.asarray(model.q_upper, dtype=float),
        v_max=np.asarray(model.v_max, dtype=float),
        tool_joint=joint,
        T_joint_tool=np.ascontiguousarray(placement),
        capsule_joint=np.asarray(model.capsule_joint),
        capsule_ends=np.ascontiguousarray(model.capsule_ends),
        radius=np.asarray(model.capsules.radius, dtype=float),
        self_pairs=np.array(model.self_pairs, dtype=np.intp).reshape(-1, 2),
        base_pairs=np.array(model.base_pairs, dtype=np.intp),
        base_edges=outline_edges(model.footprint),
        base_height=float(model.base_height),
    )


@kernel
def follow(
    arm: ArmNumbers,
    T_base_targets: Array,
    counted: Array,
    dt: float,
    goal: Array,
    pull: Array,
    tolerance: tuple[float, float],
    safe: tuple[float, float],
    first: int,
    way: int,
    q: Array,
) -> int:
    """Follow a moving target as long as all limits can be kept.

    Args:
        arm: the robot.
        T_base_targets: (n, 4, 4) targets of the tool in the base frame.
        counted: (6,) nonzero for each axis along and about the tool's x, y, z that counts.
        dt: time between targets [s].
        goal: (n_arm,) positions that the nullspace leads to [rad or m].
        pull: (n_arm,) share of the way there that a step wishes to go.
        tolerance: errors of a pose that is held [m], [rad].
        safe: distances that are kept between capsules, and from the base's body [m].
        first: index of the target that `q[first]` holds.
        way: 1 to follow on from there, -1 to go back in time.
        q: (n, n_arm) joint positions; those after `first`, in the order of `way`, are written.

    Returns:
        Index of the last target that is held.
    """
    work = _new_work(arm)
    here = first
    while 0 <= here + way < len(q):
        there = here + way
        if not _move(
            arm, T_base_targets[there], counted, dt, goal, pull, tolerance, q[here], q[there], work
        ):
            break
        if not _clear(arm, safe, work):
            break
        here = there
    return here


@kernel
def is_clear(arm: ArmNumbers, safe: tuple[float, float], q: Array) -> bool:
    """Whether the arm keeps its distances from itself and the base.

    Args:
        arm: the robot.
        safe: distances that are kept between capsules, and from the base's body [m].
        q: (n_arm,) joint positions [rad or m].
    """
    work = _new_work(arm)
    _set(arm, q, work)
    return _clear(arm, safe, work)


@kernel
def _new_work(arm: ArmNumbers) -> _Work:
    m, n = len(arm.chain.parent), len(arm.v_max)
    return _Work(
        arm.positions.copy(),
        np.empty((m, 3, 3)),
        np.empty((m, 3)),
        np.empty((6, 3 + n)),
        np.empty((6, n)),
        np.empty(6),
        np.empty((6, 6)),
        np.empty(6),
        np.empty(n),
        np.zeros(n, dtype=np.bool_),
        np.empty(7),
    )


@kernel
def _set(arm: ArmNumbers, q: Array, work: _Work) -> None:
    """Forward kinematics and Jacobian at `q` (n_arm,)."""
    work.positions[FIRST_ARM_POSITION : FIRST_ARM_POSITION + len(q)] = q
    place(arm.chain, False, len(q), work.positions, work.rotations, work.translations, work.J_world)


@kernel
def _move(
    arm: ArmNumbers,
    T_base_target: Array,
    counted: Array,
    dt: float,
    goal: Array,
    pull: Array,
    tolerance: tuple[float, float],
    before: Array,
    q: Array,
    work: _Work,
) -> bool:
    """Go from `before` (n_arm,) to `q` (n_arm,), which is written; False if it can't be."""
    n = len(q)
    q[:] = before
    for newton in range(_NEWTON_STEPS + 1):
        _set(arm, q, work)
        rows, distance, angle = _pose_error(arm, T_base_target, counted, work)
        if newton > 0 and distance <= tolerance[0] and angle <= tolerance[1]:
            return True
        if newton == _NEWTON_STEPS:
            break
        for j in range(n):
            wish = pull[j] * (goal[j] - before[j]) if newton == 0 else 0.0
            low, high = _room(arm, j, before[j], q[j], dt)
            work.step[j] = min(max(wish, low), high)
        _solve_in_box(arm, rows, before, q, dt, work)
        for j in range(n):
            low, high = _room(arm, j, before[j], q[j], dt)
            q[j] += min(max(work.step[j], low), high)
    return False


@kernel
def _room(arm: ArmNumbers, j: int, before: float, now: float, dt: float) -> tuple[float, float]:
    """How far a joint may still go down and up in this step."""
    reach = arm.v_max[j] * dt
    return max(before - reach, arm.q_lower[j]) - now, min(before + reach, arm.q_upper[j]) - now


@kernel
def _solve_in_box(
    arm: ArmNumbers, rows: int, before: Array, q: Array, dt: float, work: _Work
) -> None:
    """The step nearest to the wished one, in `work.step`, that removes the error, in its box."""
    n = len(q)
    J, error, step, held = work.J, work.error, work.step, work.held
    held[:] = False
    for i in range(rows):
        for j in range(n):
            error[i] -= J[i, j] * step[j]
    for _ in range(n):
        _least_step(arm, rows, work)
        worst, over = -1, 1e-12
        for j in range(n):
            if held[j]:
                continue
            move = _moved(arm, rows, j, work)
            low, high = _room(arm, j, before[j], q[j], dt)
            beyond = max(low - (step[j] + move), step[j] + move - high) / arm.v_max[j]
            if beyond > over:
                worst, over = j, beyond
        if worst < 0:
            break
        low, high = _room(arm, worst, before[worst], q[worst], dt)
        up = step[worst] + _moved(arm, rows, worst, work) > high
        edge = high if up else low
        for i in range(rows):
            error[i] -= J[i, worst] * (edge - step[worst])
        step[worst] = edge
        held[worst] = True
    for j in range(n):
        if not held[j]:
            step[j] += _moved(arm, rows, j, work)


@kernel
def _least_step(arm: ArmNumbers, rows: int, work: _Work) -> None:
    """Multipliers `work.y` of the least step of the free joints that removes the error."""
    J, gram, y = work.J, work.gram, work.y
    for i in range(rows):
        for k in range(i + 1):
            total = _DAMPING if i == k else 0.0
            for j in range(len(arm.v_max)):
                if not work.held[j]:
                    total += J[i, j] * J[k, j] * arm.v_max[j] * arm.v_max[j]
            gram[i, k] = total
    for i in range(rows):  # Cholesky
        for k in range(i + 1):
            total = gram[i, k]
            for j in range(k):
                total -= gram[i, j] * gram[k, j]
            gram[i, k] = math.sqrt(max(total, _DAMPING)) if i == k else total / gram[k, k]
    for i in range(rows):
        total = work.error[i]
        for j in range(i):
            total -= gram[i, j] * y[j]
        y[i] = total / gram[i, i]
    for i in range(rows - 1, -1, -1):
        total = y[i]
        for j in range(i + 1, rows):
            total -= gram[j, i] * y[j]
        y[i] = total / gram[i, i]


@kernel
def _moved(arm: ArmNumbers, rows: int, j: int, work: _Work) -> float:
    """How far the least step moves a free joint."""
    total = 0.0
    for i in range(rows):
        total += work.J[i, j] * work.y[i]
    return float(total * arm.v_max[j] * arm.v_max[j])


@kernel
def _pose_error(
    arm: ArmNumbers, T_base_target: Array, counted: Array, work: _Work
) -> tuple[int, float, float]:
    """Write the counted rows of pose error and Jacobian in the tool's axes.

    Returns:
        Number of rows, distance [m] and angle [rad] from the target.
    """
    R_joint = work.rotations[arm.tool_joint]
    p = np.empty(3)
    R = np.zeros((3, 3))
    for i in range(3):
        p[i] = work.translations[arm.tool_joint, i]
        for k in range(3):
            p[i] += R_joint[i, k] * arm.T_joint_tool[k, 3]
            for j in range(3):
                R[i, j] += R_joint[i, k] * arm.T_joint_tool[k, j]
    turn = _turn(T_base_target[:3, :3], R, counted)
    J = work.J_world
    rows, distance, angle = 0, 0.0, 0.0
    for axis in range(6):
        if counted[axis] == 0.0:
            continue
        x, y, z = R[0, axis % 3], R[1, axis % 3], R[2, axis % 3]
        error = 0.0
        if axis < 3:
            for i in range(3):
                error += R[i, axis] * (T_base_target[i, 3] - p[i])
            distance += error * error
        else:
            error = x * turn[0] + y * turn[1] + z * turn[2]
            angle += error * error
        work.error[rows] = error
        for j in range(work.J.shape[1]):
            v0, v1, v2 = J[0, 3 + j], J[1, 3 + j], J[2, 3 + j]
            w0, w1, w2 = J[3, 3 + j], J[4, 3 + j], J[5, 3 + j]
            if axis < 3:
                v0 += w1 * p[2] - w2 * p[1]
                v1 += w2 * p[0] - w0 * p[2]
                v2 += w0 * p[1] - w1 * p[0]
                work.J[rows, j] = x * v0 + y * v1 + z * v2
            else:
                work.J[rows, j] = x * w0 + y * w1 + z * w2
        rows += 1
    return rows, math.sqrt(distance), math.sqrt(angle)


@kernel
def _turn(R_target: Array, R: Array, counted: Array) -> Array:
    """(3,) rotation vector to the target; with one free axis the least one that aligns it."""
    free, axis = 0, 0
    for i in range(3):
        if counted[3 + i] == 0.0:
            free += 1
            axis = i
    if free != 1:
        return rotation_error(R_target, R)
    a0, a1, a2 = R[0, axis], R[1, axis], R[2, axis]
    b0, b1, b2 = R_target[0, axis], R_target[1, axis], R_target[2, axis]
    turn = np.array((a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0))
    sine = math.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    cosine = a0 * b0 + a1 * b1 + a2 * b2
    if sine > _ALIGNED:
        turn *= math.atan2(sine, cosine) / sine
    elif cosine < 0.0:  # opposite: any axis square to it turns it round
        turn = math.pi * R[:, (axis + 1) % 3]
    return turn


@kernel
def _clear(arm: ArmNumbers, safe: tuple[float, float], work: _Work) -> bool:
    """Whether all pairs of capsules, and capsules and the base, keep their distances."""
    ends = np.empty((len(arm.radius), 2, 3))
    for k in range(len(arm.radius)):
        joint = arm.capsule_joint[k]
        R, p = work.rotations[joint], work.translations[joint]
        for end in range(2):
            local = arm.capsule_ends[k, end]
            for i in range(3):
                ends[k, end, i] = (
                    p[i] + R[i, 0] * local[0] + R[i, 1] * local[1] + R[i, 2] * local[2]
                )
    for pair in range(len(arm.self_pairs)):
        i, j = arm.self_pairs[pair]
        segment_segment(ends[i, 0], ends[i, 1], ends[j, 0], ends[j, 1], work.closest)
        if work.closest[0] < arm.radius[i] + arm.radius[j] + safe[0]:
            return False
    for k in arm.base_pairs:
        segment_prism(ends[k, 0], ends[k, 1], arm.base_edges, 0.0, arm.base_height, work.closest)
        if work.closest[0] < arm.radius[k] + safe[1]:
            return False
    return True
