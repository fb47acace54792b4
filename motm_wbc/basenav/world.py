"""The world that the base moves in: polygons, and what they look like to a disc."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from shapely.geometry import MultiPolygon

from motm_wbc.basenav.graph import TangentGraph, build_graph
from motm_wbc.basenav.inflation import free_space
from motm_wbc.basenav.obstacle import ObstacleLike, Solid, ring_of, simple_polygons, solids_of
from motm_wbc.basenav.walls import Walls, build_walls
from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array

_KEPT_RADII = 8


class World:
    """Obstacles on a floor; immutable: what moves gives a new world.

    Obstacles are open sets: a path may run along an edge. Between two that touch there is
    no passage.

    Attributes:
        solids: simple polygons, with holes and velocities.
        boundary: (n, 2) outline that the robot must stay in, counter-clockwise, or None.
    """

    def __init__(self, obstacles: Sequence[ObstacleLike], boundary: Array | None = None) -> None:
        """Check and keep the obstacles.

        Args:
            obstacles: arrays (n, 2) [m], any winding, may overlap or be concave; or
                `Obstacle`s with holes and velocity, or `Disc`s.
            boundary: (n, 2) [m] outline of the floor; None: no end to it.

        Raises:
            InputError: a polygon has NaN, fewer than three distinct points or no area, or
                the boundary crosses itself.
        """
        self.solids: tuple[Solid, ...] = tuple(
            solid
            for index, obstacle in enumerate(obstacles)
            for solid in solids_of(obstacle, index, f"obstacles[{index}]")
        )
        self.boundary: Array | None = None
        if boundary is not None:
            parts = simple_polygons(boundary, "boundary")
            if len(parts) != 1:
                raise InputError("crosses itself; a simple polygon is needed", "boundary")
            self.boundary = ring_of(parts[0].exterior, counter_clockwise=True)
        self._inflated: dict[float, Inflated] = {}

    @property
    def obstacles(self) -> tuple[Array, ...]:
        """Outlines of the solids, counter-clockwise, without their holes."""
        return tuple(solid.outline for solid in self.solids)

    @property
    def rings(self) -> tuple[Array, ...]:
        """All rings, the boundary's the last one, with what is blocked on their left."""
        rings = tuple(ring for solid in self.solids for ring in solid.rings)
        return rings if self.boundary is None else (*rings, self.boundary[::-1].copy())

    @property
    def bounded(self) -> bool:
        """Whether there is a boundary: then what is in no ring is blocked."""
        return self.boundary is not None

    def with_solids(self, solids: Iterable[Solid]) -> World:
        """The same floor with other solids, which count as checked."""
        world = object.__new__(World)
        world.solids = tuple(solids)
        world.boundary = self.boundary
        world._inflated = {}
        return world

    def still(self) -> World:
        """The world without what moves."""
        return self.with_solids(solid for solid in self.solids if not solid.moves)

    def after(self, time: float) -> World:
        """The world `time` [s] later, each obstacle having moved with its velocity."""
        if not math.isfinite(time):
            raise InputError(f"must be a finite number, got {time}", "time")
        moved = (np.array([*(time * solid.velocity), 0.0]) for solid in self.solids)
        return self.with_solids(
            solid.transformed(way) if solid.moves else solid
            for solid, way in zip(self.solids, moved, strict=True)
        )

    def transformed(self, transforms: Array) -> World:
        """The world with each obstacle moved rigidly.

        Args:
            transforms: (k, 3) for each obstacle that the world was made of: x, y [m] and
                angle [rad] by which its points are turned about the origin, then shifted.

        Raises:
            InputError: there are not as many transforms as obstacles, or one is not finite.
        """
        ways = np.asarray(transforms, dtype=float)
        count = 1 + max((solid.source for solid in self.solids), default=-1)
        if ways.shape != (count, 3) or not np.isfinite(ways).all():
            raise InputError(f"must be finite numbers of shape ({count}, 3)", "transforms")
        return self.with_solids(solid.transformed(ways[solid.source]) for solid in self.solids)

    def near(self, radius: float, first: Array, second: Array, length: float) -> Inflated:
        """The free space as far as paths between two places are concerned.

        Obstacles that don't meet the ellipse |p - first| + |p - second| <= length may be
        left out: a path of that length can't meet them. A path found here that is not
        longer is the optimum in the whole world; a longer one may not be free there.

        Args:
            radius: of the disc [m].
            first: (2,) [m].
            second: (2,) [m].
            length: [m].
        """
        return self.inflated(radius)

    def inflated(self, radius: float) -> Inflated:
        """The free space of a disc's centre, kept for the next call.

        Args:
            radius: of the disc, >= 0 [m].

        Raises:
            InputError: the radius is negative or not finite.
        """
        if not (math.isfinite(radius) and radius >= 0.0):
            raise InputError(f"must be a finite number >= 0, got {radius}", "inflation")
        if radius not in self._inflated:
            if len(self._inflated) >= _KEPT_RADII:
                self._inflated.pop(next(iter(self._inflated)))
            self._inflated[radius] = Inflated(self, radius)
        return self._inflated[radius]


class Inflated:
    """A world grown by a disc, with what the planner derives from it.

    Attributes:
        radius: of the disc [m].
        region: united polygons: what is free if the world has a boundary, else what is
            blocked.
        walls: the outlines as arrays.
    """

    def __init__(self, world: World, radius: float) -> None:
        self.radius = radius
        region, is_free = free_space(world.solids, world.boundary, radius)
        self.region: MultiPolygon = region
        self.walls: Walls = build_walls(region, is_free)

    @cached_property
    def graph(self) -> TangentGraph:
        """The tangent visibility graph, built when it is first needed."""
        return build_graph(self.walls)
