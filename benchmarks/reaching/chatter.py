"""How restless joint velocities are: reversals, and what is left above a frequency."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray

_STILL = 0.02  # [rad/s] a speed below is no direction
_WINDOW = 1.0  # [s] in which reversals are counted
_HIGH = 10.0  # [Hz]


def most_reversals(velocity: Array, dt: float) -> int:
    """Most changes of direction of any one joint in any window of one second.

    A change counts when the joint goes from more than 0.02 rad/s one way to more than that
    the other way. A smooth reach has few; a joint that swings at f Hz has 2 f.

    Args:
        velocity: (t, n) [rad/s].
        dt: [s] between the rows.
    """
    window = round(_WINDOW / dt)
    most = 0
    for joint in velocity.T:
        at = _reversals(joint)
        first = np.searchsorted(at, at - window, side="right")
        most = max(most, int((np.arange(1, len(at) + 1) - first).max(initial=0)))
    return most


def high_share(velocity: Array, dt: float) -> float:
    """Share of the velocities' energy above 10 Hz; zero for joints at rest.

    The spectrum is that of all joints together, under a Hann window that keeps the ends of
    the record from counting as jumps.

    Args:
        velocity: (t, n) [rad/s].
        dt: [s] between the rows.
    """
    if len(velocity) < 2:
        return 0.0
    window = np.hanning(len(velocity))[:, None]
    energy = (np.abs(np.fft.rfft(velocity * window, axis=0)) ** 2).sum(axis=1)
    total = float(energy.sum())
    high = np.fft.rfftfreq(len(velocity), dt) > _HIGH
    return float(energy[high].sum()) / total if total > 0.0 else 0.0


def _reversals(joint: Array) -> IntArray:
    """(r,) rows at which a joint (t,) goes on in the other direction."""
    moving = np.flatnonzero(np.abs(joint) > _STILL)
    turned = np.flatnonzero(np.diff(np.sign(joint[moving])) != 0.0)
    return np.asarray(moving[turned + 1])
