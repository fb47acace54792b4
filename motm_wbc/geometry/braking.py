"""The largest speed from which a stop within a distance is possible, in discrete time."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array


def stopping_speed(distance: Array | float, acceleration: Array | float, dt: float) -> Array:
    """Largest speed that may be held for one step `dt` and then braked to zero in time.

    The step moves v dt, then the speed falls by a dt each step; the sum must not pass
    `distance`. With D = d/(a dt^2) and m = floor((sqrt(1 + 8 D) - 1)/2) whole braking
    steps, v = a dt (D + m (m + 1)/2)/(m + 1). Exact, where the familiar closed form
    a (-dt/2 + sqrt(dt^2/4 + 2 d/a)) overshoots by up to a dt^2/8.

    Args:
        distance: distance to the limit [m or rad], any shape; below zero counts as zero.
        acceleration: largest deceleration [m/s^2 or rad/s^2], same shape or scalar, > 0.
        dt: control step [s].

    Returns:
        Speeds [m/s or rad/s], shape of `distance`.
    """
    a_dt = np.asarray(acceleration) * dt
    steps = np.maximum(np.asarray(distance, dtype=float), 0.0) / (a_dt * dt)
    whole = np.floor((np.sqrt(1.0 + 8.0 * steps) - 1.0) / 2.0)
    return np.asarray(a_dt * (steps + whole * (whole + 1.0) / 2.0) / (whole + 1.0))
