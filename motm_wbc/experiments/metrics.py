"""What is measured of a run, from its trace of commands and truths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind

if TYPE_CHECKING:
    from motm_wbc.kinematics import RobotModel

_ROUNDING = 1e-9  # of a limit; below it is the arithmetic's


@dataclass(frozen=True, slots=True)
class Spread:
    """Median, 99th percentile and largest of wall times [ms]."""

    median: float
    p99: float
    max: float


def spread_ms(seconds: Array) -> Spread | None:
    """The spread of times given in [s]; None where nothing was timed."""
    if len(seconds) == 0:
        return None
    ms = 1e3 * np.asarray(seconds)
    return Spread(
        round(float(np.median(ms)), 4),
        round(float(np.percentile(ms, 99)), 4),
        round(float(ms.max()), 4),
    )


@dataclass(frozen=True, slots=True)
class MotionTrace:
    """Velocities and positions at the control rate.

    Attributes:
        base: (k, n_base) base inputs.
        arm: (k, n_arm) joint velocities.
        q: (k, n_arm) joint positions that the velocities are integrated from.
        counted: (k,) whether the step's acceleration counts.
        dt: [s].
    """

    base: Array
    arm: Array
    q: Array
    counted: Array
    dt: float


def limit_violation(model: RobotModel, motion: MotionTrace) -> float:
    """Largest excess over a limit, as a share of it; 0 if all hold.

    Speeds and accelerations of base and arm are taken as a share of their limits, the
    positions that the velocities integrate to as a share of the joint's range.
    """
    if len(motion.base) == 0:
        return 0.0
    rest = np.zeros((1, model.n_base + model.n_arm))
    velocity = np.hstack([motion.base, motion.arm])
    acceleration = np.diff(np.vstack([rest, velocity]), axis=0) / motion.dt
    acceleration = acceleration[motion.counted.astype(bool)]
    upper, lower, largest = _velocity_bounds(model)
    excess = [
        (velocity - upper) / np.maximum(upper, 1e-9),
        (lower - velocity) / np.where(lower < 0.0, -lower, upper),
        (np.abs(acceleration) - largest) / largest,
    ]
    ranged = np.isfinite(model.q_upper) & np.isfinite(model.q_lower)
    if ranged.any():
        reached = (motion.q + motion.arm * motion.dt)[:, ranged]
        span = (model.q_upper - model.q_lower)[ranged]
        excess.append((reached - model.q_upper[ranged]) / span)
        excess.append((model.q_lower[ranged] - reached) / span)
    worst = max((float(part.max()) for part in excess if part.size), default=0.0)
    return worst if worst > _ROUNDING else 0.0


def _velocity_bounds(model: RobotModel) -> tuple[Array, Array, Array]:
    """Upper and lower speed and largest acceleration of base inputs, then joints."""
    b = model.base_limits
    differential = model.base_kind is BaseKind.DIFFERENTIAL
    upper = [b.v_max, b.omega_max] if differential else [b.v_max, b.v_max, b.omega_max]
    lower = [-b.v_reverse, -b.omega_max] if differential else [-value for value in upper]
    change = [b.a_max, b.alpha_max] if differential else [b.a_max, b.a_max, b.alpha_max]
    return (
        np.concatenate([upper, model.v_max]),
        np.concatenate([lower, -model.v_max]),
        np.concatenate([change, model.a_max]),
    )
