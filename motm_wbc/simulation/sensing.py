"""What the robot is told: the truth, made noisy and late as the scenario says."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import GroundTruth, RobotState, WorldState
from motm_wbc.scene.scenario import Sensing

Sample = tuple[RobotState, WorldState]


class Sensors:
    """Noise and delay of the samples that a plant hands out.

    Noise is drawn once a control step, so reading twice gives the same sample. A late sample
    is late as a whole: its states and time stamps are of one instant.

    Args:
        sensing: standard deviations and delay.
        control_period: time between samples [s].
        generator: source of the noise; None switches noise off (the nominal run).
    """

    def __init__(
        self, sensing: Sensing, control_period: float, generator: np.random.Generator | None
    ) -> None:
        self._sensing = sensing
        self._generator = generator
        late = round(sensing.delay / control_period)
        self._samples: deque[Sample] = deque(maxlen=late + 1)

    def observe(self, truth: GroundTruth, fingers_loaded: bool) -> None:
        """Take the sample of this control step."""
        self._samples.append(self._sample(truth, fingers_loaded))

    def newest(self) -> Sample:
        """The newest sample that has arrived; before the delay has passed, the first one."""
        return self._samples[0]

    def _sample(self, truth: GroundTruth, fingers_loaded: bool) -> Sample:
        robot = RobotState(
            time=truth.time,
            base_pose=self._seen_base(truth.base_pose),
            base_velocity=truth.base_velocity,
            q=truth.q,
            v=truth.v,
            gripper_width=truth.gripper_width,
            fingers_loaded=fingers_loaded,
        )
        objects = self._seen_objects(truth.objects)
        return robot, WorldState(time=truth.time, objects=objects, moving=truth.moving)

    def _seen_base(self, pose: Array) -> Array:
        if self._generator is None:
            return pose
        position, heading = self._sensing.base_position_noise, self._sensing.base_heading_noise
        return pose + self._generator.standard_normal(3) * [position, position, heading]

    def _seen_objects(self, objects: Mapping[str, Array]) -> Mapping[str, Array]:
        if self._generator is None:
            return objects
        seen = {}
        for name, pose in objects.items():
            noisy = pose.copy()
            noisy[:3, 3] += self._sensing.object_position_noise * self._generator.normal(size=3)
            seen[name] = noisy
        return seen
