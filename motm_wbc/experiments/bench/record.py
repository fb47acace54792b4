"""Problems from our own controller: its closed loop, or random states that it can answer."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from motm_wbc.experiments.bench.ours import Command, joint_velocities
from motm_wbc.experiments.bench.plain_urdf import plain_urdf
from motm_wbc.experiments.bench.shared.motm_bench import Problem
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.rotations import axis_angle, pose, rotation_vector
from motm_wbc.kinematics.urdf import BASE_JOINTS, BASE_LINK

DT = 1.0 / 120.0
_FLOOR = 1000.0  # [m, rad] bounds of the base's joints: none
_GAIN = 2.0  # [1/s] speed toward the moving goal per distance
_LINEAR, _ANGULAR, _DAMPING = 50.0, 5.0, 0.01  # weights of tool and velocities
_POSTURE_GAIN = 2.0  # [1/s]
_LEAST_POSTURE = 0.05  # weight of joints that the robot has no preference for
_SAFE, _RATE = 0.01, 3.4  # [m, 1/s] of the others' rows: the least distance of ours, our rate
_TWIST = np.array([0.2, 0.2, 0.2, 0.5, 0.5, 0.5])  # [m/s, rad/s] largest random ones
_SAMPLES = 9  # points on a capsule's segment


@dataclass(frozen=True, slots=True)
class Figure:
    """The figure that the tool goes round in a closed loop.

    Attributes:
        size: (3,) amplitudes along the world's axes [m].
        frequency: (3,) of each axis [Hz].
        settle: steps before the first state that is kept: until the tool has caught up.
    """

    size: tuple[float, float, float] = (0.10, 0.13, 0.08)
    frequency: tuple[float, float, float] = (0.2, 0.4, 0.6)
    settle: int = 120

    def at(self, t: float) -> tuple[Array, Array]:
        """Place (3,) [m] and velocity (3,) [m/s] after t [s]."""
        size, rate = np.array(self.size), math.tau * np.array(self.frequency)
        return size * np.sin(rate * t), size * rate * np.cos(rate * t)


def blank(
    model: RobotModel, robot: str, name: str, boxes: Array, rows: int, influence: float
) -> Problem:
    """A problem with no states yet.

    Args:
        model: the robot.
        robot: its name or file.
        name: of the problem.
        boxes: (b, 6) of the scene.
        rows: collision rows; 0 leaves all shapes out.
        influence: distance within which other libraries look at a pair [m].
    """
    limits, n_arm = model.base_limits, model.n_arm
    speed, nothing = max(limits.v_max, limits.v_reverse), np.zeros((0, 3 + n_arm))
    return Problem(
        name=name,
        robot=robot,
        urdf=plain_urdf(model),
        joints=(*BASE_JOINTS, *model.arm_joints),
        tool_link=model.tool_link,
        dt=DT,
        lower=np.concatenate((np.full(3, -_FLOOR), np.maximum(model.q_lower, -_FLOOR))),
        upper=np.concatenate((np.full(3, _FLOOR), np.minimum(model.q_upper, _FLOOR))),
        v_max=np.concatenate(([speed, speed, limits.omega_max], model.v_max)),
        a_max=np.concatenate(([limits.a_max, limits.a_max, limits.alpha_max], model.a_max)),
        q=nothing,
        v_previous=nothing,
        inputs_previous=np.zeros((0, model.n_base)),
        twist=np.zeros((0, 6)),
        T_world_target=np.zeros((0, 4, 4)),
        posture=model.posture.value,
        posture_weights=np.maximum(model.posture.weight, _LEAST_POSTURE),
        posture_gain=_POSTURE_GAIN,
        linear_weight=_LINEAR,
        angular_weight=_ANGULAR,
        damping=_DAMPING,
        rows=rows,
        safe=_SAFE,
        influence=influence,
        rate=_RATE,
        capsule_names=model.capsules.names,
        capsule_links=model.capsules.frames,
        capsule_ends=np.stack((model.capsules.a, model.capsules.b), axis=1),
        capsule_radii=model.capsules.radius,
        base_link=BASE_LINK,
        base_box=np.concatenate((model.base_box.centre, model.base_box.size)),
        boxes=boxes,
        self_pairs=np.array(model.self_pairs, dtype=float).reshape(-1, 2),
        base_pairs=np.array(model.base_pairs, dtype=float),
    )


def closed_loop(empty: Problem, count: int, figure: Figure) -> Problem:
    """`count` states of our controller as its tool goes round a figure.

    Args:
        empty: from `blank`.
        count: states to keep.
        figure: that the tool goes round.
    """
    command = Command(empty, "daqp")
    model, states = command.model, _States()
    base_pose, q = np.zeros(3), model.home
    last = np.zeros(model.n_base), np.zeros(model.n_arm)
    start = model.configuration(base_pose, q).T_world_tool
    for k in range(-figure.settle, count):
        T = model.configuration(base_pose, q).T_world_tool
        place, velocity = figure.at((k + figure.settle) * empty.dt)
        twist = np.zeros(6)
        twist[:3] = _GAIN * (start[:3, 3] + place - T[:3, 3]) + velocity
        twist[3:] = _GAIN * rotation_vector(start[:3, :3] @ T[:3, :3].T)
        if k >= 0:
            states.add(base_pose, q, last, twist, T)
        answer = command(base_pose, q, last, twist)
        last = answer.base, answer.arm
        base_pose, q = moved(base_pose, answer.base, empty.dt), q + answer.arm * empty.dt
    return states.of(empty)


def moved(base_pose: Array, inputs: Array, dt: float) -> Array:
    """The base's pose after one step with these inputs."""
    left = float(inputs[1]) if len(inputs) == 3 else 0.0
    return se2.integrate_twist(base_pose, float(inputs[0]), left, float(inputs[-1]), dt)


def random_states(empty: Problem, count: int, seed: int) -> Problem:
    """`count` unrelated states at rest, clear of all shapes, each with a twist of its own.

    Args:
        empty: from `blank`.
        count: number of states.
        seed: of the states.
    """
    command, rng = Command(empty, "daqp"), np.random.default_rng(seed)
    model, states = command.model, _States()
    low, high = np.maximum(model.q_lower, -math.pi), np.minimum(model.q_upper, math.pi)
    rest = np.zeros(model.n_base), np.zeros(model.n_arm)
    while len(states) < count:
        base_pose = np.array([0.0, 0.0, rng.uniform(-math.pi, math.pi)])
        q = low + (high - low) * rng.uniform(0.1, 0.9, model.n_arm)
        twist = rng.uniform(-1.0, 1.0, 6) * _TWIST
        answer = command(base_pose, q, rest, twist)
        if answer.rung == "full" and answer.clearance > empty.safe:
            T = model.configuration(base_pose, q).T_world_tool
            states.add(base_pose, q, rest, twist, T)
    return states.of(empty)


class _States:
    """States in the making."""

    def __init__(self) -> None:
        self._q: list[Array] = []
        self._v: list[Array] = []
        self._inputs: list[Array] = []
        self._twist: list[Array] = []
        self._target: list[Array] = []

    def __len__(self) -> int:
        return len(self._q)

    def add(
        self, base_pose: Array, q: Array, last: tuple[Array, Array], twist: Array, T: Array
    ) -> None:
        self._q.append(np.concatenate((base_pose, q)))
        self._v.append(joint_velocities(float(base_pose[2]), *last))
        self._inputs.append(last[0])
        self._twist.append(twist)
        self._target.append(displaced(T, twist * DT))

    def of(self, empty: Problem) -> Problem:
        return replace(
            empty,
            q=np.array(self._q),
            v_previous=np.array(self._v),
            inputs_previous=np.array(self._inputs),
            twist=np.array(self._twist),
            T_world_target=np.array(self._target),
        )


def displaced(T: Array, step: Array) -> Array:
    """A pose (4, 4) after a shift [m] and a rotation vector [rad] (6,), in the world's axes."""
    angle = float(np.linalg.norm(step[3:]))
    turn = axis_angle(step[3:], angle) if angle > 0.0 else np.eye(3)
    return pose(turn @ T[:3, :3], T[:3, 3] + step[:3])


def near_pairs(problem: Problem, within: float) -> Array:
    """(n,) pairs of the robot and the scene, or of the robot, nearer than `within` [m].

    Distances are from samples on the capsules, so they are never too small.
    """
    model = Command(problem, "daqp").model
    return np.array([_count_near(model, problem, q, within) for q in problem.q])


def _count_near(model: RobotModel, problem: Problem, q: Array, within: float) -> int:
    segments = model.configuration(q[:3], q[3:]).capsule_segments()
    share = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    points = segments[:, None, 0] * (1.0 - share) + segments[:, None, 1] * share
    radii = problem.capsule_radii
    outside = np.abs(points[:, :, None] - problem.boxes[:, :3]) - 0.5 * problem.boxes[:, 3:]
    scene = np.linalg.norm(np.maximum(outside, 0.0), axis=-1).min(axis=1) - radii[:, None]
    i, j = problem.self_pairs.astype(int).T
    apart = np.linalg.norm(points[i][:, :, None] - points[j][:, None], axis=-1).min(axis=(1, 2))
    return int((scene < within).sum() + (apart - radii[i] - radii[j] < within).sum())
