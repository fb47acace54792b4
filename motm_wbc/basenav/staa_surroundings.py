"""What the local planner knows of the world, kept from step to step as long as it holds."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.cost_tiles import CostTiles, cost_tiles
from motm_wbc.basenav.footprint_check import EdgeMap, Outline, edge_map, grown_corners
from motm_wbc.basenav.goal_field import GoalField
from motm_wbc.basenav.movers import Movers, movers_of
from motm_wbc.basenav.obstacle import Solid
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.proximity import ProximityGrid, proximity_grid, rings_of
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.visibility import line_of_sight
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array

_STEP = 2.0  # [m] by which the squares about the base are moved
_CELL = 1.0  # [m] within which a base that moves is given the same cost-to-go
_ASIDE = 0.8  # [m] off the base's way that the cost-to-go is exact at least


class Surroundings:
    """The world in the forms that the search reads.

    What rests decides the way: it is in the edge map, in the grid and in the cost-to-go. What
    moves has gone from where it is by the time that the base is there, so it is left out of
    these and predicted instead.

    Attributes:
        world: all obstacles, as seen last.
        planner: of the world without what moves.
        edges: what rests.
        movers: what moves.
    """

    def __init__(
        self, world: World, outline: Outline, parameters: StaaParameters, planner: GlobalPlanner
    ) -> None:
        """Take a planner of the world; it is given what rests, if something in it moves."""
        self._outline = outline
        self._parameters = parameters
        corners = grown_corners(outline, parameters.margin)
        self._reach = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        self.world = world
        self.planner = planner
        self.movers: Movers = movers_of(world.solids)
        self._see_rest(world.still(), plan_anew=any(solid.moves for solid in world.solids))

    def update(self, world: World) -> None:
        """Take the world as it is seen now; what rests and has not changed is kept."""
        still = world.still()
        self.world = world
        self.movers = movers_of(world.solids)
        if not _same(still, self._still):
            self._see_rest(still, plan_anew=True)

    def _see_rest(self, still: World, plan_anew: bool) -> None:
        self._still = still
        self.edges: EdgeMap = edge_map(still.rings, still.bounded, self._reach)
        self._rings = rings_of(still.rings, still.bounded)
        self._grid: ProximityGrid | None = None
        self._tiles: CostTiles | None = None
        self._field: GoalField | None = None
        self._field_cell = (math.nan, math.nan, b"")
        self._grid_centre = self._tiles_centre = (math.nan, math.nan)
        if plan_anew:
            self.planner.update(still)

    def tiles_about(self, pose: Array, target: Array) -> CostTiles:
        """Cost-to-go of a target; the tiles about the base are kept while it stays the same."""
        field, centre = self._field_about(pose, target), _centre(pose)
        if self._tiles is None or self._tiles.field is not field or centre != self._tiles_centre:
            self._tiles = cost_tiles(field, centre, self._seen() + _STEP)
            self._tiles_centre = centre
        return self._tiles

    def _field_about(self, pose: Array, target: Array) -> GoalField:
        """Cost-to-go, exact at the pose and along its way, of what meets an ellipse about both.

        It is asked for from the middle of the pose's cell, if the base can be seen from
        there: then the way from the base is longer by half the cell's diagonal at most, and
        by what it is worth to drive for the sake of less turning.
        """
        speeds = self.planner.speeds
        reach = _ASIDE + math.pi * speeds.forward / speeds.turning
        x, y = float(pose[0]), float(pose[1])
        px, py = (_CELL * (math.floor(value / _CELL) + 0.5) for value in (x, y))
        cell = (px, py, target.tobytes())
        if self._field is None or cell != self._field_cell:
            self._field = self.planner.goal_field(target, near=(px, py, None), reach=reach)
            self._field_cell = cell
        if line_of_sight(self._field.walls, px, py, x, y):
            return self._field
        return self.planner.goal_field(target, near=(x, y, None), reach=reach)

    def grid_about(self, pose: Array) -> ProximityGrid:
        """The nearness of what rests about the base."""
        p, centre = self._parameters, _centre(pose)
        if self._grid is None or centre != self._grid_centre:
            half = self._seen() + self._outline.radius + _STEP
            self._grid = proximity_grid(
                self._rings, centre, half, p.cell, p.proximity_radius, self._outline.radius
            )
            self._grid_centre = centre
        return self._grid

    def _seen(self) -> float:
        """How far from the base the window reaches [m]."""
        p = self._parameters
        return math.hypot(0.5 * p.window + p.window_ahead, 0.5 * p.window)


def _centre(pose: Array) -> tuple[float, float]:
    x, y = (_STEP * round(float(value) / _STEP) for value in pose[:2])
    return x, y


def _same(first: World, second: World) -> bool:
    """Whether two worlds have the same solids and boundary."""
    if len(first.solids) != len(second.solids):
        return False
    return _same_boundary(first, second) and all(map(_same_solid, first.solids, second.solids))


def _same_boundary(first: World, second: World) -> bool:
    if first.boundary is None or second.boundary is None:
        return first.boundary is second.boundary
    return np.array_equal(first.boundary, second.boundary)


def _same_solid(first: Solid, second: Solid) -> bool:
    return first is second or (
        len(first.holes) == len(second.holes)
        and all(map(np.array_equal, first.rings, second.rings))
    )
