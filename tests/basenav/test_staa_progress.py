"""Stuck: when it is noticed, what is tried, and that what is tried is as safe as all else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from motm_wbc.basenav.footprint_check import edge_map, outline_of, pose_is_clear
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import Goal, StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_progress import ProgressMonitor, Remedy
from motm_wbc.basenav.turning_place import turning_place
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)


def corridor() -> list[Array]:
    """Walls of a dead end 0.6 m wide about the origin, open 1 m behind the base."""
    return [
        polygons.place(polygons.rectangle(2.0, 0.2), np.array([0.0, side * 0.4, 0.0]))
        for side in (-1.0, 1.0)
    ] + [polygons.place(polygons.rectangle(0.2, 1.0), np.array([1.0, 0.0, 0.0]))]


@pytest.fixture(scope="module")
def planner() -> StaaStar:
    world = World(corridor())
    guide = GlobalPlanner(world, 0.5, 1.745, inflation=0.25, v_reverse=0.2)
    return StaaStar(world, BOX, LIMITS, StaaParameters(clock_guard=10.0), guide)


def test_no_progress_is_noticed_and_each_remedy_has_its_turn() -> None:
    monitor = ProgressMonitor(patience=3.0, spell=4.0, gain=0.1)
    seen = [monitor.update(0.5 * k, 10.0 - 0.001 * k) for k in range(26)]
    assert [s.remedy for s in seen[:6]] == [Remedy.NONE] * 6
    assert {s.remedy for s in seen[6:14]} == {Remedy.WIDER}
    assert {s.remedy for s in seen[14:22]} == {Remedy.TURNING_PLACE}
    assert [s.stuck for s in seen] == [False] * 22 + [True] * 4


def test_progress_waiting_and_another_goal_start_anew() -> None:
    monitor = ProgressMonitor(patience=3.0, gain=0.1)
    assert all(monitor.update(k, 20.0 - 0.2 * k).remedy == Remedy.NONE for k in range(10))
    assert monitor.update(20.0, 19.0).remedy != Remedy.NONE
    assert monitor.update(21.0, 19.0, waits=True).stalled == 0.0
    monitor.restart()
    assert monitor.update(60.0, 30.0).stalled == 0.0


def test_without_a_path_it_is_stuck_in_the_end() -> None:
    monitor = ProgressMonitor()
    assert monitor.update(0.0, math.inf).remedy == Remedy.NONE
    assert monitor.update(30.0, math.inf).stuck


@pytest.mark.parametrize("seed", range(8))
def test_the_turning_place_is_the_nearest_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solids = [polygons.disc(0.2) + rng.uniform(-1.5, 1.5, 2) for _ in range(6)]
    world, outline = World(solids), outline_of(BOX)
    edges = edge_map(world.rings, False, 0.5)
    pose = np.array([0.0, 0.0, rng.uniform(-3.0, 3.0)])

    def along(way: float, turn: float = 0.0) -> Array:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return np.array([way * c, way * s, pose[2] + turn])

    def can_turn(way: float) -> bool:
        turns = np.linspace(0.0, math.tau, 400)
        return all(pose_is_clear(edges, outline, along(way, turn), 0.02) for turn in turns)

    way = turning_place(edges, outline, 0.0, 0.0, pose[2], 0.02)
    if math.isnan(way):
        assert not can_turn(0.0)
        return
    assert can_turn(way)
    steps = np.arange(0.0, abs(way) + 1e-9, 0.04) * math.copysign(1.0, way)
    assert all(pose_is_clear(edges, outline, along(step), 0.02) for step in steps)
    assert not any(can_turn(step) for step in steps[:-1])


def test_from_a_dead_end_it_backs_out_to_where_it_can_turn(planner: StaaStar) -> None:
    pose, goal = np.array([0.3, 0.0, 0.0]), Goal(np.array([-3.0, 2.0, math.pi]))
    plan = planner.plan(pose, 0.0, 0.0, goal, remedy=Remedy.TURNING_PLACE)
    assert plan.remedy == Remedy.TURNING_PLACE
    assert plan.acceleration[0] < 0.0
    assert not plan.reached
    assert plan.poses[-1, 1] < pose[0]
    assert math.isfinite(plan.cost_to_go)


def test_a_wider_search_says_so_and_keeps_the_limits(planner: StaaStar) -> None:
    pose, goal = np.array([-2.0, 0.5, 0.0]), Goal(np.array([2.5, 0.0, 0.0]))
    usual = planner.plan(pose, 0.1, 0.0, goal)
    wider = planner.plan(pose, 0.1, 0.0, goal, remedy=Remedy.WIDER)
    assert (usual.remedy, wider.remedy) == (Remedy.NONE, Remedy.WIDER)
    assert wider.effort.children > usual.effort.children
    assert wider.expansions <= 1200
    assert usual.cost_to_go == wider.cost_to_go
    assert abs(wider.acceleration[0]) <= 0.5
    assert abs(wider.acceleration[1]) <= 2.0
