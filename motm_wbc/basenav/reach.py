"""Where an object has to be, seen from the arm's base, for the arm to work on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from motm_wbc.basenav.checks import not_negative, vector
from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True)
class ReachRegion:
    """A sector of a disc about the arm's base, fixed to the mobile base.

    Attributes:
        arm_xy: (2,) the arm's base in the base frame [m].
        radius: largest distance from the arm's base to the object [m].
        bearing: largest angle, to either side, between the base's heading and the object
            seen from the arm's base [rad]; pi: all round.
    """

    arm_xy: Array
    radius: float
    bearing: float = math.pi

    def __post_init__(self) -> None:
        """Check the region.

        Raises:
            InputError: a number is not finite, the radius or the bearing negative.
        """
        vector(self.arm_xy, 2, "arm_xy")
        not_negative(self.radius, "radius")
        not_negative(self.bearing, "bearing")

    def contains(self, pose: Array, object_xy: Array) -> bool:
        """Whether the object (2,) is in reach of a base at `pose` (3,)."""
        return bool(self.contains_each(pose[None], object_xy)[0])

    def contains_each(self, poses: Array, object_xy: Array) -> npt.NDArray[np.bool_]:
        """(m,) whether the object (2,) is in reach, for each of the base's poses (m, 3)."""
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        away = object_xy[:2] - poses[:, :2]
        x = c * away[:, 0] + s * away[:, 1] - self.arm_xy[0]
        y = c * away[:, 1] - s * away[:, 0] - self.arm_xy[1]
        near = np.hypot(x, y) <= self.radius
        return np.asarray(near & (np.abs(np.arctan2(y, x)) <= self.bearing))
