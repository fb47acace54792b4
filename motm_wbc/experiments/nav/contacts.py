"""Contact and clearance of a footprint that drives, by shapely, independent of the planners."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import Point, Polygon

from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

OVERLAP = 1e-6  # [m] that the footprint may be inside of what it touches
_BEYOND = 1e3  # [m] of what lies outside of the boundary that counts as blocked


class ContactAudit:
    """Watches the footprint at every control step.

    A distance is taken only where it could be the smallest so far: between two looks it
    can't shrink by more than what moves has moved. So the smallest one is exact.

    Attributes:
        least: smallest distance so far [m]; infinite if there is nothing to touch.
    """

    def __init__(self, world: World, footprint: Array) -> None:
        """Take the world as it is at time 0, and the convex footprint (n, 2) [m]."""
        self._footprint = footprint
        inner = Polygon(footprint).buffer(-OVERLAP, join_style="mitre")
        self._inner = np.array(inner.exterior.coords)[:-1]
        self._radius = float(np.hypot(*footprint.T).max())
        still = [Polygon(s.outline, s.holes) for s in world.solids if not s.moves]
        if world.boundary is not None:
            floor = Polygon(world.boundary)
            still.append(shapely.box(*floor.buffer(_BEYOND).bounds).difference(floor))
        moving = [([Polygon(s.outline, s.holes)], s.velocity) for s in world.solids if s.moves]
        self._groups = [_Group(shapes, velocity) for shapes, velocity in moving]
        if still:
            self._groups.append(_Group(still, np.zeros(2)))
        self.least = math.inf

    def look(self, time: float, pose: Array, v: float, omega: float, dt: float) -> bool:
        """Look once.

        Args:
            time: [s].
            pose: (3,) of the base.
            v: speed since the last look [m/s].
            omega: turn rate since then [rad/s].
            dt: time since then [s].

        Returns:
            Whether the footprint overlaps something by more than `OVERLAP`.
        """
        moved = (abs(v) + self._radius * abs(omega)) * dt
        hit = False
        for group in self._groups:
            group.left -= moved + group.speed * dt
            if 0.0 < group.left >= self.least:
                continue
            shift = np.array([*(time * group.velocity), 0.0])
            outline, inner = (
                Polygon(polygons.place(points, pose - shift))
                for points in (self._footprint, self._inner)
            )
            group.left = group.distance(outline)
            self.least = min(self.least, group.left)
            hit |= group.left == 0.0 and group.overlaps(inner)
        return hit


class _Group:
    """Shapes that move together."""

    def __init__(self, shapes: Sequence[Polygon], velocity: Array) -> None:
        self.velocity = velocity
        self.speed = float(np.hypot(*velocity))
        self.left = 0.0  # what the distance is at least [m]
        self._shapes = shapely.STRtree(shapes)
        self._edges = shapely.STRtree(_edges(shapes))

    def distance(self, shape: Polygon) -> float:
        """From a polygon to the shapes [m]."""
        if len(self._shapes.query(Point(shape.exterior.coords[0]), predicate="intersects")):
            return 0.0
        _, distances = self._edges.query_nearest(shape, all_matches=False, return_distance=True)
        return float(distances[0])

    def overlaps(self, shape: Polygon) -> bool:
        """Whether a polygon has a point in common with the shapes."""
        return bool(len(self._shapes.query(shape, predicate="intersects")))


def _edges(shapes: Sequence[Polygon]) -> Array:
    """The edges of all rings, each a line: a tree of them is fast, whatever the shapes are."""
    lines = []
    for ring in shapely.get_rings(shapely.get_parts(shapes)):
        points = shapely.get_coordinates(ring)
        lines.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.asarray(shapely.linestrings(np.concatenate(lines)))
