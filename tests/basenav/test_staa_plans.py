"""Single answers of the local planner: safe, within limits, deterministic, never raising."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa import Goal, StaaPlan, StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.window import local_target
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
TABLE = polygons.disc(0.2)
AHEAD = Goal(np.array([0.6, -2.0, -math.pi / 2]))


def staa(obstacles: list[Array], boundary: Array | None = None, **options: object) -> StaaStar:
    world = World(obstacles, boundary)
    planner = GlobalPlanner(world, 0.5, 1.745, inflation=0.3, v_reverse=0.2)
    return StaaStar(world, BOX, LIMITS, StaaParameters.model_validate(options), planner)


@pytest.fixture(scope="module")
def at_table() -> StaaStar:
    return staa([TABLE])


def wall(distance: float) -> Array:
    """A wall across the way, so far ahead of the front of a base at the origin."""
    return polygons.place(polygons.rectangle(0.2, 4.0), np.array([0.34 + distance + 0.1, 0, 0]))


@given(
    x=st.floats(-2.0, 2.0),
    y=st.floats(-2.0, 2.0),
    heading=st.floats(-3.2, 3.2),
    v=st.floats(-0.2, 0.5),
    omega=st.floats(-1.745, 1.745),
    stop=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_no_command_exceeds_the_limits(
    at_table: StaaStar, x: float, y: float, heading: float, v: float, omega: float, stop: bool
) -> None:
    plan = at_table.plan(np.array([x, y, heading]), v, omega, Goal(AHEAD.pose, stop))
    a, alpha = plan.acceleration
    assert abs(a) <= 0.5
    assert abs(alpha) <= 2.0
    assert -0.2 - 1e-12 <= v + 0.05 * a <= 0.5 + 1e-12
    assert abs(omega + 0.05 * alpha) <= 1.745 + 1e-12
    assert (plan.velocities[:, 0] <= 0.5 + 1e-9).all()
    assert (plan.velocities[:, 0] >= -0.2 - 1e-9).all()
    assert (np.abs(plan.velocities[:, 1]) <= 1.745 + 1e-9).all()
    steps = np.diff(plan.poses[:, 0])
    assert (steps >= 0.0).all()  # the last one may have no length, where the goal is met
    assert (np.abs(np.diff(plan.velocities[:, 0])) <= 0.5 * steps + 1e-9).all()
    assert (np.abs(np.diff(plan.velocities[:, 1])) <= 2.0 * steps + 1e-9).all()


def arc_overlap(obstacles: list[Array], plan: StaaPlan) -> float:
    blocked = shapely.union_all([Polygon(points) for points in obstacles])
    return max(Polygon(polygons.place(BOX, pose)).intersection(blocked).area
               for pose in plan.braking)  # fmt: skip


@given(seed=st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_the_braking_arc_of_an_answer_is_free_of_overlap(at_table: StaaStar, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle, off = rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 1.1)
    pose = np.array([off * math.cos(angle), off * math.sin(angle), rng.uniform(-3.0, 3.0)])
    v, omega = rng.uniform(-0.2, 0.5), rng.uniform(-1.7, 1.7)
    plan = at_table.plan(pose, v, omega, Goal(rng.uniform(-2.0, 2.0, 3), bool(rng.random() < 0.5)))
    if not plan.emergency:
        assert arc_overlap([TABLE], plan) < 1e-9


def test_a_blocked_braking_arc_is_caught() -> None:
    # 0.25 m are needed to stop from 0.5 m/s
    near, far = staa([wall(0.24)]), staa([wall(0.35)])
    goal = Goal(np.array([3.0, 0.0, 0.0]))
    caught = near.plan(np.zeros(3), 0.5, 0.0, goal)
    assert caught.emergency
    assert caught.acceleration == pytest.approx((-0.5, 0.0))
    assert not far.plan(np.zeros(3), 0.5, 0.0, goal).emergency
    assert near.brake(np.zeros(3), 0.5, 0.0).emergency
    assert not far.brake(np.zeros(3), 0.5, 0.0).emergency


@pytest.mark.parametrize("gap", [0.272, 0.28, 0.29])
def test_the_executed_step_counts_not_the_present_state(gap: float) -> None:
    # From here the base can stop in time, one command later it no longer could.
    blocked = [wall(gap)]
    plan = staa(blocked).plan(np.zeros(3), 0.5, 0.0, Goal(np.array([3.0, 0.0, 0.0])))
    assert not plan.emergency or plan.acceleration[0] < 0.0
    assert plan.acceleration[0] < 0.0
    assert arc_overlap(blocked, plan) == 0.0


def test_inside_the_margin_it_can_leave_but_not_go_deeper() -> None:
    # The front is 1 cm off the wall, within the margin of 2 cm.
    planner = staa([wall(0.01)])
    plan = planner.plan(np.zeros(3), 0.0, 0.0, Goal(np.array([-2.0, 0.0, 0.0])))
    assert not plan.emergency
    assert plan.acceleration[0] < 0.0
    onward = planner.plan(np.zeros(3), 0.0, 0.0, Goal(np.array([0.3, 0.0, 0.0])))
    assert onward.acceleration[0] <= 0.0


def test_in_contact_it_brakes_and_says_so() -> None:
    plan = staa([wall(-0.05)]).plan(np.zeros(3), 0.2, 0.1, Goal(np.array([-2.0, 0.0, 0.0])))
    assert plan.emergency
    assert plan.acceleration[0] < 0.0
    assert plan.acceleration[1] < 0.0
    assert not plan.reached


def test_the_same_question_has_the_same_answer(at_table: StaaStar) -> None:
    other = staa([TABLE])
    for seed in range(8):
        rng = np.random.default_rng(seed)
        pose = np.array([*rng.uniform(0.7, 2.0, 2), rng.uniform(-3.0, 3.0)])
        goal = Goal(rng.uniform(-2.0, 2.0, 3), seed % 2 == 0)
        first = at_table.plan(pose, 0.2, 0.3, goal)
        other.plan(pose[::-1].copy(), 0.0, 0.0, AHEAD)  # leaves no trace
        for again in (at_table.plan(pose, 0.2, 0.3, goal), other.plan(pose, 0.2, 0.3, goal)):
            assert again.acceleration == first.acceleration
            np.testing.assert_array_equal(again.poses, first.poses)
            assert again.expansions == first.expansions


def test_from_rest_it_sets_off_at_once(at_table: StaaStar) -> None:
    for ahead in (0.04, 0.08, 0.105, 0.12, 0.3, 2.0):
        pose = np.array([0.6, 2.0, -math.pi / 2])
        goal = Goal(np.array([0.6, 2.0 - ahead, -math.pi / 2]))
        assert at_table.plan(pose, 0.0, 0.0, goal).acceleration[0] == 0.5


def test_at_a_goal_passed_it_keeps_its_speed_and_at_a_stop_it_rests(at_table: StaaStar) -> None:
    pose = np.array([0.6, 1.0, -math.pi / 2])
    behind = np.array([0.6, 1.05, -math.pi / 2])
    through = at_table.plan(pose, 0.4, 0.0, Goal(behind))
    assert through.reached
    assert through.acceleration == (0.0, 0.0)
    resting = at_table.plan(pose, 0.0, 0.0, Goal(behind, stop=True))
    assert resting.reached
    assert resting.acceleration == (0.0, 0.0)


def test_expansions_end_the_search_and_the_clock_only_guards() -> None:
    pose, goal = np.array([0.0, 1.5, math.pi / 2]), Goal(np.array([0.0, -1.5, math.pi / 2]))
    few = staa([TABLE], expansions=20).plan(pose, 0.0, 0.0, goal)
    assert few.expansions == 20
    assert not few.clock_guard_fired
    assert not few.emergency
    hurried = staa([TABLE], clock_guard=1e-9).plan(pose, 0.0, 0.0, goal)
    assert hurried.clock_guard_fired
    assert not hurried.emergency
    assert hurried.expansions < 300


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_brakes_instead_of_raising(at_table: StaaStar, value: float) -> None:
    pose = np.array([0.6, 1.5, 0.0])
    assert at_table.plan(np.array([value, 0.0, 0.0]), 0.2, 0.0, AHEAD).emergency
    assert at_table.plan(pose, value, 0.0, AHEAD).emergency
    lost = at_table.plan(pose, 0.2, 0.0, Goal(np.array([value, 0.0, 0.0])))
    assert lost.emergency
    assert lost.acceleration[0] == pytest.approx(-0.5)
    assert np.isfinite(lost.poses).all()


def test_a_goal_that_can_not_be_reached_brakes() -> None:
    ring = [polygons.place(polygons.rectangle(3.0, 0.2), np.array([x, y, turn]))
            for x, y, turn in ((3, 1.4, 0), (3, -1.4, 0), (1.6, 0, math.pi / 2),
                               (4.4, 0, math.pi / 2))]  # fmt: skip
    plan = staa(ring).plan(np.zeros(3), 0.3, 0.0, Goal(np.array([3.0, 0.0, 0.0])))
    assert plan.emergency
    assert plan.acceleration[0] < 0.0


def test_the_window_ends_the_global_path() -> None:
    planner = GlobalPlanner(World([TABLE]), 0.5, 1.745, inflation=0.3, v_reverse=0.2)
    goal = np.array([10.0, 1.0, 1.0])
    target, is_goal = local_target(planner, np.array([0.0, 1.0, 0.0]), goal, 8.0, 2.0)
    np.testing.assert_allclose(target, [6.0, 1.0, 0.0], atol=1e-9)
    assert not is_goal
    near, is_goal = local_target(planner, np.array([5.0, 1.0, 0.0]), goal, 8.0, 2.0)
    np.testing.assert_array_equal(near, goal)
    assert is_goal
    literal = staa([TABLE], local_target="window")
    assert literal.plan(np.array([0.0, 1.0, 0.0]), 0.3, 0.0, Goal(goal)).acceleration[0] == 0.5


def test_kept_in_reach_only_while_it_is_there(at_table: StaaStar) -> None:
    region = ReachRegion(np.array([0.15, 0.0]), 0.72, math.radians(150.0))
    # 0.2 m more of driving and the base could no longer stop within reach
    pose = np.array([0.6, 0.0, -math.pi / 2])
    free = at_table.plan(pose, 0.5, 0.0, AHEAD)
    held = at_table.plan(pose, 0.5, 0.0, AHEAD, keep_in=region, object_xy=np.zeros(2))
    assert free.acceleration[0] == 0.0
    assert held.acceleration[0] < 0.0
    assert region.contains(held.braking[-1], np.zeros(2))
    away = np.array([0.6, 2.0, -math.pi / 2])
    outside = at_table.plan(away, 0.5, 0.0, AHEAD, keep_in=region, object_xy=np.zeros(2))
    assert outside.acceleration == at_table.plan(away, 0.5, 0.0, AHEAD).acceleration


def test_bad_input_is_refused_by_name() -> None:
    world = World([TABLE])
    planner = GlobalPlanner(world, 0.5, 1.745)
    concave = np.array([[0.3, 0.2], [0.0, 0.05], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])
    with pytest.raises(InputError, match="footprint: must be convex"):
        StaaStar(world, concave, LIMITS, StaaParameters(), planner)
    with pytest.raises(InputError, match="a_max: must be a number within"):
        StaaStar(world, BOX, BaseLimits(0.5, 0.2, 1.7, 0.0, 2.0), StaaParameters(), planner)
    with pytest.raises(ValueError, match="must be odd"):
        StaaParameters(linear_actions=4)


def test_a_window_of_too_many_cells_is_refused() -> None:
    with pytest.raises(ValueError, match="more than 2000 cells"):
        StaaParameters(window=80.0, cell=0.01)
