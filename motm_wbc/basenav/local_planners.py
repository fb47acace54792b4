"""The local planners by name, each behind the one protocol."""

from __future__ import annotations

from typing import Protocol

from motm_wbc.basenav.local_planner import Goal, LocalPlanner
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import StaaPlan
from motm_wbc.basenav.staa_progress import ProgressMonitor, Remedy
from motm_wbc.basenav.teb import TimedElasticBand
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.world import World
from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LOCAL_PLANNERS = ("staa", "teb")


class GuidedPlanner(LocalPlanner, Protocol):
    """A local planner that a global one leads."""

    @property
    def planner(self) -> GlobalPlanner:
        """The global planner, of the world as it was seen last."""


def make_local_planner(
    name: str,
    world: World,
    footprint: Array,
    limits: BaseLimits,
    inflation: float,
    staa: StaaParameters,
    teb: TebParameters,
) -> GuidedPlanner:
    """A local planner over a global one.

    Args:
        name: one of `LOCAL_PLANNERS`.
        world: obstacles.
        footprint: (n, 2) convex outline in the base frame [m].
        limits: of the base.
        inflation: radius of the disc that the global planner plans for [m].
        staa: parameters of `staa`.
        teb: parameters of `teb`.

    Raises:
        InputError: a name, the footprint or a limit can't be used.
    """
    if name not in LOCAL_PLANNERS:
        raise UnknownName("local planner", name, LOCAL_PLANNERS)
    planner = GlobalPlanner(world, limits.v_max, limits.omega_max, inflation, limits.v_reverse)
    if name == "teb":
        return TimedElasticBand(world, footprint, limits, teb, planner)
    return _Staa(StaaStar(world, footprint, limits, staa, planner))


class _Staa:
    """STAA* that knows its last plan, and tries a remedy where it gets no nearer to its goal."""

    def __init__(self, planner: StaaStar) -> None:
        self._staa = planner
        self._last: StaaPlan | None = None
        self._goal: Goal | None = None
        self._monitor = ProgressMonitor()
        self._remedy = Remedy.NONE
        self._time = 0.0

    @property
    def planner(self) -> GlobalPlanner:
        return self._staa.planner

    def plan(self, pose: Array, v: float, omega: float, goal: Goal) -> StaaPlan:
        if self._goal is None or not goal.is_same(self._goal):
            self._goal, self._remedy = goal, Remedy.NONE
            self._monitor.restart()
        plan = self._staa.plan(pose, v, omega, goal, previous=self._last, remedy=self._remedy)
        self._time += self._staa.parameters.command_period
        self._remedy = self._monitor.update(self._time, plan.cost_to_go).remedy
        self._last = plan
        return plan

    def brake(self, pose: Array, v: float, omega: float) -> StaaPlan:
        self._last = None
        return self._staa.brake(pose, v, omega)

    def update(self, world: World) -> None:
        self._staa.update(world)
