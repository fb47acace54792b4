"""The free space of a disc's centre: a world, or a part of it, as the planner sees it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import shapely
from shapely.geometry import MultiPolygon

from motm_wbc.basenav.graph import TangentGraph, build_graph
from motm_wbc.basenav.outlines import Ellipse, ellipse_of
from motm_wbc.basenav.walls import Walls, build_walls
from motm_wbc.geometry.arrays import Array, BoolArray


class Inflated:
    """A world grown by a disc, with what the planner derives from it.

    Attributes:
        radius: of the disc [m].
        ellipse: where it is the world's; None: everywhere.
        members: (s,) which of the world's solids are in it.
        walls: the outlines as arrays.
    """

    def __init__(
        self,
        radius: float,
        parts: Sequence[shapely.Polygon],
        is_free: bool,
        members: BoolArray,
        ellipse: Ellipse | None = None,
    ) -> None:
        """Lay the outlines out for the kernels.

        Args:
            radius: of the disc [m].
            parts: united polygons: what is free, or what is blocked.
            is_free: they are what is free.
            members: (s,) which of the world's solids are in it.
            ellipse: where it is the world's; None: everywhere.
        """
        self.radius = radius
        self.ellipse = ellipse
        self.members = members
        self._parts = parts
        self.walls: Walls = build_walls(parts, is_free)

    @cached_property
    def region(self) -> MultiPolygon:
        """What is free if this is all of a world with a boundary, else what is blocked."""
        return MultiPolygon(self._parts)

    @cached_property
    def graph(self) -> TangentGraph:
        """The tangent visibility graph, built when it is first needed."""
        return build_graph(self.walls)

    def covers(self, first: Array, second: Array, length: float) -> bool:
        """Whether it serves paths of a length [m] between two places (2,), see `World.near`."""
        wanted = ellipse_of(first, second, length)
        return self.ellipse is None or self.ellipse.contains(wanted)
