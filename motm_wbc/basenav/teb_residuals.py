"""The band's weighted residuals and their normal equations, as one compiled kernel.

Unknowns are ordered along the band: x, y, heading of pose 0, interval 0, pose 1, interval 1,
..., so that the normal equations are banded: no residual reaches beyond three poses and the
two intervals between them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.teb_obstacles import between, place_footprint, separation
from motm_wbc.basenav.teb_terms import Ends, Neighbours, Terms
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

BAND = 11
"""Unknowns that one residual can depend on: width of the normal equations' lower band."""

BLOCK = 4
"""Unknowns of a pose and the interval that follows it."""

_SPAN = 7  # unknowns of one interval: pose, duration, pose
_LARGEST_HALF = 2.0  # [rad] half a turn that an arc's length is followed up to
_SERIES = 1e-3  # [rad] below which h / sin h is its series


class Normal(NamedTuple):
    """Normal equations J^T J d = -J^T r.

    Attributes:
        band: (u, BAND) lower band of J^T J: [j, k] is the entry of row j + k and column j.
        gradient: (u,) J^T r.
    """

    band: Array
    gradient: Array


@kernel
def _stretch(half: float) -> tuple[float, float]:
    """Ratio h / sin h, arc over chord of an arc that turns by 2 h, and its derivative."""
    if abs(half) < _SERIES:
        return 1.0 + half * half / 6.0, half / 3.0
    if abs(half) > _LARGEST_HALF:
        return _LARGEST_HALF / math.sin(_LARGEST_HALF), 0.0
    s, c = math.sin(half), math.cos(half)
    return half / s, (s - half * c) / (s * s)


@kernel
def way(first: Array, second: Array, slope: Array) -> float:
    """Way driven on the arc between two poses, negative in reverse [m].

    The chord along the mean heading, stretched to the arc, is signed, exact and smooth, so
    that forward, reverse and turning on the spot are one case.

    Args:
        first: (3,) pose.
        second: (3,) pose, heading not wrapped.
        slope: (7,) derivatives by first pose, duration, second pose; is written.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    half, mean = 0.5 * (second[2] - first[2]), 0.5 * (second[2] + first[2])
    c, s = math.cos(mean), math.sin(mean)
    chord, across = c * dx + s * dy, c * dy - s * dx
    stretch, bend = _stretch(half)
    slope[4], slope[5] = c * stretch, s * stretch
    slope[0], slope[1] = -slope[4], -slope[5]
    slope[2] = 0.5 * (across * stretch - chord * bend)
    slope[6] = 0.5 * (across * stretch + chord * bend)
    slope[3] = 0.0
    return float(chord * stretch)


@kernel
def ways(poses: Array) -> Array:
    """(n, 2) way [m] and turn [rad] from each pose of (n + 1, 3) to the next."""
    gone, slope = np.empty((poses.shape[0] - 1, 2)), np.empty(_SPAN)
    for i in range(gone.shape[0]):
        gone[i, 0] = way(poses[i], poses[i + 1], slope)
        gone[i, 1] = poses[i + 1, 2] - poses[i, 2]
    return gone


@kernel
def _add(normal: Normal, first: int, row: Array, count: int, scale: float, value: float) -> float:
    """Add the residual scale * value, a function of `count` unknowns from `first` on.

    `row` are the value's derivatives by them. Returns the residual's square.
    """
    squared = scale * scale
    for i in range(count):
        a = squared * row[i]
        if a == 0.0:
            continue
        normal.gradient[first + i] += a * value
        for j in range(i, count):
            normal.band[first + i, j - i] += a * row[j]
    return squared * value * value


@kernel
def _add_excess(
    normal: Normal, first: int, row: Array, count: int, scale: float, excess: float
) -> float:
    """Add the residual scale * max(0, excess)."""
    return _add(normal, first, row, count, scale, excess) if excess > 0.0 else 0.0


@kernel
def _add_rolling(normal: Normal, first: int, a: Array, b: Array, row: Array, scale: float) -> float:
    """(cos a + cos b) dy - (sin a + sin b) dx: zero if both poses lie on one arc."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    ca, sa, cb, sb = math.cos(a[2]), math.sin(a[2]), math.cos(b[2]), math.sin(b[2])
    row[0], row[1], row[2] = sa + sb, -ca - cb, -sa * dy - ca * dx
    row[3] = 0.0
    row[4], row[5], row[6] = -sa - sb, ca + cb, -sb * dy - cb * dx
    return _add(normal, first, row, _SPAN, scale, (ca + cb) * dy - (sa + sb) * dx)


@kernel
def _add_speed(
    normal: Normal,
    first: int,
    slope: Array,
    gone: float,
    duration: float,
    low: float,
    high: float,
    row: Array,
    scale: float,
) -> float:
    """Way beyond what the speed limits [low, high] allow in the interval."""
    row[:_SPAN] = slope
    row[3] = -high
    cost = _add_excess(normal, first, row, _SPAN, scale, gone - high * duration)
    for i in range(_SPAN):
        row[i] = -slope[i]
    row[3] = low
    return cost + _add_excess(normal, first, row, _SPAN, scale, low * duration - gone)


@kernel
def _add_change(
    normal: Normal,
    first: int,
    slopes: Array,
    gone: Array,
    durations: Array,
    limit: float,
    row: Array,
    scale: float,
) -> float:
    """Change of velocity between two intervals beyond what the acceleration limit allows.

    Mean velocities hold at the intervals' middles: |v_1 - v_0| <= a (T_0 + T_1) / 2. At an end
    of the band, where the velocity itself is given, that interval has no duration.

    Args:
        normal: is added to.
        first: unknown that the first interval begins with.
        slopes: (2, 7) derivatives of the intervals' ways.
        gone: (2,) the ways; of an end without duration, its velocity.
        durations: (2,) [s], 0 at an end.
        limit: acceleration.
        row: is used.
        scale: of the residual.
    """
    # the interval of an end is not among the unknowns: its four come before the band's first
    skipped = 4 if durations[0] == 0.0 else 0
    count = BAND - skipped if durations[1] > 0.0 else _SPAN
    allowed, cost = 0.5 * limit * (durations[0] + durations[1]), 0.0
    for side in range(2):
        row[:] = 0.0
        change = 0.0
        for k in range(2):
            sign = 1.0 if k != side else -1.0
            if durations[k] == 0.0:
                change += sign * gone[k]
                continue
            rate = sign / durations[k]
            change += gone[k] * rate
            for i in range(_SPAN):
                row[4 * k + i] += slopes[k, i] * rate
            row[4 * k + 3] -= gone[k] * rate / durations[k] + 0.5 * limit
        cost += _add_excess(normal, first, row[skipped:], count, scale, change - allowed)
    return cost


@kernel
def _add_changes(
    normal: Normal,
    terms: Terms,
    ends: Ends,
    i: int,
    slopes: Array,
    gone: Array,
    intervals: Array,
    row: Array,
) -> float:
    """Accelerations, linear and angular, up to interval i, and after the last one."""
    count, cost = intervals.shape[0], 0.0
    durations, two, pair = np.zeros(2), np.zeros((2, _SPAN)), np.zeros(2)
    for axis in range(2):
        limit = terms.a_max if axis == 0 else terms.alpha_max
        scale = terms.acceleration if axis == 0 else terms.turn_acceleration
        scale /= limit * terms.interval
        start = ends.v if axis == 0 else ends.omega
        durations[0] = intervals[i - 1] if i > 0 else 0.0
        durations[1] = intervals[i]
        pair[0] = gone[axis, (i + 1) % 2] if i > 0 else start
        pair[1] = gone[axis, i % 2]
        two[0], two[1] = slopes[axis, (i + 1) % 2], slopes[axis, i % 2]
        first = 4 * (i - 1) if i > 0 else 0
        cost += _add_change(normal, first, two, pair, durations, limit, row, scale)
        if ends.stop and i == count - 1:
            two[0], pair[0], durations[0] = two[1], pair[1], durations[1]
            pair[1], durations[1] = 0.0, 0.0
            cost += _add_change(normal, 4 * i, two, pair, durations, limit, row, scale)
    return cost


@kernel
def _add_motion(normal: Normal, terms: Terms, ends: Ends, poses: Array, intervals: Array) -> float:
    """All residuals but those of obstacles."""
    t = terms
    row, cost = np.empty(BAND), 0.0
    slopes, gone = np.zeros((2, 2, _SPAN)), np.zeros((2, 2))  # way and turn; even, odd interval
    speed = t.speed / (t.v_max * t.interval)
    turn = t.turn / (t.omega_max * t.interval)
    for i in range(intervals.shape[0]):
        k, first, duration = i % 2, 4 * i, intervals[i]
        gone[0, k] = way(poses[i], poses[i + 1], slopes[0, k])
        gone[1, k] = poses[i + 1, 2] - poses[i, 2]
        slopes[1, k, 2], slopes[1, k, 6] = -1.0, 1.0
        row[0] = 1.0
        cost += _add(normal, first + 3, row, 1, t.time, duration)
        cost += _add_rolling(normal, first, poses[i], poses[i + 1], row, t.rolling)
        cost += _add_speed(
            normal, first, slopes[0, k], gone[0, k], duration, -t.v_reverse, t.v_max, row, speed
        )
        cost += _add_speed(
            normal, first, slopes[1, k], gone[1, k], duration, -t.omega_max, t.omega_max, row, turn
        )
        for j in range(_SPAN):
            row[j] = -slopes[0, k, j]
        cost += _add_excess(normal, first, row, _SPAN, t.forward, -gone[0, k])
        cost += _add_changes(normal, t, ends, i, slopes, gone, intervals, row)
    return cost


@kernel
def _add_obstacles(normal: Normal, terms: Terms, near: Neighbours, poses: Array) -> float:
    """Residuals of obstacles near the band."""
    base = np.empty_like(near.footprint)
    row = np.zeros(_SPAN)
    beyond = max(terms.distance, terms.nearness_distance)
    placed, cost = -1, 0.0
    x = y = 0.0
    for k in range(near.places.shape[0]):
        half = near.places[k]
        if half != placed:
            x, y, heading = between(poses, half)
            place_footprint(near.footprint, x, y, heading, base)
            placed = half
        away, nx, ny, wx, wy = separation(
            base, near.parts, near.which[k], near.moved[k, 0], near.moved[k, 1], beyond
        )
        if away >= beyond:
            continue
        share, count = (0.5, _SPAN) if half % 2 == 1 else (1.0, 3)  # of each pose's step
        row[0], row[1], row[2] = -share * nx, -share * ny, share * (nx * (wy - y) - ny * (wx - x))
        row[4], row[5], row[6] = row[0], row[1], row[2]
        first = BLOCK * (half // 2)
        cost += _add_excess(normal, first, row, count, terms.obstacle, terms.distance - away)
        cost += _add_excess(
            normal, first, row, count, terms.nearness, terms.nearness_distance - away
        )
    return cost


@kernel
def normal_equations(
    terms: Terms, ends: Ends, near: Neighbours, poses: Array, intervals: Array
) -> tuple[float, Normal]:
    """Linearise the band.

    Args:
        terms: limits and weights.
        ends: velocities at the ends.
        near: obstacles near the poses.
        poses: (n + 1, 3) headings not wrapped.
        intervals: (n,) durations, > 0 [s].

    Returns:
        Sum of the squared residuals; normal equations of all 4 n + 3 unknowns, first and last
        pose included.
    """
    count = 4 * intervals.shape[0] + 3
    normal = Normal(np.zeros((count, BAND)), np.zeros(count))
    cost = _add_motion(normal, terms, ends, poses, intervals)
    return cost + _add_obstacles(normal, terms, near, poses), normal
