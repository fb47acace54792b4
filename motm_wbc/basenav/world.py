"""The world that the base moves in: polygons, and what they look like to a disc."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from motm_wbc.basenav.graph import TangentGraph, build_graph
from motm_wbc.basenav.inflation import free_space
from motm_wbc.basenav.walls import Walls, build_walls
from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array

_LEAST_AREA = 1e-9  # [m^2]
_KEPT_RADII = 8


class World:
    """Polygonal obstacles on a floor; immutable.

    Obstacles are open sets: a path may run along an edge. Between two that touch there is
    no passage.

    Attributes:
        obstacles: simple polygons (n, 2) [m], counter-clockwise. A polygon that crosses
            itself counts with all that it encloses and may become several.
        boundary: (n, 2) outline that the robot must stay in, counter-clockwise, or None.
    """

    def __init__(self, obstacles: Sequence[Array], boundary: Array | None = None) -> None:
        """Check and keep the polygons.

        Args:
            obstacles: arrays (n, 2) [m], any winding, may overlap or be concave.
            boundary: (n, 2) [m] outline of the floor; None: no end to it.

        Raises:
            InputError: a polygon has NaN, fewer than three distinct points or no area, or
                the boundary crosses itself.
        """
        self.obstacles: tuple[Array, ...] = tuple(
            part
            for index, points in enumerate(obstacles)
            for part in _simple_parts(points, f"obstacles[{index}]")
        )
        self.boundary: Array | None = None
        if boundary is not None:
            parts = _simple_parts(boundary, "boundary")
            if len(parts) != 1:
                raise InputError("crosses itself; a simple polygon is needed", "boundary")
            self.boundary = parts[0]
        self._inflated: dict[float, Inflated] = {}

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
        region, is_free = free_space(world.obstacles, world.boundary, radius)
        self.region: MultiPolygon = region
        self.walls: Walls = build_walls(region, is_free)

    @cached_property
    def graph(self) -> TangentGraph:
        """The tangent visibility graph, built when it is first needed."""
        return build_graph(self.walls)


def _simple_parts(points: Array, where: str) -> list[Array]:
    """Counter-clockwise simple polygons that a polygon of the user's consists of."""
    try:
        outline = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise InputError("must be numbers, an array of shape (n, 2)", where) from None
    if outline.ndim != 2 or outline.shape[1] != 2:
        raise InputError(f"must have shape (n, 2), got {outline.shape}", where)
    if not np.isfinite(outline).all():
        raise InputError("has a coordinate that is NaN or infinite", where)
    if len(np.unique(outline, axis=0)) < 3:
        raise InputError("has fewer than three distinct points", where)
    shape = shapely.make_valid(Polygon(outline), method="structure", keep_collapsed=False)
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    solid = [part for part in parts if part.area >= _LEAST_AREA]
    if not solid:
        raise InputError(f"has no area (less than {_LEAST_AREA:g} m^2)", where)
    return [_frozen(part) for part in solid]


def _frozen(polygon: Polygon) -> Array:
    """The outline as an array that can't be written to, counter-clockwise."""
    turned = shapely.geometry.polygon.orient(Polygon(polygon.exterior), 1.0)
    ring = np.array(turned.exterior.coords)[:-1]
    distinct = np.any(ring != np.roll(ring, 1, axis=0), axis=1)
    ring = ring[distinct]
    ring.flags.writeable = False
    return ring
