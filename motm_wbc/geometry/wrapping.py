"""Wrapping of angles, for kernels; a file of its own, as `angles` is used where numba is not."""

from __future__ import annotations

import math

from motm_wbc.geometry.jit import lean


@lean
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi) [rad]."""
    return angle - math.tau * math.floor((angle + math.pi) / math.tau)
