"""What a step of the local planner starts from, packed for the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_admissible import Keep
from motm_wbc.basenav.staa_escape import WaysOut
from motm_wbc.geometry.arrays import Array

NOWHERE = Keep(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""No region to be kept in."""


@dataclass(frozen=True)
class Root:
    """The state that is planned from, and its first actions (see `first_actions`).

    Attributes:
        pose: (3,) of the base [m, m, rad].
        v: its speed [m/s].
        omega: its turn rate [rad/s].
        residue: what rounding has left of velocities that were braked, and v and omega are
            without; the command takes it away.
        margin: distance from what rests that can be kept [m].
        table: (n, 6) first actions.
        clear: (n,) which of them keep clear of what rests.
        admissible: (n,) which of them are safe in all respects.
        ways: ways out of what moves; None if nothing does.
        rests: (n, 3) poses at rest after each, and braking.
    """

    pose: Array
    v: float
    omega: float
    residue: tuple[float, ...]
    margin: float
    table: Array
    clear: NDArray[np.bool_]
    admissible: NDArray[np.bool_]
    ways: WaysOut | None
    rests: Array

    @property
    def brake(self) -> int:
        """Index of the brake."""
        return len(self.table) - 1


def with_direction(pose: Array) -> tuple[float, float, float, float]:
    """x, y, and cosine and sine of the heading."""
    heading = float(pose[2])
    return float(pose[0]), float(pose[1]), math.cos(heading), math.sin(heading)


def keep_of(region: ReachRegion | None, object_xy: Array | None) -> Keep:
    """The region for the kernels; without a region or an object there is none."""
    if region is None or object_xy is None or not np.isfinite(object_xy).all():
        return NOWHERE
    return Keep(
        True,
        float(region.arm_xy[0]),
        float(region.arm_xy[1]),
        float(region.radius),
        float(region.bearing),
        float(object_xy[0]),
        float(object_xy[1]),
    )
