"""The world about a place, for checks of the true footprint: edges that lie near, filed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Point, Polygon

from motm_wbc.basenav.footprint_check import EdgeMap, edge_map
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array

_KEPT = 8


@dataclass(frozen=True)
class _Patch:
    """Edges about a centre (2,), good for poses within `room` [m] of it along x and y."""

    centre: Array
    room: float
    rings: tuple[Array, ...]
    edges: EdgeMap


class EdgePatches:
    """Edge maps of what lies near; what did not change about a place is kept."""

    def __init__(self, world: World, reach: float) -> None:
        """Look at a world.

        Args:
            world: obstacles, not inflated.
            reach: largest distance from a base's origin to a point of its outline [m].
        """
        self._reach = reach
        self._patches: list[_Patch] = []
        self._look_at(world)

    def update(self, world: World) -> None:
        """The world has changed."""
        self._look_at(world)
        self._patches = [
            patch
            for patch in self._patches
            if _same(patch.rings, self._rings_near(patch.centre, patch.room))
        ]

    def about(self, place: Array, room: float) -> EdgeMap:
        """The world's edges, for poses within `room` [m] of a place (2,) along x and y."""
        for patch in self._patches:
            if np.abs(place[:2] - patch.centre).max() + room <= patch.room:
                return patch.edges
        centre = np.array(place[:2], dtype=float)
        rings = self._rings_near(centre, room)
        bounded = self._rim is not None and len(rings) > 0 and rings[-1] is self._rim
        patch = _Patch(centre, room, rings, edge_map(rings, bounded, self._reach))
        self._patches = [patch, *self._patches[: _KEPT - 1]]
        return patch.edges

    def _look_at(self, world: World) -> None:
        self._outlines = world.outlines
        self._floor = None if world.boundary is None else Polygon(world.boundary)
        self._rim = None if world.boundary is None else world.boundary[::-1].copy()

    def _rings_near(self, centre: Array, room: float) -> tuple[Array, ...]:
        """What lies near a place; the floor's rim, if it does, is the last one."""
        low, high = centre - room - self._reach, centre + room + self._reach
        points, ring_start, first_ring, box = self._outlines
        near = np.logical_and.reduce(np.hstack([box[:, :2] <= high, box[:, 2:] >= low]), axis=1)
        rings = tuple(
            points[ring_start[ring] : ring_start[ring + 1]]
            for solid in np.flatnonzero(near)
            for ring in range(first_ring[solid], first_ring[solid + 1])
        )
        if self._floor is None or self._rim is None or _is_far_inside(self._floor, low, high):
            return rings
        return (*rings, self._rim)


def _is_far_inside(boundary: Polygon, low: Array, high: Array) -> bool:
    """Whether a box lies inside of a boundary, which then does not matter to it."""
    middle, half = Point(0.5 * (low + high)), 0.5 * float(np.hypot(*(high - low)))
    return bool(boundary.contains(middle) and boundary.exterior.distance(middle) > half)


def _same(first: Sequence[Array], second: Sequence[Array]) -> bool:
    return len(first) == len(second) and all(map(np.array_equal, first, second))
