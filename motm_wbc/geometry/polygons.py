"""Polygons in the plane as arrays (n, 2) [m], counter-clockwise, first point not repeated."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array


def rectangle(length: float, width: float) -> Array:
    """Rectangle centred on the origin, `length` along x, `width` along y [m]."""
    x, y = 0.5 * length, 0.5 * width
    return np.array([[x, y], [-x, y], [-x, -y], [x, -y]])


def disc(radius: float, sides: int = 24) -> Array:
    """Regular polygon that contains the disc about the origin: its sides touch the circle."""
    angles = (np.arange(sides) + 0.5) * math.tau / sides
    outer = radius / math.cos(math.pi / sides)
    return outer * np.column_stack([np.cos(angles), np.sin(angles)])


def place(polygon: Array, pose: Array) -> Array:
    """The polygon, given in the frame of `pose` (3,), in the outer frame."""
    return se2.transform_points(pose, polygon)


def signed_area(polygon: Array) -> float:
    """Area [m^2], positive for counter-clockwise order."""
    following = np.roll(polygon, -1, axis=0)
    cross = polygon[:, 0] * following[:, 1] - following[:, 0] * polygon[:, 1]
    return 0.5 * float(cross.sum())


def counter_clockwise(polygon: Array) -> Array:
    """The same polygon in counter-clockwise order."""
    return polygon if signed_area(polygon) >= 0.0 else polygon[::-1].copy()
