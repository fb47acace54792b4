"""The local planners by name, each behind the one protocol."""

from __future__ import annotations

from motm_wbc.basenav.local_planner import Goal, LocalPlan, LocalPlanner
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import StaaPlan
from motm_wbc.basenav.world import World
from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LOCAL_PLANNERS = ("staa",)


def make_local_planner(
    name: str,
    world: World,
    footprint: Array,
    limits: BaseLimits,
    inflation: float,
    staa: StaaParameters,
) -> LocalPlanner:
    """A local planner over a global one.

    Args:
        name: one of `LOCAL_PLANNERS`.
        world: obstacles.
        footprint: (n, 2) convex outline in the base frame [m].
        limits: of the base.
        inflation: radius of the disc that the global planner plans for [m].
        staa: parameters of `staa`.

    Raises:
        InputError: a name, the footprint or a limit can't be used.
    """
    if name not in LOCAL_PLANNERS:
        raise UnknownName("local planner", name, LOCAL_PLANNERS)
    return _Staa(world, footprint, limits, inflation, staa)


class _Staa:
    """STAA* that is told what it planned one command period ago."""

    def __init__(
        self,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        inflation: float,
        parameters: StaaParameters,
    ) -> None:
        self._footprint = footprint
        self._limits = limits
        self._inflation = inflation
        self._parameters = parameters
        self._planner = self._planner_in(world)
        self._last: StaaPlan | None = None

    def plan(self, pose: Array, v: float, omega: float, goal: Goal) -> LocalPlan:
        self._last = self._planner.plan(pose, v, omega, goal, previous=self._last)
        return self._last

    def brake(self, pose: Array, v: float, omega: float) -> LocalPlan:
        self._last = None
        return self._planner.brake(pose, v, omega)

    def update(self, world: World) -> None:
        self._planner = self._planner_in(world)

    def _planner_in(self, world: World) -> StaaStar:
        limits = self._limits
        planner = GlobalPlanner(
            world, limits.v_max, limits.omega_max, self._inflation, limits.v_reverse
        )
        return StaaStar(world, self._footprint, limits, self._parameters, planner)
