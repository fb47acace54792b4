"""Poses in the plane, as arrays (x [m], y [m], heading [rad])."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array

_STRAIGHT = 1e-9  # [rad] turned in a step below which the arc's series is exact


def transform_points(pose: Array, points: Array) -> Array:
    """Points given in the frame of `pose`, in the frame that `pose` is given in.

    Args:
        pose: (3,) x [m], y [m], heading [rad].
        points: (n, 2) or (2,) [m].

    Returns:
        Array of the shape of `points` [m].
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    rotated = points @ np.array([[c, s], [-s, c]])
    return np.asarray(rotated + pose[:2])


def to_local(pose: Array, points: Array) -> Array:
    """Points of the outer frame, in the frame of `pose`; inverse of `transform_points`."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.asarray((points - pose[:2]) @ np.array([[c, -s], [s, c]]))


def compose(first: Array, second: Array) -> Array:
    """The pose `second`, given in the frame of `first`, in the frame of `first`'s parent."""
    x, y = transform_points(first, second[:2])
    return np.array([x, y, wrap(first[2] + second[2])])


def inverse(pose: Array) -> Array:
    """The pose of the parent frame, seen from `pose`."""
    x, y = to_local(pose, np.zeros(2))
    return np.array([x, y, -pose[2]])


def integrate_twist(pose: Array, vx: float, vy: float, omega: float, dt: float) -> Array:
    """The pose after a constant body twist (vx, vy [m/s], omega [rad/s]) for `dt` [s].

    The SE(2) exponential, so the arc is exact (STAA*, arc motion model).
    """
    turn = omega * dt
    if abs(turn) < _STRAIGHT:
        along, across = 1.0, 0.5 * turn
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    dx = dt * (along * vx - across * vy)
    dy = dt * (across * vx + along * vy)
    return compose(pose, np.array([dx, dy, turn]))
