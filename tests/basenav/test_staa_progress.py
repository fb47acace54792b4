"""Stuck: when it is noticed, and the search that goes on while the base stands."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from motm_wbc.basenav.footprint_check import edge_map, outline_of, pose_is_clear
from motm_wbc.basenav.local_planners import make_local_planner
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import Goal, StaaPlan, StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_progress import ProgressMonitor
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.wide_search import WideSearch
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
PARAMETERS = StaaParameters(clock_guard=10.0)
NOSE_IN = np.array([0.3, 0.0, 0.0])
OUT = Goal(np.array([-0.1, 1.2, math.pi]))


def corridor() -> list[Array]:
    """Walls of a dead end 0.6 m wide about the origin, open 1 m behind the base."""
    return [
        polygons.place(polygons.rectangle(2.0, 0.2), np.array([0.0, side * 0.4, 0.0]))
        for side in (-1.0, 1.0)
    ] + [polygons.place(polygons.rectangle(0.2, 1.0), np.array([1.0, 0.0, 0.0]))]


def guide(world: World) -> GlobalPlanner:
    return GlobalPlanner(world, 0.5, 1.745, inflation=0.25, v_reverse=0.2)


@pytest.fixture(scope="module")
def planner() -> StaaStar:
    world = World(corridor())
    return StaaStar(world, BOX, LIMITS, PARAMETERS, guide(world))


def test_no_progress_is_noticed() -> None:
    monitor = ProgressMonitor(patience=3.0, gain=0.1)
    seen = [monitor.update(0.5 * k, 10.0 - 0.001 * k) for k in range(10)]
    assert [s.stuck for s in seen] == [False] * 6 + [True] * 4
    assert [s.stalled for s in seen] == [0.5 * k for k in range(10)]


def test_progress_waiting_and_another_goal_start_anew() -> None:
    monitor = ProgressMonitor(patience=3.0, gain=0.1)
    assert not any(monitor.update(k, 20.0 - 0.2 * k).stuck for k in range(10))
    assert monitor.update(20.0, 19.0).stuck
    assert monitor.update(21.0, 19.0, waits=True).stalled == 0.0
    monitor.restart()
    assert monitor.update(60.0, 30.0).stalled == 0.0


def test_without_a_path_it_is_stuck_in_the_end() -> None:
    monitor = ProgressMonitor()
    assert not monitor.update(0.0, math.inf).stuck
    assert monitor.update(30.0, math.inf).stuck


def found(planner: StaaStar, goal: Goal = OUT) -> tuple[WideSearch, list[StaaPlan]]:
    """The search from the dead end, and its answers."""
    search = planner.wide_search(NOSE_IN, goal)
    assert search is not None
    plans = []
    while not search.done:
        plans.append(search.go_on(time.thread_time()))
    return search, plans


def test_the_search_goes_on_where_it_stopped_and_only_its_expansions_count() -> None:
    def plans(step: int) -> list[StaaPlan]:
        world = World(corridor())
        parameters = PARAMETERS.model_copy(update={"wide_step": step, "expansions": 50})
        return found(StaaStar(world, BOX, LIMITS, parameters, guide(world)))[1]

    small, large = plans(100), plans(400)
    assert len(small) > len(large) > 1
    for answers, step in ((small, 100), (large, 400)):
        spent = np.diff([0, *(plan.expansions for plan in answers)])
        assert spent[0] == 50
        assert (spent[1:-1] == step).all()
        assert all(plan.acceleration == (0.0, 0.0) and plan.goal is None for plan in answers[:-1])
        assert answers[-1].detour
    again = plans(100)
    assert [plan.expansions for plan in again] == [plan.expansions for plan in small]
    np.testing.assert_array_equal(again[-1].actions, small[-1].actions)


def test_it_gives_up_at_its_bound() -> None:
    world = World(corridor())
    parameters = PARAMETERS.model_copy(
        update={"wide_expansions": 120, "wide_gain": 60.0, "expansions": 50}
    )
    search, plans = found(StaaStar(world, BOX, LIMITS, parameters, guide(world)))
    assert search.done
    assert plans[-1].expansions == 120
    assert not any(plan.detour for plan in plans)


def test_it_is_bound_to_its_place_and_goal(planner: StaaStar) -> None:
    search = planner.wide_search(NOSE_IN, OUT)
    assert search is not None
    assert search.is_at(NOSE_IN + [0.0, 0.0, math.tau], OUT)
    assert not search.is_at(NOSE_IN + [0.0, 0.01, 0.0], OUT)
    assert not search.is_at(NOSE_IN, Goal(OUT.pose, stop=True))


def test_there_is_none_from_inside_a_wall_nor_to_where_no_path_leads(planner: StaaStar) -> None:
    assert planner.wide_search(np.array([1.0, 0.0, 0.0]), OUT) is None
    assert planner.wide_search(NOSE_IN, Goal(np.array([math.nan, 0.0, 0.0]))) is None
    ring = World([], polygons.rectangle(3.0, 3.0))
    within = StaaStar(ring, BOX, LIMITS, PARAMETERS, guide(ring))
    room = [np.array([x, y, turn]) for x, y, turn in
            ((0.8, 0, 0), (-0.8, 0, 0), (0, 0.8, math.pi / 2), (0, -0.8, math.pi / 2))]  # fmt: skip
    within.update(World([polygons.place(polygons.rectangle(0.1, 1.8), p) for p in room]))
    assert within.wide_search(np.zeros(3), Goal(np.array([3.0, 0.0, 0.0]))) is None


def test_out_of_a_dead_end_by_the_plan_that_was_found() -> None:
    """With few expansions the usual search stays nose in: the cost-to-go turns on the spot."""
    world = World(corridor())
    parameters = PARAMETERS.model_copy(update={"expansions": 10})
    local = make_local_planner("staa", world, BOX, LIMITS, 0.25, parameters, TebParameters())
    edges, outline = edge_map(world.rings, False, 0.5), outline_of(BOX)
    state, detours, reached = np.array([*NOSE_IN, 0.0, 0.0]), 0, False
    for _ in range(600):
        plan = local.plan(state[:3], state[3], state[4], OUT)
        assert isinstance(plan, StaaPlan)
        detours += plan.detour
        after = state[3:] + 0.05 * np.array(plan.acceleration)
        v, omega = 0.5 * (state[3:] + after)
        state = np.array([*se2.integrate_twist(state[:3], v, 0.0, omega, 0.05), *after])
        assert pose_is_clear(edges, outline, state[:3], 0.0)
        off = np.hypot(*(state[:2] - OUT.pose[:2]))
        reached = bool(off < 0.1 and abs(math.remainder(state[2] - math.pi, math.tau)) < 0.35)
        if reached:
            break
    assert reached
    assert detours > 0
