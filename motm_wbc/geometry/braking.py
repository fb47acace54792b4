"""The largest speed from which a stop within a distance is possible, in discrete time."""

from __future__ import annotations

import math

from motm_wbc.geometry.jit import kernel


@kernel
def stopping_speed(distance: float, acceleration: float, dt: float) -> float:
    """Largest speed that may be held for one step `dt` and then braked to zero in time.

    The step moves v dt, then the speed falls by a dt each step; the sum must not pass
    `distance`. With D = d/(a dt^2) and m = floor((sqrt(1 + 8 D) - 1)/2) whole braking
    steps, v = a dt (D + m (m + 1)/2)/(m + 1). Exact, where the familiar closed form
    a (-dt/2 + sqrt(dt^2/4 + 2 d/a)) overshoots by up to a dt^2/8.

    Args:
        distance: distance to the limit [m or rad]; below zero counts as zero.
        acceleration: largest deceleration [m/s^2 or rad/s^2], > 0.
        dt: control step [s].

    Returns:
        Speed [m/s or rad/s].
    """
    change = acceleration * dt
    steps = max(distance, 0.0) / (change * dt)
    whole = math.floor((math.sqrt(1.0 + 8.0 * steps) - 1.0) / 2.0)
    return change * (steps + whole * (whole + 1.0) / 2.0) / (whole + 1.0)
