"""Angles on the circle."""

from __future__ import annotations

import math

from motm_wbc.geometry.jit import lean


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi] [rad]; exact multiples of pi keep their sign."""
    return math.remainder(angle, math.tau)


@lean
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi) [rad], for kernels."""
    return angle - math.tau * math.floor((angle + math.pi) / math.tau)
