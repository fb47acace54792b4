"""The straight way of the tool: a line and one rotation, under one quintic profile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.rotations import axis_angle, rotation_vector
from motm_wbc.mission.quintic import quintic_coefficients, quintic_state

_PEAK = 1.875  # a quintic's largest speed over its mean one
_LINEAR_SPEED = 0.4  # [m/s]
_ANGULAR_SPEED = 1.2  # [rad/s]
_SHORTEST = 1.0  # [s]
_LINEAR_STEP = 0.005  # [m] between the samples of a path
_ANGULAR_STEP = 0.02  # [rad]


@dataclass(frozen=True, slots=True, eq=False)
class PathState:
    """Where the tool shall be and how it shall move there.

    Attributes:
        T_world_tool: (4, 4).
        twist: (6,) linear, then angular, world axes [m/s, rad/s].
        acceleration: (6,) [m/s^2, rad/s^2].
    """

    T_world_tool: Array
    twist: Array
    acceleration: Array


class StraightPath:
    """From one pose of the tool to another, from rest to rest.

    Attributes:
        duration: [s].
        length: [m].
        angle: [rad].

    Args:
        T_start: (4, 4) in the world.
        T_end: (4, 4) in the world.
    """

    def __init__(self, T_start: Array, T_end: Array) -> None:
        self._T_start = T_start
        self._line = T_end[:3, 3] - T_start[:3, 3]
        self._turn = rotation_vector(T_end[:3, :3] @ T_start[:3, :3].T)
        self.length = float(np.linalg.norm(self._line))
        self.angle = float(np.linalg.norm(self._turn))
        slowest = max(self.length / _LINEAR_SPEED, self.angle / _ANGULAR_SPEED)
        self.duration = max(_PEAK * slowest, _SHORTEST)
        rest = np.zeros((3, 1))
        self._share = quintic_coefficients(rest, np.array([[1.0], [0.0], [0.0]]), self.duration)

    def at(self, time: float) -> PathState:
        """The state at `time` [s]; before the start and after the end at rest."""
        inside = min(max(time, 0.0), self.duration)
        share, rate, curve = (float(value) for value in quintic_state(self._share, inside)[:, 0])
        way = np.concatenate((self._line, self._turn))
        return PathState(self.pose(share), rate * way, curve * way)

    def pose(self, share: float) -> Array:
        """(4, 4) tool pose at a share in [0, 1] of the way."""
        T = self._T_start.copy()
        T[:3, 3] += share * self._line
        if self.angle > 0.0:
            T[:3, :3] = axis_angle(self._turn, share * self.angle) @ T[:3, :3]
        return T

    def samples(self) -> Array:
        """(n, 4, 4) tool poses, at most 5 mm and 0.02 rad apart."""
        count = int(max(self.length / _LINEAR_STEP, self.angle / _ANGULAR_STEP)) + 2
        return np.stack([self.pose(float(share)) for share in np.linspace(0.0, 1.0, count)])
