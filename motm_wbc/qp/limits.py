"""One box a degree of freedom: position, velocity and acceleration limits as speed bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.kinematics import RobotModel

_ROUNDING = 1e-9
"""Distance kept to a position limit [rad or m], so that rounding never passes it."""
_ENDLESS = 1e6  # [rad] stands for the range of a joint without position limits
_BASE_TOLERANCE = 1e-6
"""Share by which base accelerations may pass their limits: a reference that was ramped at the
limit must be followed exactly, not braked for because of a rounding error."""


@dataclass(frozen=True, slots=True)
class JointBox:
    """Bounds of the joint velocities in one step, all (n,) [rad/s or m/s].

    Attributes:
        lower: position, velocity and acceleration limits together.
        upper: the same; never below `lower`.
        hard_lower: position and velocity limits only.
        hard_upper: the same; never below `hard_lower`.
    """

    lower: Array
    upper: Array
    hard_lower: Array
    hard_upper: Array


class JointLimits:
    """Turns joint limits into the box of one step.

    Where limits contradict each other, position goes before velocity, velocity before
    acceleration. The position bound is the exact speed from which a stop in discrete time is
    possible, so whoever starts inside it never needs more than the acceleration limit. A joint
    outside its range may not go further out and is led back with at most `recovery_speed`.

    Args:
        position: (2, n) lower and upper position limits [rad or m]; infinite for none.
        v_max: (n,) speed limits [rad/s or m/s].
        a_max: (n,) acceleration limits [rad/s^2 or m/s^2].
        dt: control step [s].
        recovery_speed: largest speed back into the range [rad/s or m/s].
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
        self._lower = lower + inset
        self._upper = upper - inset
        self._v_max = np.asarray(v_max, dtype=float)
        self._a_max = np.stack((a_max, a_max))
        self._a_dt = np.asarray(a_max * dt)
        self._dt = dt
        self._recovery = np.minimum(recovery_speed, self._v_max)

    @classmethod
    def of(cls, model: RobotModel, dt: float, recovery_speed: float) -> JointLimits:
        """Those of a robot's arm."""
        position = np.stack((model.q_lower, model.q_upper))
        return cls(position, model.v_max, model.a_max, dt, recovery_speed)

    def box(self, q: Array, v: Array) -> JointBox:
        """Bounds for joints at `q` (n,) whose last commanded velocities are `v` (n,)."""
        room = np.stack((q - self._lower, self._upper - q))
        stop = np.minimum(stopping_speed(room, self._a_max, self._dt), self._v_max)
        slowest, fastest = v - self._a_dt, v + self._a_dt
        hard_lower, hard_upper = -stop[0], stop[1]
        if (room < 0.0).any():
            back = np.minimum(-room / self._dt, self._recovery)
            into = np.maximum(np.minimum(back[0], fastest), 0.0)
            hard_lower = np.where(room[0] < 0.0, into, hard_lower)
            into = np.minimum(np.maximum(-back[1], slowest), 0.0)
            hard_upper = np.where(room[1] < 0.0, into, hard_upper)
        return JointBox(
            np.minimum(np.maximum(slowest, hard_lower), hard_upper),
            np.maximum(np.minimum(fastest, hard_upper), hard_lower),
            hard_lower,
            hard_upper,
        )

    def braked(self, v: Array) -> Array:
        """The velocities nearest to rest that the acceleration limits allow from `v` (n,)."""
        return np.asarray(v - np.minimum(np.maximum(v, -self._a_dt), self._a_dt))

    def binding(self, index: int, at: float, box: JointBox, upper: bool) -> str:
        """Which limit a joint velocity is held by: position, velocity or acceleration."""
        hard = box.hard_upper[index] if upper else box.hard_lower[index]
        if at < hard if upper else at > hard:
            return "acceleration"
        return "velocity" if abs(hard) >= self._v_max[index] else "position"


class BaseBounds:
    """Speed and acceleration bounds of the base's inputs, for one control step.

    Args:
        limits: of the base; a sideways input has those of the forward one.
        n_base: 2 for (v, omega), 3 for (v_x, v_y, omega).
        dt: control step [s].
    """

    def __init__(self, limits: BaseLimits, n_base: int, dt: float) -> None:
        sideways = [limits.v_max] * (n_base - 2)
        self.slowest = np.array(
            [-limits.v_reverse, *(-value for value in sideways), -limits.omega_max]
        )
        self.fastest = np.array([limits.v_max, *sideways, limits.omega_max])
        self.change = np.array([limits.a_max] * (n_base - 1) + [limits.alpha_max]) * dt

    def scale_interval(self, reference: Array, previous: Array) -> tuple[float, float] | None:
        """Factors s in [0, 1] for which s * reference keeps all limits; None if there is none.

        Args:
            reference: (n_base,) inputs that navigation asks for.
            previous: (n_base,) last commanded inputs.
        """
        change = self.change * (1.0 + _BASE_TOLERANCE)
        least, most = 0.0, 1.0
        for ask, last, step, low, high in zip(
            reference.tolist(),
            previous.tolist(),
            change.tolist(),
            self.slowest.tolist(),
            self.fastest.tolist(),
            strict=True,
        ):
            if ask == 0.0:
                if abs(last) > step:
                    return None
                continue
            ends = (last - step) / ask, (last + step) / ask
            least = max(least, min(ends))
            most = min(most, *(max(ends), high / ask if ask > 0.0 else low / ask))
        return (least, most) if least <= most else None

    def braked(self, previous: Array) -> Array:
        """(n_base,) the last command, shrunk as one: the base brakes on the arc it is on.

        The arc is the one whose braking navigation checked. Speed limits hold in any case.
        """
        steps = float(np.max(np.abs(previous) / self.change))
        factor = max(0.0, 1.0 - 1.0 / steps) if steps > 0.0 else 0.0
        limit = np.where(previous > 0.0, self.fastest, -self.slowest)
        over = float(np.max(np.abs(previous) * factor - limit, initial=0.0))
        if over > 0.0:
            moving = np.abs(previous) > 0.0
            factor = min(factor, float(np.min(limit[moving] / np.abs(previous[moving]))))
        return np.asarray(previous * factor)

    def box(self, previous: Array) -> tuple[Array, Array]:
        """Bounds (n_base,) each of free base inputs; speed goes before acceleration."""
        low = np.minimum(np.maximum(previous - self.change, self.slowest), self.fastest)
        high = np.maximum(np.minimum(previous + self.change, self.fastest), self.slowest)
        return low, high
