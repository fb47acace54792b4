"""The local planners by name, each behind the one protocol."""

from __future__ import annotations

import time
from typing import Protocol

from motm_wbc.basenav.local_planner import Goal, LocalPlanner
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import AT_REST, StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import StaaPlan
from motm_wbc.basenav.staa_progress import ProgressMonitor
from motm_wbc.basenav.teb import TimedElasticBand
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.wide_search import WideSearch
from motm_wbc.basenav.world import World
from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LOCAL_PLANNERS = ("staa", "teb")
_PATIENCE = 1.0  # [s] without progress after which STAA* searches wider


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
    """STAA* that knows its last plan, and searches wider, standing, where it gets no nearer."""

    def __init__(self, planner: StaaStar) -> None:
        self._staa = planner
        self._last: StaaPlan | None = None
        self._goal: Goal | None = None
        self._time = 0.0
        self._monitor = ProgressMonitor(_PATIENCE)
        self._stuck = False
        self._wide: WideSearch | None = None

    @property
    def planner(self) -> GlobalPlanner:
        return self._staa.planner

    def plan(self, pose: Array, v: float, omega: float, goal: Goal) -> StaaPlan:
        if self._goal is None or not goal.is_same(self._goal):
            self._goal = goal
            self._go_on()
        plan = self._search_wider(pose, v, omega, goal) if self._stuck else None
        if plan is None:
            plan = self._staa.plan(pose, v, omega, goal, previous=self._last)
            self._time += self._staa.parameters.command_period
            leads_on = plan.reached or plan.detour
            self._stuck = self._monitor.update(self._time, plan.cost_to_go, leads_on).stuck
        self._last = plan
        return plan

    def _search_wider(self, pose: Array, v: float, omega: float, goal: Goal) -> StaaPlan | None:
        """Brake, then search while the base stands; None: this is not the time for it."""
        began = time.thread_time()
        brake = self._staa.brake(pose, v, omega)
        if brake.emergency:
            self._go_on()
            return None
        if max(abs(v), abs(omega)) > AT_REST:
            return brake
        if self._wide is None or not self._wide.is_at(pose, goal):
            self._wide = self._staa.wide_search(pose, goal)
        if self._wide is None:
            self._go_on()
            return None
        plan = self._wide.go_on(began)
        if self._wide.done:
            self._go_on()
        return plan

    def _go_on(self) -> None:
        """Plan as usual from now on."""
        self._wide = None
        self._stuck = False
        self._monitor.restart()

    def brake(self, pose: Array, v: float, omega: float) -> StaaPlan:
        self._last = None
        return self._staa.brake(pose, v, omega)

    def update(self, world: World) -> None:
        rest = self._staa.planner.world
        self._staa.update(world)
        if self._staa.planner.world is not rest:
            self._wide = None  # its nodes may be blocked now
