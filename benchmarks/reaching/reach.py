"""One reach in a closed loop, judged by what does not control it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.reaching.chatter import high_share, most_reversals
from benchmarks.reaching.contact import ContactCheck
from benchmarks.reaching.distances import ExactDistances
from benchmarks.reaching.path import StraightPath
from benchmarks.reaching.scenes import Scene
from benchmarks.reaching.targets import Target
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.rotations import rotation_vector
from motm_wbc.qp import (
    FreeBase,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    WholeBodyResult,
)

POSITION_TOLERANCE = 0.005  # [m]
ANGLE_TOLERANCE = 0.05  # [rad]
_PATIENCE = 8.0  # [s] after the end of the reference
_HOLD = 0.5  # [s] that a target is held when reached
_STILL = 1e-3  # [rad/s, m/s] slower counts as at rest
_STUCK = 1.0  # [s] at rest off the target, after which it won't be reached
_ROUNDING = 1e-9
_AT_LIMIT = 2e-3  # [rad] to a position limit that counts as being at it
_FOUND_WEIGHT = 20.0
"""Weight of each joint's found position: it agrees with the target, so it may pull harder than
the robot's own preference, which need not."""
PAIR = " - "
"""Stands between the names of a pair."""
LIMIT = " at its limit"
"""Follows the name of a joint at its position limit."""


@dataclass(frozen=True, slots=True)
class Variant:
    """How the controller is used.

    Attributes:
        base_free: the base's inputs are free; else it stands.
        posture_found: the posture found by inverse kinematics is preferred; else the robot's.
    """

    base_free: bool = False
    posture_found: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a reach; plain numbers and names.

    Attributes:
        scene: seed.
        target: index.
        kind: of the target's region.
        drawn: targets drawn until this one counted.
        free: of these, how many had a free straight way.
        length: of the way [m].
        angle: of the way [rad].
        reached: within 5 mm and 0.05 rad, and held.
        time: until it was reached, or was given up [s].
        duration: of the reference [s].
        position_error: at the end [m].
        angle_error: at the end [rad].
        held_back: joints at a position limit at the end, and pairs that held the last command
            back.
        rungs: steps on each rung of the controller's ladder.
        reasons: what gave way, of steps off the first rung; the first few.
        contacts: pairs that touched.
        margin: least distance less safe distance [m].
        margin_pair: the pair that had it.
        margin_kind: its class.
        margin_time: when [s].
        limits_broken: steps in which a limit of position, speed or (on rungs that keep it)
            acceleration was passed.
        reversals: most changes of direction of a joint in a second.
        high_share: share of the velocities' energy above 10 Hz, second half of the motion.
        step_time: median of a step [s].
        regrouped: it got stuck on the straight way and went by the found posture.
        followed_share: of the straight way, what some chain of legal postures was found to
            follow; None if that was not looked for: the target was reached, or the base free.
    """

    scene: int
    target: int
    kind: str
    drawn: int
    free: int
    length: float
    angle: float
    reached: bool
    time: float
    duration: float
    position_error: float
    angle_error: float
    held_back: tuple[str, ...]
    rungs: dict[str, int]
    reasons: tuple[str, ...]
    contacts: tuple[str, ...]
    margin: float
    margin_pair: str
    margin_kind: str
    margin_time: float
    limits_broken: int
    reversals: int
    high_share: float
    step_time: float
    regrouped: bool = False
    followed_share: float | None = None

    @property
    def is_blocked(self) -> bool:
        """Whether no arm motion along the straight way was found."""
        return self.followed_share is not None and self.followed_share < 1.0


@dataclass(slots=True, eq=False)
class Motion:
    """All states and answers of a reach, one entry a step; states have one more.

    `regrouped` is the step from which it went for the found posture, if it had to.
    """

    base: list[Array]
    q: list[Array]
    results: list[WholeBodyResult] = field(default_factory=list)
    errors: list[tuple[float, float]] = field(default_factory=list)
    regrouped: int | None = None

    @property
    def arm_velocity(self) -> Array:
        """(t, n_arm) [rad/s]."""
        return np.array([result.arm for result in self.results])


def move(
    controller: WholeBodyController, scene: Scene, target: Target, variant: Variant
) -> tuple[Motion, StraightPath]:
    """Track the straight way and hold its end; where that gets stuck, regroup and try again.

    To regroup is to go for the posture that inverse kinematics found, whatever the tool does
    on the way, and then for the tool's target from there. Nothing plans: the collision rows
    keep the arm off things, or in front of them.
    """
    model = controller.model
    controller.reset()
    motion = Motion([np.zeros(3)], [target.q_start])
    path = StraightPath(
        model.configuration(motion.base[0], target.q_start).T_world_tool, target.T_world_target
    )
    loop = _Loop(controller, scene, target, variant, motion)
    loop.run(path, _posture(model, target, variant))
    if not _is_there(motion.errors[-1]) and not variant.posture_found:
        motion.regrouped = len(motion.results)
        found = _posture(model, target, replace(variant, posture_found=True))
        loop.run(None, found)
        loop.run(StraightPath(target.T_world_target, target.T_world_target), found)
    return motion, path


class _Loop:
    """The closed loop of a reach, one phase after the other."""

    def __init__(
        self,
        controller: WholeBodyController,
        scene: Scene,
        target: Target,
        variant: Variant,
        motion: Motion,
    ) -> None:
        self._controller, self._scene, self._target = controller, scene, target
        self._motion = motion
        model = controller.model
        self._base = FreeBase() if variant.base_free else NavigatedBase(np.zeros(model.n_base))
        self._last = np.zeros(model.n_base), np.zeros(model.n_arm)

    def run(self, path: StraightPath | None, posture: PostureTask) -> None:
        """Track a path, or only the posture, until at rest there, hopeless or too late."""
        dt, motion = self._controller.dt, self._motion
        duration = 0.0 if path is None else path.duration
        still = held = 0
        for k in range(math.ceil((duration + _PATIENCE) / dt)):
            self._step(() if path is None else (_task(path, k * dt),), posture)
            if k * dt < duration:
                continue
            held = held + 1 if _is_there(motion.errors[-1]) else 0
            fastest = max(float(np.abs(values).max()) for values in self._last)
            still = still + 1 if fastest < _STILL else 0
            if held * dt >= _HOLD or (still * dt >= _STUCK and held == 0):
                return

    def _step(self, tools: tuple[ToolTask, ...], posture: PostureTask) -> None:
        model, dt, motion = self._controller.model, self._controller.dt, self._motion
        result = self._controller.step(
            base_pose=motion.base[-1],
            q=motion.q[-1],
            previous=self._last,
            tools=tools,
            base=self._base,
            posture=posture,
            bodies=self._scene.bodies,
        )
        self._last = result.base, result.arm
        motion.results.append(result)
        motion.base.append(_driven(model, motion.base[-1], result.base, dt))
        motion.q.append(motion.q[-1] + result.arm * dt)
        motion.errors.append(_error(model, motion, self._target))


def _task(path: StraightPath, time: float) -> ToolTask:
    state = path.at(time)
    return ToolTask(
        twist=state.twist, T_world_target=state.T_world_tool, acceleration=state.acceleration
    )


def judge(
    controller: WholeBodyController,
    target: Target,
    scene: Scene,
    motion: Motion,
    path: StraightPath,
    checks: tuple[ExactDistances, ContactCheck],
) -> Outcome:
    """Distances by coal, contact by python-fcl, limits, and restlessness of a motion."""
    distances, contact = checks
    dt, results = controller.dt, motion.results
    margin = distances.of_run(np.array(motion.base), np.array(motion.q))
    touching = [
        name
        for pose, q in zip(motion.base, motion.q, strict=True)
        for name in contact.contacts(pose, q)
    ]
    rungs: dict[str, int] = {}
    for result in results:
        rungs[result.rung] = rungs.get(result.rung, 0) + 1
    velocity = motion.arm_velocity
    there = [_is_there(error) for error in motion.errors]
    away = max((k for k, inside in enumerate(there) if not inside), default=-1)
    return Outcome(
        scene=scene.seed,
        target=target.index,
        kind=target.kind,
        drawn=target.drawn,
        free=target.free,
        length=path.length,
        angle=path.angle,
        reached=there[-1],
        time=(away + 1) * dt,
        duration=path.duration,
        position_error=motion.errors[-1][0],
        angle_error=motion.errors[-1][1],
        held_back=_held_back(controller.model, motion),
        rungs=rungs,
        reasons=tuple(dict.fromkeys(r.reason for r in results if r.reason))[:3],
        contacts=tuple(dict.fromkeys(touching)),
        margin=margin.value,
        margin_pair=margin.pair,
        margin_kind=margin.kind,
        margin_time=margin.step * dt,
        limits_broken=_limits_broken(controller.model, motion, dt),
        reversals=most_reversals(velocity, dt),
        high_share=high_share(velocity[len(velocity) // 2 :], dt),
        step_time=float(np.median([result.step_time for result in results])),
        regrouped=motion.regrouped is not None,
    )


def _posture(model: RobotModel, target: Target, variant: Variant) -> PostureTask:
    wanted = model.posture
    if variant.posture_found:
        weights = np.full(model.n_arm, _FOUND_WEIGHT)
        return PostureTask(target.q_found, weights, wanted.lower, wanted.upper)
    return PostureTask(wanted.value, wanted.weight, wanted.lower, wanted.upper)


def _driven(model: RobotModel, pose: Array, inputs: Array, dt: float) -> Array:
    sideways = inputs[1] if model.base_kind is BaseKind.OMNIDIRECTIONAL else 0.0
    return se2.integrate_twist(pose, float(inputs[0]), float(sideways), float(inputs[-1]), dt)


def _error(model: RobotModel, motion: Motion, target: Target) -> tuple[float, float]:
    T = model.configuration(motion.base[-1], motion.q[-1]).T_world_tool
    turn = rotation_vector(target.T_world_target[:3, :3] @ T[:3, :3].T)
    distance = np.linalg.norm(target.T_world_target[:3, 3] - T[:3, 3])
    return float(distance), float(np.linalg.norm(turn))


def _is_there(error: tuple[float, float]) -> bool:
    return error[0] <= POSITION_TOLERANCE and error[1] <= ANGLE_TOLERANCE


def _held_back(model: RobotModel, motion: Motion) -> tuple[str, ...]:
    q = motion.q[-1]
    at_limit = np.minimum(q - model.q_lower, model.q_upper - q) < _AT_LIMIT
    joints = [name for name, stands in zip(model.arm_joints, at_limit, strict=True) if stands]
    pairs = [name for name in motion.results[-1].active if PAIR in name]
    return (*(name + LIMIT for name in joints), *pairs)


def _limits_broken(model: RobotModel, motion: Motion, dt: float) -> int:
    """Steps in which a joint passed a limit that its rung keeps."""
    count = 0
    last = np.zeros(model.n_arm)
    for q, result in zip(motion.q[1:], motion.results, strict=True):
        passed = (q < model.q_lower).any() or (q > model.q_upper).any()
        passed |= (np.abs(result.arm) > model.v_max + _ROUNDING).any()
        if result.rung == "full":
            change = np.abs(result.arm - last)
            passed |= (change > model.a_max * dt * (1.0 + _ROUNDING)).any()
        last = result.arm
        count += int(passed)
    return count
