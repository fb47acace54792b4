"""What a step of the local planner starts from, checked and packed for the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_admissible import Keep
from motm_wbc.basenav.staa_escape import WaysOut
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

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


def check_inputs(footprint: Array, limits: BaseLimits) -> None:
    """Refuse what can't be planned with."""
    shape = np.asarray(footprint, dtype=float)
    if shape.ndim != 2 or shape.shape[1] != 2 or len(shape) < 3 or not np.isfinite(shape).all():
        raise InputError("must be a polygon of shape (n, 2), n >= 3, finite", "footprint")
    corners = polygons.counter_clockwise(shape)
    sides = np.roll(corners, -1, axis=0) - corners
    after = np.roll(sides, -1, axis=0)
    bends = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
    if (bends < -1e-9).any() or polygons.signed_area(corners) < 1e-6:
        raise InputError("must be convex and have an area", "footprint")
    for name in ("v_max", "omega_max", "a_max", "alpha_max"):
        value = getattr(limits, name)
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"must be a finite number > 0, got {value}", name)
    if not (math.isfinite(limits.v_reverse) and limits.v_reverse >= 0.0):
        raise InputError(f"must be a finite number >= 0, got {limits.v_reverse}", "v_reverse")
