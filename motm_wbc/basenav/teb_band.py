"""The elastic band itself: poses and the durations between them; made, resized, gone along."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.jit import kernel

LEAST_INTERVALS = 3
"""Fewer than that can't speed up, drive and slow down."""

_BEGINNING = 1.0  # [s] of the last band in which the base is looked for


class Band(NamedTuple):
    """A timed elastic band.

    Attributes:
        poses: (n + 1, 3) x, y [m], heading [rad], which is not wrapped along the band.
        intervals: (n,) durations between them, > 0 [s].
    """

    poses: Array
    intervals: Array

    @property
    def duration(self) -> float:
        """From the first to the last pose [s]."""
        return float(self.intervals.sum())


def band_along(
    points: Array,
    backward: bool,
    start: Array,
    goal: Array,
    limits: BaseLimits,
    interval: float,
    horizon: float,
) -> tuple[Band, bool]:
    """The band that turns on the spot towards each point of a path and drives there.

    Args:
        points: (k, 2) polyline from start to goal [m].
        backward: it is driven in reverse.
        start: (3,) first pose.
        goal: (3,) last pose; its heading may come out with whole turns added.
        limits: speeds of the base.
        interval: largest duration between poses [s].
        horizon: duration after which it ends all the same [s].

    Returns:
        The band; whether it leads to the goal.
    """
    speed = limits.v_reverse if backward else limits.v_max
    stations = [(start, 0.0)]  # poses and the time from the one before
    heading = float(start[2])
    for begin, end in itertools.pairwise(points):
        dx, dy = end - begin
        course = math.atan2(dy, dx) + (math.pi if backward else 0.0)
        turn = wrap(course - heading)
        heading += turn
        stations.append((np.array([*begin, heading]), abs(turn) / limits.omega_max))
        stations.append((np.array([*end, heading]), math.hypot(dx, dy) / speed))
    turn = wrap(goal[2] - heading)
    stations.append((np.array([*goal[:2], heading + turn]), abs(turn) / limits.omega_max))
    return _discretised(stations, interval, horizon)


def _discretised(
    stations: list[tuple[Array, float]], interval: float, horizon: float
) -> tuple[Band, bool]:
    """Equal parts between poses that follow each other after given times [s]."""
    poses, durations, left = [stations[0][0][None]], [np.zeros(0)], horizon
    for (before, _), (after, time) in itertools.pairwise(stations):
        if left <= 0.0:
            break
        share = min(1.0, left / time) if time > 0.0 else 1.0
        count = math.ceil(share * time / interval)
        shares = share * (np.arange(count) + 1.0)[:, None] / max(count, 1)
        poses.append(before + shares * (after - before))
        durations.append(np.full(count, share * time / max(count, 1)))
        left -= time
    band = Band(np.vstack(poses), np.concatenate(durations))
    if len(band.intervals) == 0:
        band = Band(np.vstack([stations[0][0], stations[-1][0]]), np.array([interval]))
    while len(band.intervals) < LEAST_INTERVALS:
        band = resized(band.poses, band.intervals, 0.0, 0.0, 2 * LEAST_INTERVALS)
    return band, left >= 0.0


def joined(band: Band, tail: Band) -> Band:
    """A band followed by another that begins where it ends."""
    turns = band.poses[-1] - tail.poses[0]
    turns[:2] = 0.0
    return Band(
        np.vstack([band.poses, tail.poses[1:] + turns]),
        np.concatenate([band.intervals, tail.intervals]),
    )


def with_goal(band: Band, goal: Array) -> Band:
    """The band with another last pose (3,)."""
    poses = band.poses.copy()
    poses[-1, :2] = goal[:2]
    poses[-1, 2] += wrap(goal[2] - poses[-1, 2])
    return Band(poses, band.intervals)


@kernel
def resized(poses: Array, intervals: Array, least: float, largest: float, most: int) -> Band:
    """Split intervals longer than `largest` [s] in two, join those shorter than `least`.

    At least `LEAST_INTERVALS` and at most `most` intervals are left by that.
    """
    count = intervals.shape[0]
    new_poses = np.empty((2 * count + 1, 3))
    new_intervals = np.empty(2 * count)
    new_poses[0] = poses[0]
    size, left = 0, count
    carried = 0.0
    for i in range(count):
        duration = carried + intervals[i]
        carried = 0.0
        if duration < least and left > LEAST_INTERVALS:
            left -= 1
            if i + 1 < count:
                carried = duration
                continue
            new_intervals[size - 1] += duration  # the last one is joined with the one before
            new_poses[size] = poses[i + 1]
            continue
        if duration > largest and left < most:
            left += 1
            duration *= 0.5
            for k in range(3):
                new_poses[size + 1, k] = 0.5 * (new_poses[size, k] + poses[i + 1, k])
            new_intervals[size] = duration
            size += 1
        new_poses[size + 1] = poses[i + 1]
        new_intervals[size] = duration
        size += 1
    return Band(new_poses[: size + 1].copy(), new_intervals[:size].copy())


@kernel
def gone_along(poses: Array, intervals: Array, pose: Array, radius: float) -> tuple[Band, float]:
    """The band from the place on it that is nearest to where the base is now.

    Args:
        poses: (n + 1, 3) of the band.
        intervals: (n,) durations [s].
        pose: (3,) of the base.
        radius: what a turn by 1 rad counts as [m].

    Returns:
        The band, which begins at the base's pose; distance of that from the last one [m].
    """
    best, at, share, time = math.inf, 0, 0.0, 0.0
    shift = math.tau * math.floor((poses[0, 2] - pose[2]) / math.tau + 0.5)
    gx, gy, heading = pose[0], pose[1], pose[2] + shift
    for i in range(intervals.shape[0]):
        if time > _BEGINNING:
            break
        time += intervals[i]
        ux, uy = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        ut = radius * (poses[i + 1, 2] - poses[i, 2])
        rx, ry, rt = gx - poses[i, 0], gy - poses[i, 1], radius * (heading - poses[i, 2])
        square = ux * ux + uy * uy + ut * ut
        along = 0.0
        if square > 0.0:
            along = min(max((rx * ux + ry * uy + rt * ut) / square, 0.0), 1.0)
        dx, dy, dt = rx - along * ux, ry - along * uy, rt - along * ut
        away = dx * dx + dy * dy + dt * dt
        if away < best:
            best, at, share = away, i, along
    if share == 1.0 and at + 1 < intervals.shape[0]:
        at, share = at + 1, 0.0
    new_poses, new_intervals = poses[at:].copy(), intervals[at:].copy()
    new_poses[0, 0], new_poses[0, 1], new_poses[0, 2] = gx, gy, heading
    new_intervals[0] *= max(1.0 - share, 0.1)
    return Band(new_poses, new_intervals), math.sqrt(best)
