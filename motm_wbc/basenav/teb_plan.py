"""What the Timed Elastic Band answers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.staa_admissible import executed
from motm_wbc.basenav.staa_motion import Drive, stopping_duration, stopping_span
from motm_wbc.basenav.staa_root import with_direction
from motm_wbc.basenav.teb_band import Band
from motm_wbc.basenav.teb_residuals import ways
from motm_wbc.basenav.teb_safety import State
from motm_wbc.geometry import se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array

_ARC_SPACING = 0.03  # [m] between reported poses of a braking arc


@dataclass(frozen=True)
class TebPlan:
    """The answer of the Timed Elastic Band, a `LocalPlan`.

    Attributes:
        acceleration: a [m/s^2] and alpha [rad/s^2], to be applied over the next command
            period.
        poses: (k, 4) time from now [s], x [m], y [m], heading [rad] along the band.
        velocities: (k, 2) v [m/s], omega [rad/s] at these poses.
        braking: (b, 3) the braking arc from the state that the command leads to.
        reached: the band leads to the goal without a collision, its last pose is there.
        emergency: nothing but braking (or standing still) was possible.
        restarted: the band was made anew from the global path.
    """

    acceleration: tuple[float, float]
    poses: Array
    velocities: Array
    braking: Array
    reached: bool
    emergency: bool = False
    restarted: bool = False


def band_states(band: Band, state: State) -> Array:
    """(n + 1, 6) time, pose and velocity at the poses of a band; at its end that before it."""
    velocities = ways(band.poses) / band.intervals[:, None]
    at_poses = np.vstack([[state.v, state.omega], velocities])
    shares = band.intervals[:-1] / (band.intervals[:-1] + band.intervals[1:])
    at_poses[1:-1] += shares[:, None] * (velocities[1:] - velocities[:-1])
    times = np.concatenate([[0.0], np.cumsum(band.intervals)])
    headings = np.array([wrap(heading) for heading in band.poses[:, 2]])
    return np.column_stack([times, band.poses[:, :2], headings, at_poses])


def braking_states(
    drive: Drive, radius: float, state: State, command: tuple[float, float]
) -> Array:
    """(k, 6) time, pose and velocity while the base brakes to rest after a command."""
    (a, alpha), period = command, drive.period
    begin = with_direction(state.pose)
    x, y, c, s = executed(drive, begin, state.v, state.omega, a, alpha)
    pose = np.array([x, y, math.atan2(s, c)])
    v, omega = state.v + a * period, state.omega + alpha * period
    duration, span = stopping_duration(drive, v, omega), stopping_span(drive, v, omega)
    way = max(abs(v), abs(omega) * radius) * span
    shares = np.linspace(0.0, 1.0, max(1, math.ceil(way / _ARC_SPACING)) + 1)
    states = []
    for share in shares if duration > 0.0 else shares[:1]:
        left = math.sqrt(1.0 - share)  # of the velocity; the way that is left falls as its square
        reached = se2.integrate_twist(pose, v, 0.0, omega, share * span)
        states.append([period + (1.0 - left) * duration, *reached, left * v, left * omega])
    return np.array(states)


def pose_at_rest(drive: Drive, state: State) -> Array:
    """(3,) where the base comes to rest if it brakes now."""
    span = stopping_span(drive, state.v, state.omega)
    return se2.integrate_twist(state.pose, state.v, 0.0, state.omega, span)
