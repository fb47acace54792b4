"""Random obstacles about the origin, as arrays (n, 2) [m]."""

from __future__ import annotations

import math

import numpy as np
import shapely

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

_WALL = 0.1  # [m]


def convex(rng: np.random.Generator) -> Array:
    """The hull of 5 to 9 points in a disc of 0.1 to 0.6 m."""
    count = int(rng.integers(5, 10))
    angles = (np.arange(count) + rng.uniform(0.0, 0.9, count)) * math.tau / count
    radii = rng.uniform(0.1, 0.6) * np.sqrt(rng.uniform(0.2, 1.0, count))
    points = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    hull = shapely.convex_hull(shapely.multipoints(points))
    return np.array(hull.exterior.coords)[:-1]


def star(rng: np.random.Generator) -> Array:
    """A star-shaped polygon, mostly concave, of 0.2 to 0.8 m."""
    count = int(rng.integers(6, 13))
    angles = (np.arange(count) + rng.uniform(0.0, 0.8, count)) * math.tau / count
    radii = rng.uniform(0.2, 0.8) * rng.uniform(0.35, 1.0, count)
    return np.asarray(radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def bracket(rng: np.random.Generator) -> Array:
    """An L with arms of 0.4 to 1.4 m."""
    a, b = rng.uniform(0.4, 1.4, 2)
    thick = rng.uniform(0.08, 0.3)
    points = [(0, 0), (a, 0), (a, thick), (thick, thick), (thick, b), (0, b)]
    return np.array(points) - [0.3 * a, 0.3 * b]


def table(rng: np.random.Generator) -> Array:
    """A rectangle of 0.6 to 1.8 by 0.4 to 0.9 m."""
    return polygons.rectangle(rng.uniform(0.6, 1.8), rng.uniform(0.4, 0.9))


def trap(depth: float, width: float) -> Array:
    """A U about an inner rectangle [m] that begins at the origin and is open towards +x."""
    x, y, t = depth, 0.5 * width, _WALL
    return np.array(
        [(x, y), (x, y + t), (-t, y + t), (-t, -y - t), (x, -y - t), (x, -y), (0, -y), (0, y)]
    )


def wall(start: Array, end: Array) -> Array:
    """A thin rectangle from point to point."""
    way = end - start
    across = 0.5 * _WALL * np.array([-way[1], way[0]]) / math.hypot(*way)
    return np.array([start + across, start - across, end - across, end + across])
