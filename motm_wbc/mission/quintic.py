"""Quintic polynomials between two states (MotM's arm trajectory)."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array


def quintic_coefficients(start: Array, end: Array, duration: float) -> Array:
    """(6, d) coefficients, lowest power first, of the quintic between two states.

    Args:
        start: (3, d) position, velocity and acceleration at time 0.
        end: (3, d) the same at `duration`.
        duration: [s], > 0.
    """
    t = duration
    low = np.array([start[0], start[1], 0.5 * start[2]])
    moved = low[0] + low[1] * t + low[2] * t**2
    gap = end[0] - moved
    gap_rate = end[1] - (low[1] + 2.0 * low[2] * t)
    gap_curve = end[2] - 2.0 * low[2]
    high = np.array(
        [
            10.0 * gap / t**3 - 4.0 * gap_rate / t**2 + 0.5 * gap_curve / t,
            -15.0 * gap / t**4 + 7.0 * gap_rate / t**3 - gap_curve / t**2,
            6.0 * gap / t**5 - 3.0 * gap_rate / t**4 + 0.5 * gap_curve / t**3,
        ]
    )
    return np.vstack([low, high])


def quintic_state(coefficients: Array, time: float) -> Array:
    """(3, d) position, velocity and acceleration of the quintic at `time` [s]."""
    powers = time ** np.arange(6)
    position = powers @ coefficients
    order = np.arange(1, 6)
    velocity = (order * powers[:5]) @ coefficients[1:]
    second = np.arange(2, 6)
    acceleration = (second * (second - 1) * powers[:4]) @ coefficients[2:]
    return np.array([position, velocity, acceleration])
