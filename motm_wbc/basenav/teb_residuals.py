"""The band's weighted residuals and their normal equations, as one compiled kernel.

Unknowns are ordered along the band: x, y, heading of pose 0, interval 0, pose 1, interval 1,
..., so that the normal equations are banded: no residual reaches beyond three poses and the
two intervals between them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.teb_obstacles import Parts, place_footprint, separation
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.jit import kernel

BAND = 11
"""Unknowns that one residual can depend on: width of the normal equations' lower band."""

_SPAN = 7  # unknowns of one interval: pose, duration, pose
_LARGEST_HALF = 2.0  # [rad] half a turn that an arc's length is followed up to
_SERIES = 1e-3  # [rad] below which h / sin h is its series


class Terms(NamedTuple):
    """Limits, weights and distances of the residuals.

    Attributes:
        v_max: [m/s].
        v_reverse: positive [m/s].
        omega_max: [rad/s].
        a_max: [m/s^2].
        alpha_max: [rad/s^2].
        time: square roots of the weights, of the duration,
        rolling: of slipping sideways,
        forward: of way in reverse,
        speed: of speed beyond its limits,
        turn: of turn rate,
        acceleration: of acceleration,
        turn_acceleration: of angular acceleration,
        obstacle: of coming nearer than `distance`,
        nearness: of coming nearer than `nearness_distance`.
        distance: to obstacles [m].
        nearness_distance: to obstacles [m].
    """

    v_max: float
    v_reverse: float
    omega_max: float
    a_max: float
    alpha_max: float
    time: float
    rolling: float
    forward: float
    speed: float
    turn: float
    acceleration: float
    turn_acceleration: float
    obstacle: float
    nearness: float
    distance: float
    nearness_distance: float


def terms_of(limits: BaseLimits, parameters: TebParameters) -> Terms:
    """Pack limits and weights for the kernels."""
    p = parameters
    return Terms(
        float(limits.v_max),
        float(limits.v_reverse),
        float(limits.omega_max),
        float(limits.a_max),
        float(limits.alpha_max),
        math.sqrt(p.time_weight),
        math.sqrt(p.rolling_weight),
        math.sqrt(p.forward_weight),
        math.sqrt(p.speed_weight),
        math.sqrt(p.turn_weight),
        math.sqrt(p.acceleration_weight),
        math.sqrt(p.turn_acceleration_weight),
        math.sqrt(p.obstacle_weight),
        math.sqrt(p.nearness_weight),
        p.distance,
        p.nearness_distance,
    )


class Ends(NamedTuple):
    """Velocities at the band's ends.

    Attributes:
        v: speed at the start [m/s].
        omega: turn rate at the start [rad/s].
        stop: the base is at rest at the end; else its velocity there is free.
    """

    v: float
    omega: float
    stop: bool


class Neighbours(NamedTuple):
    """Obstacles near the band's poses (see `near_parts`).

    Attributes:
        footprint: (m, 4) corners and normals in the base frame.
        parts: all obstacles.
        poses: (k,) index of the pose.
        which: (k,) index of the part.
        moved: (k, 2) way of the part until then [m].
    """

    footprint: Array
    parts: Parts
    poses: Indices
    which: Indices
    moved: Array


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
    """h / sin h, arc over chord of an arc that turns by 2 h, and its derivative."""
    if abs(half) < _SERIES:
        return 1.0 + half * half / 6.0, half / 3.0
    if abs(half) > _LARGEST_HALF:
        return _LARGEST_HALF / math.sin(_LARGEST_HALF), 0.0
    s, c = math.sin(half), math.cos(half)
    return half / s, (s - half * c) / (s * s)


@kernel
def velocity(
    first: Array, second: Array, duration: float, dv: Array, dw: Array
) -> tuple[float, float]:
    """Speed and turn rate on the arc between two poses.

    The chord along the mean heading, stretched to the arc, is signed, exact and smooth, so
    that forward, reverse and turning on the spot are one case.

    Args:
        first: (3,) pose.
        second: (3,) pose, heading not wrapped.
        duration: [s].
        dv: (7,) derivatives of the speed by first pose, duration, second pose; is written.
        dw: (7,) those of the turn rate; is written.
    """
    dx, dy = second[0] - first[0], second[1] - first[1]
    half, mean = 0.5 * (second[2] - first[2]), 0.5 * (second[2] + first[2])
    c, s = math.cos(mean), math.sin(mean)
    chord, across = c * dx + s * dy, c * dy - s * dx
    stretch, slope = _stretch(half)
    rate = 1.0 / duration
    v, w = chord * stretch * rate, 2.0 * half * rate
    dv[4], dv[5] = c * stretch * rate, s * stretch * rate
    dv[0], dv[1] = -dv[4], -dv[5]
    dv[2] = 0.5 * rate * (across * stretch - chord * slope)
    dv[6] = 0.5 * rate * (across * stretch + chord * slope)
    dv[3] = -v * rate
    dw[:] = 0.0
    dw[2], dw[3], dw[6] = -rate, -w * rate, rate
    return v, w


@kernel
def _add(normal: Normal, first: int, row: Array, count: int, scale: float, residual: float) -> float:
    """Add a residual whose derivatives by `count` unknowns from `first` on are scale * row."""
    for i in range(count):
        a = scale * row[i]
        if a == 0.0:
            continue
        normal.gradient[first + i] += a * residual
        for j in range(i, count):
            normal.band[first + i, j - i] += a * scale * row[j]
    return residual * residual


@kernel
def _add_excess(
    normal: Normal, first: int, row: Array, count: int, value: float,
    low: float, high: float, scale: float,
) -> float:
    """Add scale * (how far a value lies outside of [low, high])."""
    excess = value - high if value > high else min(value - low, 0.0)
    if excess == 0.0:
        return 0.0
    return _add(normal, first, row, count, scale, scale * excess)


@kernel
def _add_rolling(normal: Normal, first: int, a: Array, b: Array, row: Array, scale: float) -> float:
    """(cos a + cos b) dy - (sin a + sin b) dx: zero if both poses lie on one arc."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    ca, sa, cb, sb = math.cos(a[2]), math.sin(a[2]), math.cos(b[2]), math.sin(b[2])
    row[0], row[1], row[2] = sa + sb, -ca - cb, -sa * dy - ca * dx
    row[3] = 0.0
    row[4], row[5], row[6] = -sa - sb, ca + cb, -sb * dy - cb * dx
    return _add(normal, first, row, _SPAN, scale, scale * ((ca + cb) * dy - (sa + sb) * dx))


@kernel
def _add_change(
    normal: Normal, first: int, before: Array, after: Array, change: float, time: float,
    row: Array, limit: float, scale: float,
) -> float:
    """Acceleration from one interval to the next: change of velocity over the mean duration."""
    rate = 1.0 / time
    row[:] = 0.0
    for i in range(_SPAN):
        row[i] -= before[i] * rate
        row[i + 4] += after[i] * rate
    row[3] -= 0.5 * change * rate * rate
    row[7] -= 0.5 * change * rate * rate
    return _add_excess(normal, first, row, BAND, change * rate, -limit, limit, scale / limit)


@kernel
def _add_end_change(
    normal: Normal, first: int, slope: Array, sign: float, change: float, duration: float,
    row: Array, limit: float, scale: float,
) -> float:
    """The same at an end of the band, where the mean velocity holds at half the interval."""
    rate = 2.0 / duration
    for i in range(_SPAN):
        row[i] = sign * slope[i] * rate
    row[3] -= change * rate / duration
    return _add_excess(normal, first, row, _SPAN, change * rate, -limit, limit, scale / limit)


@kernel
def _add_motion(
    normal: Normal, terms: Terms, ends: Ends, poses: Array, intervals: Array
) -> float:
    """All residuals but those of obstacles."""
    t, count = terms, intervals.shape[0]
    row = np.empty(BAND)
    slopes = np.empty((2, 2, _SPAN))  # of this interval and the one before, v and omega
    v0, w0, cost = ends.v, ends.omega, 0.0
    for i in range(count):
        dv, dw = slopes[i % 2, 0], slopes[i % 2, 1]
        dv0, dw0 = slopes[(i + 1) % 2, 0], slopes[(i + 1) % 2, 1]
        first, duration = 4 * i, intervals[i]
        v, w = velocity(poses[i], poses[i + 1], duration, dv, dw)
        row[0] = 1.0
        cost += _add(normal, first + 3, row, 1, t.time, t.time * duration)
        cost += _add_rolling(normal, first, poses[i], poses[i + 1], row, t.rolling)
        share = t.speed / t.v_max
        cost += _add_excess(normal, first, dv, _SPAN, v, -t.v_reverse, t.v_max, share)
        share = t.turn / t.omega_max
        cost += _add_excess(normal, first, dw, _SPAN, w, -t.omega_max, t.omega_max, share)
        if v < 0.0:
            for k in range(_SPAN):
                row[k] = dv[k] * duration
            row[3] += v
            cost += _add(normal, first, row, _SPAN, t.forward, t.forward * v * duration)
        if i == 0:
            cost += _add_end_change(
                normal, 0, dv, 1.0, v - v0, duration, row, t.a_max, t.acceleration
            )
            cost += _add_end_change(
                normal, 0, dw, 1.0, w - w0, duration, row, t.alpha_max, t.turn_acceleration
            )
        else:
            mean = 0.5 * (intervals[i - 1] + duration)
            cost += _add_change(
                normal, first - 4, dv0, dv, v - v0, mean, row, t.a_max, t.acceleration
            )
            cost += _add_change(
                normal, first - 4, dw0, dw, w - w0, mean, row, t.alpha_max, t.turn_acceleration
            )
        if ends.stop and i == count - 1:
            cost += _add_end_change(
                normal, first, dv, -1.0, -v, duration, row, t.a_max, t.acceleration
            )
            cost += _add_end_change(
                normal, first, dw, -1.0, -w, duration, row, t.alpha_max, t.turn_acceleration
            )
        v0, w0 = v, w
    return cost


@kernel
def _add_obstacles(normal: Normal, terms: Terms, near: Neighbours, poses: Array) -> float:
    """Residuals of obstacles near the band."""
    base = np.empty_like(near.footprint)
    row = np.empty(3)
    beyond = max(terms.distance, terms.nearness_distance)
    placed, cost = -1, 0.0
    for k in range(near.poses.shape[0]):
        i = near.poses[k]
        x, y = poses[i, 0], poses[i, 1]
        if i != placed:
            place_footprint(near.footprint, x, y, poses[i, 2], base)
            placed = i
        away, nx, ny, wx, wy = separation(
            base, near.parts, near.which[k], near.moved[k, 0], near.moved[k, 1], beyond
        )
        if away >= beyond:
            continue
        row[0], row[1], row[2] = nx, ny, ny * (wx - x) - nx * (wy - y)
        cost += _add_excess(
            normal, 4 * i, row, 3, away, terms.distance, math.inf, terms.obstacle
        )
        cost += _add_excess(
            normal, 4 * i, row, 3, away, terms.nearness_distance, math.inf, terms.nearness
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
