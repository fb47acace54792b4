"""Angles on the circle."""

from __future__ import annotations

import math


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi] [rad]; exact multiples of pi keep their sign."""
    return math.remainder(angle, math.tau)
