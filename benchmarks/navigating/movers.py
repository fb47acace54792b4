"""Random obstacles that cross a floor at constant velocity."""

from __future__ import annotations

import math

import numpy as np
import shapely

from benchmarks.navigating.shapes import convex
from motm_wbc.basenav import Disc, Obstacle, World
from motm_wbc.basenav.obstacle import ObstacleLike
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

FASTEST = 0.5  # [m/s]
_SLOWEST = 0.1
_SIZES = (0.2, 0.6)  # [m] across
_NEAREST_START = 1.5  # [m] between the obstacle's centre and the robot's at the start
_DRAWS = 5000
_SPREAD = 3.0  # [s] by which an obstacle may miss the robot that it is aimed at


def with_movers(world: World, seed: int, count: int, points: Array, duration: float) -> World:
    """A world with obstacles that move straight ahead, where nothing stands in their way.

    One half of them comes past a random place at a random time, the others past a place on
    the robot's way at about the time when it would be there on its own. None starts within
    `_NEAREST_START` of the robot. They leave the floor in the end, and most come from beyond.

    Args:
        world: at rest, with a boundary.
        seed: of the obstacles.
        count: how many; fewer if there is no room for so many.
        points: (k, 2) of the way that the robot would take [m].
        duration: that this would take [s].
    """
    rng = np.random.default_rng([seed, 73])
    size = np.max(np.asarray(world.boundary), axis=0)
    floor = shapely.box(0.0, 0.0, *size)
    solid = shapely.union_all([shapely.Polygon(s.outline, s.holes) for s in world.solids])
    shapely.prepare(solid)
    still: list[ObstacleLike] = [Obstacle(s.outline, s.holes) for s in world.solids]
    movers: list[ObstacleLike] = []
    for _ in range(_DRAWS):
        share = rng.random()
        place, when = rng.uniform(0.0, 1.0, 2) * size, share * duration
        if len(movers) % 2:
            place = _along(points, share)
            when = max(0.0, when + rng.uniform(-_SPREAD, _SPREAD))
        direction = rng.uniform(0.0, math.tau)
        velocity = rng.uniform(_SLOWEST, FASTEST) * np.array(
            [math.cos(direction), math.sin(direction)]
        )
        begin = place - when * velocity
        radius = 0.5 * rng.uniform(*_SIZES)
        away = begin + 3.0 * float(size.sum()) * velocity / math.hypot(*velocity)
        way = shapely.intersection(shapely.LineString([begin, away]).buffer(radius), floor)
        near = math.dist(begin, points[0]) < _NEAREST_START
        if near or solid.intersects(way):
            continue
        movers.append(_mover(rng, begin, radius, velocity))
        if len(movers) == count:
            break
    return World([*still, *movers], world.boundary)


def _mover(rng: np.random.Generator, centre: Array, radius: float, velocity: Array) -> ObstacleLike:
    """A disc, or a convex polygon within it."""
    if rng.random() < 0.5:
        return Disc(centre, radius, velocity)
    outline = convex(rng)
    outline *= radius / float(np.hypot(*outline.T).max())
    pose = np.array([*centre, rng.uniform(0.0, math.tau)])
    return Obstacle(polygons.place(outline, pose), (), velocity)


def _along(points: Array, share: float) -> Array:
    """The point after a share of a polyline's length."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    passed = np.concatenate([[0.0], np.cumsum(steps)])
    at = share * passed[-1]
    return np.array([np.interp(at, passed, points[:, k]) for k in range(2)])
