"""One box a degree of freedom: position, velocity and acceleration limits as speed bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.geometry.jit import inlined
from motm_wbc.kinematics.model import RobotModel

_ROUNDING = 1e-9
"""Distance kept to a position limit [rad or m], so that rounding never passes it."""
_ENDLESS = 1e6  # [rad] stands for the range of a joint without position limits
_BASE_TOLERANCE = 1e-6
"""Share by which base accelerations may pass their limits: a reference that was ramped at the
limit must be followed exactly, not braked for because of a rounding error."""


class JointArrays(NamedTuple):
    """Limits of the arm's joints, (n,) each.

    Attributes:
        lower: positions [rad or m].
        upper: positions [rad or m].
        v_max: speeds [rad/s or m/s].
        a_max: accelerations [rad/s^2 or m/s^2].
        recovery: speeds back into the range that are asked for [rad/s or m/s].
    """

    lower: Array
    upper: Array
    v_max: Array
    a_max: Array
    recovery: Array


class BaseArrays(NamedTuple):
    """Limits of the base's inputs, (n_base,) each.

    Attributes:
        slowest: least inputs [m/s, rad/s].
        fastest: largest inputs [m/s, rad/s].
        change: largest changes in one control step [m/s, rad/s].
    """

    slowest: Array
    fastest: Array
    change: Array


@dataclass(frozen=True, slots=True)
class JointBox:
    """Bounds of the joint velocities in one step, all (n,) [rad/s or m/s].

    Attributes:
        lower: position, velocity and acceleration limits together.
        upper: the same; never below `lower`.
        hard_lower: position and velocity limits only.
        hard_upper: the same; never below `hard_lower`.
        passed: by how much the acceleration limit has to be passed for these.
    """

    lower: Array
    upper: Array
    hard_lower: Array
    hard_upper: Array
    passed: Array


@inlined
def joint_box(
    limits: JointArrays,
    dt: float,
    q: Array,
    v: Array,
    lower: Array,
    upper: Array,
    hard_lower: Array,
    hard_upper: Array,
    passed: Array,
) -> None:
    """Bounds for joints at `q` (n,) whose last commanded velocities are `v` (n,).

    Where limits contradict each other, position goes before velocity, velocity before
    acceleration. The position bound is the exact speed from which a stop in discrete time is
    possible, so whoever starts inside it never needs more than the acceleration limit. A joint
    outside its range may not go further out and is led back.

    The last arguments, (n,) each, are written: the fields of `JointBox`.
    """
    for i in range(len(q)):
        below, above = q[i] - limits.lower[i], limits.upper[i] - q[i]
        slowest, fastest = v[i] - limits.a_max[i] * dt, v[i] + limits.a_max[i] * dt
        low = -min(stopping_speed(below, limits.a_max[i], dt), limits.v_max[i])
        high = min(stopping_speed(above, limits.a_max[i], dt), limits.v_max[i])
        if below < 0.0:
            low = max(min(-below / dt, limits.recovery[i], fastest), 0.0)
        if above < 0.0:
            high = min(max(above / dt, -limits.recovery[i], slowest), 0.0)
        hard_lower[i], hard_upper[i] = low, high
        lower[i] = min(max(slowest, low), high)
        upper[i] = max(min(fastest, high), low)
        passed[i] = max(slowest - high, low - fastest, 0.0)


@inlined
def scale_interval(limits: BaseArrays, reference: Array, previous: Array) -> tuple[float, float]:
    """Factors s in [0, 1] for which s * reference keeps all limits, (least, most).

    Args:
        limits: of the base.
        reference: (n_base,) inputs that navigation asks for.
        previous: (n_base,) last commanded inputs.

    Returns:
        least > most where there is no such factor.
    """
    least, most = 0.0, 1.0
    for i in range(len(reference)):
        ask, step = reference[i], limits.change[i] * (1.0 + _BASE_TOLERANCE)
        if ask == 0.0:
            if abs(previous[i]) > step:
                return 1.0, 0.0
            continue
        first, second = (previous[i] - step) / ask, (previous[i] + step) / ask
        speed = limits.fastest[i] if ask > 0.0 else limits.slowest[i]
        least = max(least, min(first, second))
        most = min(most, max(first, second), speed / ask)
    return least, most


@inlined
def brake_on_arc(limits: BaseArrays, previous: Array, out: Array) -> None:
    """The last command, shrunk as one: the base brakes on the arc that it is on.

    The arc is the one whose braking navigation checked. Speed limits hold in any case.

    Args:
        limits: of the base.
        previous: (n_base,) last commanded inputs.
        out: (n_base,), is written.
    """
    steps = 0.0
    for i in range(len(previous)):
        steps = max(steps, abs(previous[i]) / limits.change[i])
    factor = max(0.0, 1.0 - 1.0 / steps) if steps > 0.0 else 0.0
    for i in range(len(previous)):
        limit = limits.fastest[i] if previous[i] > 0.0 else -limits.slowest[i]
        if abs(previous[i]) * factor > limit:
            factor = limit / abs(previous[i])
    for i in range(len(previous)):
        out[i] = previous[i] * factor


@inlined
def base_box(limits: BaseArrays, previous: Array, lower: Array, upper: Array) -> None:
    """Bounds (n_base,) of free base inputs, written; speed goes before acceleration."""
    for i in range(len(previous)):
        least, most = previous[i] - limits.change[i], previous[i] + limits.change[i]
        lower[i] = min(max(least, limits.slowest[i]), limits.fastest[i])
        upper[i] = max(min(most, limits.fastest[i]), limits.slowest[i])


class JointLimits:
    """Turns joint limits into the box of one step.

    Args:
        position: (2, n) lower and upper position limits [rad or m]; infinite for none.
        v_max: (n,) speed limits [rad/s or m/s].
        a_max: (n,) acceleration limits [rad/s^2 or m/s^2].
        dt: control step [s].
        recovery_speed: speed back into the range that is asked for [rad/s or m/s].
    """

    def __init__(
        self,
        position: Array,
        v_max: Array,
        a_max: Array,
        dt: float,
        recovery_speed: float,
    ) -> None:
        lower, upper = np.clip(position, -_ENDLESS, _ENDLESS)
        inset = np.minimum(_ROUNDING, 0.25 * (upper - lower))
        v_max = np.array(v_max, dtype=float)
        recovery = np.minimum(recovery_speed, v_max)
        self.arrays = JointArrays(
            lower + inset, upper - inset, v_max, np.array(a_max, dtype=float), recovery
        )
        self._dt = dt

    @classmethod
    def of(cls, model: RobotModel, dt: float, recovery_speed: float) -> JointLimits:
        """Those of a robot's arm."""
        position = np.stack((model.q_lower, model.q_upper))
        return cls(position, model.v_max, model.a_max, dt, recovery_speed)

    def box(self, q: Array, v: Array) -> JointBox:
        """Bounds for joints at `q` (n,) whose last commanded velocities are `v` (n,)."""
        box = JointBox(*np.empty((5, len(q))))
        joint_box(
            self.arrays, self._dt, q, v,
            box.lower, box.upper, box.hard_lower, box.hard_upper, box.passed,
        )  # fmt: skip
        return box

    def braked(self, v: Array) -> Array:
        """The velocities nearest to rest that the acceleration limits allow from `v` (n,)."""
        change = self.arrays.a_max * self._dt
        return np.asarray(v - np.minimum(np.maximum(v, -change), change))


class BaseBounds:
    """Speed and acceleration bounds of the base's inputs, for one control step.

    Args:
        limits: of the base; a sideways input has those of the forward one.
        n_base: 2 for (v, omega), 3 for (v_x, v_y, omega).
        dt: control step [s].
    """

    def __init__(self, limits: BaseLimits, n_base: int, dt: float) -> None:
        sideways = [limits.v_max] * (n_base - 2)
        self.arrays = BaseArrays(
            np.array([-limits.v_reverse, *(-value for value in sideways), -limits.omega_max]),
            np.array([limits.v_max, *sideways, limits.omega_max]),
            np.array([limits.a_max] * (n_base - 1) + [limits.alpha_max]) * dt,
        )

    def scale_interval(self, reference: Array, previous: Array) -> tuple[float, float] | None:
        """Factors in [0, 1] by which `reference` (n_base,) may be scaled; None for none."""
        least, most = scale_interval(self.arrays, reference, previous)
        return (least, most) if least <= most else None

    def braked(self, previous: Array) -> Array:
        """(n_base,) inputs with which the base brakes on the arc of `previous` (n_base,)."""
        out = np.empty(len(previous))
        brake_on_arc(self.arrays, previous, out)
        return out
