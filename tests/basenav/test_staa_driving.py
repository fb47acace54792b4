"""The local planner in a closed loop: an exact unicycle whose velocity is ramped at 120 Hz."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon

from motm_wbc.basenav.footprint_check import edge_map, outline_of, pose_is_clear
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa import Goal, StaaPlan, StaaStar
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
TABLE = polygons.disc(0.2)
REGION = ReachRegion(np.array([0.15, 0.0]), 0.72, math.radians(150.0))
DT = 1.0 / 120.0


@dataclass
class Drive:
    """A run: states (n, 5) x, y, heading, v, omega; its plans; when the goal was reached."""

    states: Array
    plans: list[StaaPlan]
    time: float | None

    @property
    def end(self) -> Array:
        return self.states[-1]


def staa(obstacles: list[Array], boundary: Array | None = None) -> StaaStar:
    world = World(obstacles, boundary)
    planner = GlobalPlanner(world, 0.5, 1.745, inflation=0.3, v_reverse=0.2)
    return StaaStar(world, BOX, LIMITS, StaaParameters(clock_guard=10.0), planner)


@pytest.fixture(scope="module")
def at_table() -> StaaStar:
    return staa([TABLE])


def at_goal(state: Array, goal: Goal) -> bool:
    near = math.hypot(*(goal.pose[:2] - state[:2])) <= 0.1
    turned = abs(wrap(goal.pose[2] - state[2])) <= 0.35
    return near and turned and (not goal.stop or (abs(state[3]) < 1e-9 and abs(state[4]) < 1e-9))


def drive(
    planner: StaaStar,
    pose: tuple[float, float, float],
    goal: Goal | Callable[[Array], Goal],
    *,
    v: float = 0.0,
    omega: float = 0.0,
    seconds: float = 30.0,
    keep_in: ReachRegion | None = None,
    memory: bool = True,
) -> Drive:
    state = np.array([*pose, v, omega])
    states, plans = [state], []
    for step in range(round(seconds / 0.05)):
        now = goal(state) if callable(goal) else goal
        plan = planner.plan(
            state[:3],
            state[3],
            state[4],
            now,
            keep_in=keep_in,
            object_xy=np.zeros(2),
            previous=plans[-1] if memory and plans else None,
        )
        plans.append(plan)
        for control in range(6):
            a, alpha = plan.acceleration
            v, omega = LIMITS.clip(state[3] + a * DT, state[4] + alpha * DT)
            state = np.array([*se2.integrate_twist(state[:3], v, 0.0, omega, DT), v, omega])
            states.append(state)
            if not callable(goal) and at_goal(state, goal) and keep_in is None:
                return Drive(np.array(states), plans, 0.05 * step + (control + 1) * DT)
    return Drive(np.array(states), plans, None)


def overlap(world: World, states: Array) -> float:
    """Largest area of the footprint in an obstacle or beyond the boundary [m^2]."""
    blocked = shapely.union_all([Polygon(points) for points in world.obstacles])
    areas = [0.0]
    for state in states[::3]:
        base = Polygon(polygons.place(BOX, state[:3]))
        areas.append(base.intersection(blocked).area)
        if world.boundary is not None:
            areas.append(base.difference(Polygon(world.boundary)).area)
    return max(areas)


def cluttered(rng: np.random.Generator) -> World:
    solids = []
    for _ in range(int(rng.integers(3, 9))):
        count = int(rng.integers(3, 7))
        angles = np.sort(rng.uniform(0.0, math.tau, count))
        radii = rng.uniform(0.1, 0.7) * rng.uniform(0.4, 1.0, count)
        points = np.column_stack([np.cos(angles), np.sin(angles)]) * radii[:, None]
        points += rng.uniform(-3.5, 3.5, 2)
        if Polygon(points).is_valid and Polygon(points).area > 0.01:
            solids.append(points)
    return World(solids, polygons.rectangle(8.0, 8.0))


def free_pose(world: World, rng: np.random.Generator) -> Array:
    edges, outline = edge_map(world.rings, world.bounded, 0.5), outline_of(BOX)
    while True:
        pose = np.array([*rng.uniform(-3.5, 3.5, 2), rng.uniform(-math.pi, math.pi)])
        if pose_is_clear(edges, outline, pose, 0.03):
            return pose


@pytest.mark.parametrize("seed", range(8))
def test_random_worlds_without_contact_and_within_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = cluttered(rng)
    planner = staa([*world.obstacles], world.boundary)
    begin = free_pose(world, rng)
    for stop in (False, True):
        goal = Goal(free_pose(world, rng), stop)
        shortest = planner.planner.plan(tuple(begin), tuple(goal.pose)).time
        run = drive(planner, tuple(begin), goal, seconds=2.0 * shortest + 10.0)
        assert overlap(world, run.states) < 1e-9
        assert run.time is not None
        assert run.time <= 1.3 * shortest + 2.0
        changes = np.abs(np.diff(run.states[:, 3:], axis=0))
        assert changes[:, 0].max() <= 0.5 * DT + 1e-9
        assert changes[:, 1].max() <= 2.0 * DT + 1e-9
        assert run.states[:, 3].max() <= 0.5
        assert run.states[:, 3].min() >= -0.2
        assert np.abs(run.states[:, 4]).max() <= 1.745
        for plan in run.plans[::10]:
            assert overlap(world, np.repeat(plan.braking, 3, axis=0)) < 1e-9
        assert not any(plan.clock_guard_fired for plan in run.plans)


def test_aimless_driving_never_touches_anything() -> None:
    """The braking arc is an invariant: goals that leap about can't talk it out of that."""
    rng = np.random.default_rng(5)
    world = cluttered(rng)
    planner = staa([*world.obstacles], world.boundary)
    goals = [Goal(np.array([*rng.uniform(-4.5, 4.5, 2), rng.uniform(-3, 3)])) for _ in range(60)]
    calls = iter(range(10**6))
    run = drive(planner, tuple(free_pose(world, rng)), lambda _: goals[next(calls) // 9],
                seconds=27.0)  # fmt: skip
    assert overlap(world, run.states) < 1e-9
    assert np.ptp(run.states[:, 0]) > 0.5


@pytest.mark.parametrize("memory", [True, False])
def test_drives_through_a_goal_on_a_line_at_full_speed(at_table: StaaStar, memory: bool) -> None:
    goal = Goal(np.array([0.6, 0.0, -math.pi / 2]))
    run = drive(at_table, (0.6, 2.0, -math.pi / 2), goal, memory=memory)
    assert run.time is not None
    assert run.end[3] >= 0.45
    # 1 s to speed up on 0.25 m, then 1.65 m to the tolerance at 0.5 m/s
    assert run.time == pytest.approx(1.0 + 1.65 / 0.5, abs=0.05)


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("lead", [1, 2])
def test_orbits_the_object_at_speed_from_candidate_to_candidate(
    at_table: StaaStar, turn: int, lead: int
) -> None:
    def candidate(state: Array) -> Goal:
        """The one of 36 on the ring that is at least `lead` steps ahead of the base."""
        ahead = turn * math.degrees(math.atan2(state[1], state[0]))
        angle = turn * math.radians(10.0 * (math.ceil(ahead / 10.0 - 1e-9) + lead))
        place = 0.6 * np.array([math.cos(angle), math.sin(angle)])
        return Goal(np.array([*place, wrap(angle + turn * math.pi / 2)]))

    run = drive(at_table, (0.6, 0.0, turn * math.pi / 2), candidate, v=0.5,
                omega=turn * 0.5 / 0.6, seconds=7.0)  # fmt: skip
    angles = np.unwrap(np.arctan2(run.states[:, 1], run.states[:, 0]))
    assert turn * (angles[-1] - angles[0]) > math.radians(320.0)
    assert run.states[:, 3].min() >= 0.45
    radii = np.hypot(run.states[:, 0], run.states[:, 1])
    assert radii.min() > 0.55
    assert radii.max() < 0.65


def test_near_goals_that_keep_their_distance_cost_no_time(at_table: StaaStar) -> None:
    def carrot(state: Array) -> Goal:
        gone = math.ceil((2.0 - state[1]) / 0.05 + 1e-6)
        return Goal(np.array([0.6, 2.0 - 0.05 * gone, -math.pi / 2]))

    run = drive(at_table, (0.6, 2.0, -math.pi / 2), carrot, seconds=4.0)
    assert 2.0 - run.end[1] == pytest.approx(0.25 + 3.0 * 0.5, abs=0.02)


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize(
    ("pose", "most"),
    [
        ((0.6, 3.2, math.pi / 2), 7.0),  # behind, same line
        ((1.2, 2.0, -math.pi / 2), 6.0),  # beside
        ((0.6, 2.3, -math.pi / 2), 4.0),  # behind, same heading
        ((0.6, 2.0, 0.5), 3.0),  # a turn on the spot
        ((2.0, 0.0, 0.0), 7.5),
        ((-0.6, 0.0, math.pi / 2), 9.0),  # beyond the table
    ],
)
def test_reaches_goals_beside_and_behind(
    at_table: StaaStar, pose: tuple[float, float, float], most: float, stop: bool
) -> None:
    run = drive(at_table, (0.6, 2.0, -math.pi / 2), Goal(np.array(pose), stop))
    assert run.time is not None
    assert run.time < most
    assert overlap(at_table.world, run.states) == 0.0


def test_at_rest_it_stays_at_rest(at_table: StaaStar) -> None:
    goal = Goal(np.array([0.6, 1.0, -math.pi / 2]), stop=True)
    run = drive(at_table, (0.6, 2.0, -math.pi / 2), lambda _: goal, seconds=6.0)
    resting = run.states[-120:]
    assert np.ptp(resting[:, :3], axis=0).max() == 0.0
    assert at_goal(run.end, goal)
    assert math.hypot(*(goal.pose[:2] - run.end[:2])) < 0.03


@pytest.mark.parametrize(
    ("pose", "stop"),
    [
        ((0.0, 2.5, math.pi / 2), False),
        ((-2.0, 0.0, math.pi / 2), True),
        ((0.0, -2.0, -math.pi / 2), False),
        ((0.0, 0.6, math.pi), False),
        ((0.0, 0.6, 0.0), True),
    ],
)
def test_leaves_a_table_that_it_stands_at_nose_in(
    at_table: StaaStar, pose: tuple[float, float, float], stop: bool
) -> None:
    run = drive(at_table, (0.0, 0.58, -math.pi / 2), Goal(np.array(pose), stop), seconds=20.0)
    assert run.time is not None
    assert run.time < 12.0
    assert overlap(at_table.world, run.states) == 0.0
    assert run.states[:, 3].min() < 0.0  # it had to reverse


@pytest.mark.parametrize("begin", [(0.6, 1.5, -math.pi / 2), (0.6, 0.1, -math.pi / 2)])
@pytest.mark.parametrize("beyond", [(0.6, -3.0, -math.pi / 2), (-2.0, -2.0, math.pi)])
def test_driven_past_the_object_it_stays_in_reach_and_rests(
    at_table: StaaStar, begin: tuple[float, float, float], beyond: tuple[float, float, float]
) -> None:
    near = Goal(np.array([0.6, 0.2, -math.pi / 2]))

    def first_near_then_beyond(state: Array) -> Goal:
        return near if state[1] > 0.3 else Goal(np.array(beyond))

    run = drive(at_table, begin, first_near_then_beyond, v=0.5, seconds=8.0, keep_in=REGION)
    inside = np.array([REGION.contains(state[:3], np.zeros(2)) for state in run.states])
    entered = int(inside.argmax())
    assert inside.any()
    assert inside[entered:].all()
    assert np.abs(run.states[-60:, 3:]).max() < 0.05
    arm = run.end[:2] + 0.15 * np.array([math.cos(run.end[2]), math.sin(run.end[2])])
    assert math.hypot(*arm) > 0.69  # as far on as it may
    assert overlap(at_table.world, run.states) == 0.0


def test_with_its_last_plan_the_time_left_never_grows(at_table: StaaStar) -> None:
    goal = Goal(np.array([2.0, 0.0, 0.0]))
    run = drive(at_table, (0.6, 2.0, -math.pi / 2), goal)
    assert run.time is not None
    arrival = [0.05 * index + plan.poses[-1, 0] for index, plan in enumerate(run.plans)]
    assert all(plan.reached for plan in run.plans)
    assert np.diff(arrival).max() < 0.1
    assert arrival[-1] <= arrival[0] + 0.05


def test_two_runs_are_equal_to_the_bit() -> None:
    goal = Goal(np.array([-0.6, 0.0, math.pi / 2]))
    first, second = (drive(staa([TABLE]), (0.6, 2.0, -1.5), goal, seconds=4.0) for _ in range(2))
    np.testing.assert_array_equal(first.states, second.states)
