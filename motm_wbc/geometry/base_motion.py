"""How a mobile base moves: its kind, its limits, its ramp, and the arc on which it brakes."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array


class BaseKind(enum.StrEnum):
    """What the base's inputs are: (v, omega), or (v_x, v_y, omega) in the base frame."""

    DIFFERENTIAL = "differential"
    OMNIDIRECTIONAL = "omnidirectional"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in order."""
        if self is BaseKind.DIFFERENTIAL:
            return ("v", "omega")
        return ("v_x", "v_y", "omega")


@dataclass(frozen=True, slots=True)
class BaseLimits:
    """Speed and acceleration limits of a base that is driven along its heading.

    Attributes:
        v_max: forward speed [m/s].
        v_reverse: backward speed, as a positive number [m/s]; zero forbids reversing.
        omega_max: turn rate [rad/s].
        a_max: acceleration and deceleration along the heading [m/s^2].
        alpha_max: angular acceleration [rad/s^2].
    """

    v_max: float
    v_reverse: float
    omega_max: float
    a_max: float
    alpha_max: float

    def clip(self, v: float, omega: float) -> tuple[float, float]:
        """The nearest velocity inside the speed limits."""
        return (
            min(max(v, -self.v_reverse), self.v_max),
            min(max(omega, -self.omega_max), self.omega_max),
        )


class VelocityRamp:
    """Moves (v, omega) from where they are toward where a base step shall end."""

    def __init__(self, limits: BaseLimits, base_period: float, dt: float) -> None:
        """Set up for base steps of `base_period` [s] and control steps of `dt` [s]."""
        self._limits = limits
        self._base_period = base_period
        self._dt = dt
        self._rate = np.zeros(2)
        self._end = np.zeros(2)

    def start(self, velocity: Array, acceleration: Array) -> None:
        """Begin a base step at `velocity` (2,) with `acceleration` (2,)."""
        bounds = np.array([self._limits.a_max, self._limits.alpha_max])
        self._rate = np.clip(acceleration, -bounds, bounds)
        end = velocity + self._rate * self._base_period
        self._end = np.array(self._limits.clip(float(end[0]), float(end[1])))

    def advance(self, velocity: Array) -> Array:
        """(2,) velocity of the next control step, from the one commanded last."""
        step = np.abs(self._rate) * self._dt
        return np.asarray(velocity + np.clip(self._end - velocity, -step, step))


def stopping_time(v: float, omega: float, limits: BaseLimits) -> float:
    """Time to rest [s] when v and omega shrink together, so that the base stays on its arc."""
    return max(abs(v) / limits.a_max, abs(omega) / limits.alpha_max)


def braking_arc(
    pose: Array, v: float, omega: float, limits: BaseLimits, spacing: float = 0.03
) -> Array:
    """Poses on the arc along which the base comes to rest.

    Speed and turn rate are scaled by one factor that falls linearly to zero, the fastest
    that both acceleration limits allow: the base stays on the circle that it is on.

    Args:
        pose: (3,) start [m, m, rad].
        v: speed [m/s].
        omega: turn rate [rad/s].
        limits: acceleration limits.
        spacing: largest distance between poses [m], also of a point 1 m off per radian.

    Returns:
        (k, 3) poses, the first is `pose`, the last the pose at rest.
    """
    half = 0.5 * stopping_time(v, omega, limits)  # mean factor is one half
    reach = max(abs(v), abs(omega)) * half
    count = max(1, math.ceil(reach / spacing))
    return np.array(
        [se2.integrate_twist(pose, v, 0.0, omega, half * k / count) for k in range(count + 1)]
    )
