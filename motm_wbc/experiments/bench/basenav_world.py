"""Random worlds for the benchmarks of base navigation, all with one task in their middle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.polygons import disc, rectangle

FOOTPRINT = rectangle(0.68, 0.47)
LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
AREA = 3.5
"""Floor for each obstacle [m^2]."""

_APART = 4.0  # [m] from the robot to the object, and on to the next target
_TABLE = 0.2  # [m] radius of what each of the two stands on
_FREE_ABOUT = {"target": 1.3, "robot": 0.8}  # [m] no centre of an obstacle is nearer
_LEAST_SIDE = math.sqrt(20.0 * AREA)  # [m] the robot's way must lie on the floor
_WIDEST_GAP = 0.95 * math.pi  # between the corners of an obstacle, seen from its middle [rad]


@dataclass(frozen=True)
class NavScene:
    """A world with a task of base placement.

    Attributes:
        obstacles: outlines (n, 2) [m]; the first one is under the object.
        start: (3,) the robot, heading for the object.
        target: (2,) the object [m].
        after: (2,) the next target [m].
    """

    obstacles: tuple[Array, ...]
    start: Array
    target: Array
    after: Array


def random_scene(count: int, seed: int, area: float = AREA) -> NavScene:
    """Convex obstacles of 3 to 8 corners, 0.2 to 0.8 m across, strewn over a square floor.

    With one obstacle there is the table under the object only; with two, one under the next
    target, too. Fewer than 20 lie on the floor of 20.

    Args:
        count: of obstacles.
        seed: of the scene.
        area: of the floor for each obstacle [m^2].
    """
    rng = np.random.default_rng(seed)
    coming, turn = rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
    start = np.array([-_APART * math.cos(coming), -_APART * math.sin(coming), coming])
    after = _APART * np.array([math.cos(coming + turn), math.sin(coming + turn)])
    half = 0.5 * max(math.sqrt(count * area), _LEAST_SIDE)
    obstacles = [disc(_TABLE, 32), disc(_TABLE, 32) + after][:count]
    kept_free = [
        (np.zeros(2), _FREE_ABOUT["target"]),
        (after, _FREE_ABOUT["target"]),
        (start[:2], _FREE_ABOUT["robot"]),
    ]
    while len(obstacles) < count:
        centre = rng.uniform(-half, half, 2)
        if all(math.dist(centre, place) >= room for place, room in kept_free):
            obstacles.append(centre + _convex(rng))
    return NavScene(tuple(obstacles), start, np.zeros(2), after)


def _convex(rng: np.random.Generator) -> Array:
    """(n, 2) corners on a circle about the origin, which lies inside."""
    corners, radius = int(rng.integers(3, 9)), 0.5 * rng.uniform(0.2, 0.8)
    while True:
        angles = np.sort(rng.uniform(0.0, math.tau, corners))
        if np.diff(np.append(angles, angles[0] + math.tau)).max() < _WIDEST_GAP:
            return np.asarray(radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def along(points: Array, steps: int) -> Array:
    """(steps, 3) poses evenly along a polyline (k, 2), up to 0.1 of its length before its end."""
    ways = np.diff(points, axis=0)
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, 0.9 * ends[-1], steps)
    segment = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(ways) - 1)
    x, y = (np.interp(at, ends, points[:, axis]) for axis in range(2))
    return np.column_stack([x, y, np.arctan2(ways[segment, 1], ways[segment, 0])])


def small_moves(obstacles: tuple[Array, ...], rng: np.random.Generator) -> Array:
    """(n, 3) for `World.transformed`: each turned by a few degrees and shifted by centimetres."""
    turns = rng.normal(0.0, 0.05, len(obstacles))
    shifts = rng.normal(0.0, 0.02, (len(obstacles), 2))
    centres = np.array([points.mean(axis=0) for points in obstacles])
    c, s = np.cos(turns), np.sin(turns)
    turned = np.column_stack(
        [c * centres[:, 0] - s * centres[:, 1], s * centres[:, 0] + c * centres[:, 1]]
    )
    return np.column_stack([centres - turned + shifts, turns])
