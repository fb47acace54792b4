"""Grasp attempts and their injected failures: the same code behind every plant.

An attempt starts when the fingers begin to close with the tool at the grasp of an object and
nothing in the gripper. One that is made to fail closes only to a width larger than the object:
it closes on nothing, in the physics, so that the robot's own sensors are all that tells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.description import Gripper as GripperData
from motm_wbc.scene.scenario import GraspFailure
from motm_wbc.simulation.bodies import ObjectShape
from motm_wbc.simulation.parameters import PhysicsParameters

_WIDTH_STEP = 1e-4  # [m]; a smaller difference of widths is no motion of the fingers
_SQUEEZE = 5e-3  # [m] that the commanded width runs ahead of fingers that an object stops
_RELEASE = 1e-3  # [m] of opening beyond the width of the grasp that sets the object free
_REST = 0.1  # [s] at the commanded width after which closing further is a new motion


@dataclass(frozen=True, slots=True)
class Attempt:
    """One try to grasp an object.

    Attributes:
        time: when the fingers began to close [s].
        object: name of the object.
        failed_by_injection: the failure model decided that it fails.
        held: it ended with the object in the gripper.
    """

    time: float
    object: str
    failed_by_injection: bool
    held: bool = False


@dataclass(frozen=True, slots=True)
class Release:
    """An object was let go.

    Attributes:
        time: [s].
        object: its name.
    """

    time: float
    object: str


class FailureModel:
    """Decides which attempts fail (the paper's grasp failure delay, or a probability).

    Args:
        failure: delay and probability.
        control_period: time between commands [s]; attempts start on its multiples.
        generator: source of the draws; one is taken for every attempt.
    """

    def __init__(
        self, failure: GraspFailure, control_period: float, generator: np.random.Generator
    ) -> None:
        # The tolerance keeps 3 s at 120 Hz at 360 steps whatever the division rounds to.
        self._delay_steps = math.ceil(failure.delay / control_period - 1e-6)
        self._probability = failure.probability
        self._generator = generator
        self._first: dict[str, int] = {}

    def fails(self, name: str, step: int) -> bool:
        """Whether the attempt on `name` that starts at this control step fails."""
        first = self._first.setdefault(name, step)
        unlucky = bool(self._generator.random() < self._probability)
        return step - first < self._delay_steps or unlucky


class Fingers:
    """The width that the finger motors are led along.

    Args:
        gripper: widths and speeds.
        speed_scale: factor on the speeds.
    """

    def __init__(self, gripper: GripperData, speed_scale: float = 1.0) -> None:
        self._max_width = gripper.max_width
        self._opening_speed = gripper.opening_speed * speed_scale
        self._closing_speed = gripper.closing_speed * speed_scale
        self._min_closing_time = gripper.min_closing_time / speed_scale
        self._target = self._max_width
        self._speed = self._closing_speed
        self._stop = 0.0
        self._closing = False
        self._rested = 0.0
        self.reference = self._max_width

    def command(self, target: float, actual: float) -> bool:
        """Take a new target width [m]; whether a closing motion begins with it.

        A motion goes on until the fingers open again or have rested at their target.
        """
        wanted = min(max(target, 0.0), self._max_width)
        if wanted != self._target:
            self._target, self._rested = wanted, 0.0
        if self._target > self.reference + _WIDTH_STEP:
            self._closing = False
            self._stop = 0.0
            self.reference = max(self.reference, min(actual, self._target))
            return False
        if self._closing or self._target >= self.reference - _WIDTH_STEP:
            return False
        self._closing = True
        self._speed = self._closing_speed
        return True

    @property
    def closing(self) -> bool:
        """A closing motion is under way, or has ended on something."""
        return self._closing

    def close_on(self, width: float) -> None:
        """The present motion closes on something this wide [m]: take the time that it needs."""
        if self._min_closing_time > 0.0 and width < self.reference:
            gentle = (self.reference - width) / self._min_closing_time
            self._speed = min(self._closing_speed, gentle)

    def stop_at(self, width: float) -> None:
        """Let the present closing motion end at this width [m] at the least."""
        self._stop = min(width, self._max_width)

    def advance(self, actual: float, dt: float) -> None:
        """Move the reference on; it waits a little ahead of fingers that something stops."""
        if self._target > self.reference:
            self.reference = min(self.reference + self._opening_speed * dt, self._target)
            return
        lowest = max(self._target, self._stop, actual - _SQUEEZE)
        self.reference = max(self.reference - self._speed * dt, min(lowest, self.reference))
        at_target = self.reference <= self._target + _WIDTH_STEP
        self._rested = self._rested + dt if at_target else 0.0
        if self._rested > _REST:
            self._closing = False


class Gripper:
    """What fingers, attempts and the failure model do together.

    The plant tells it what touches; it tells the plant when to hold and when to let go.

    Args:
        shapes: name -> shape of every object.
        fingers: the motion of the fingers.
        failures: the failure model.
        parameters: radii and clearances.
    """

    def __init__(
        self,
        shapes: Mapping[str, ObjectShape],
        fingers: Fingers,
        failures: FailureModel,
        parameters: PhysicsParameters,
    ) -> None:
        self.fingers = fingers
        self.attempts: list[Attempt] = []
        self.releases: list[Release] = []
        self.grasp_time: dict[str, float] = {}
        self.held: str | None = None
        self._shapes = shapes
        self._failures = failures
        self._parameters = parameters
        self._open_attempt: str | None = None
        self._held_width = 0.0

    def begin_closing(
        self,
        step: int,
        time: float,
        T_world_tool: Array,
        closing_axis: Array,
        objects: Mapping[str, Array],
    ) -> None:
        """The fingers begin to close with nothing held: an attempt, if the tool is at a grasp.

        Nothing but an attempt can grip an object: else closing from just outside the radius
        of attempts would escape the failure model.

        Args:
            step: index of the control step.
            time: its time [s].
            T_world_tool: (4, 4) pose of the tool.
            closing_axis: (3,) direction of the fingers' motion in the world.
            objects: name -> T_world_object.
        """
        name, distance = self._nearest(T_world_tool[:3, 3], objects)
        width = self._shapes[name].width(objects[name], closing_axis)
        opening = self.fingers.reference
        self._open_attempt = None
        if distance <= self._parameters.attempt_radius:
            fails = self._failures.fails(name, step)
            self.attempts.append(Attempt(time, name, fails))
            self._open_attempt = None if fails else name
        if distance <= self._parameters.attempt_radius + opening and width < opening:
            self.fingers.close_on(width)
            if self._open_attempt is None:
                self.fingers.stop_at(width + self._parameters.failed_clearance)

    @property
    def ideal_width(self) -> float:
        """Distance of fingers that follow their reference and stop at what they hold [m]."""
        stopped = self._held_width if self.held is not None else 0.0
        return max(self.fingers.reference, stopped)

    def may_hold(self, name: str, T_world_tool: Array, T_world_object: Array) -> bool:
        """Whether fingers that both touch the object now hold it."""
        if self.held is not None or self._open_attempt != name:
            return False
        offset = T_world_tool[:3, 3] - self._shapes[name].grasp_point(T_world_object)
        return float(np.linalg.norm(offset)) <= self._parameters.hold_radius

    def take(self, name: str, width: float, time: float) -> None:
        """The object is in the gripper, at this width [m]."""
        self.held = name
        self._held_width = width
        self._open_attempt = None
        self.attempts[-1] = replace(self.attempts[-1], held=True)
        self.grasp_time[name] = time

    def must_release(self) -> bool:
        """Whether the fingers have opened so far that the held object falls."""
        return self.held is not None and self.fingers.reference > self._held_width + _RELEASE

    def release(self, time: float) -> str:
        """Let the held object go; its name."""
        assert self.held is not None
        name, self.held = self.held, None
        self.releases.append(Release(time, name))
        return name

    def _nearest(self, point: Array, objects: Mapping[str, Array]) -> tuple[str, float]:
        distances = {
            name: float(np.linalg.norm(point - self._shapes[name].grasp_point(pose)))
            for name, pose in objects.items()
        }
        name = min(distances, key=distances.__getitem__)
        return name, distances[name]
