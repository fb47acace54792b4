"""The Timed Elastic Band in a closed loop: an exact unicycle, velocity ramped at 120 Hz."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav import GlobalPlanner, TebParameters, TimedElasticBand, World
from motm_wbc.basenav.local_planner import Goal, LocalPlanner
from motm_wbc.basenav.obstacle import Disc, ObstacleLike
from motm_wbc.basenav.teb_plan import TebPlan
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
TABLE = polygons.rectangle(0.4, 0.4)
DT = 1.0 / 120.0


@dataclass
class Drive:
    """A run: states (n, 5) x, y, heading, v, omega; its plans; when the goal was reached."""

    states: Array
    plans: list[TebPlan]
    time: float | None

    @property
    def end(self) -> Array:
        return self.states[-1]


def teb(
    obstacles: list[ObstacleLike],
    boundary: Array | None = None,
    limits: BaseLimits = LIMITS,
    **parameters: float,
) -> TimedElasticBand:
    world = World(obstacles, boundary)
    planner = GlobalPlanner(
        world, limits.v_max, limits.omega_max, inflation=0.3, v_reverse=limits.v_reverse
    )
    return TimedElasticBand(world, BOX, limits, TebParameters.model_validate(parameters), planner)


def at_goal(state: Array, goal: Goal) -> bool:
    near = math.dist(goal.pose[:2], state[:2]) <= 0.1
    turned = abs(wrap(goal.pose[2] - state[2])) <= 0.35
    return near and turned and (not goal.stop or (abs(state[3]) < 1e-9 and abs(state[4]) < 1e-9))


def after_command(state: Array, acceleration: tuple[float, float]) -> list[Array]:
    """States over a command period."""
    states = []
    for _ in range(6):
        v, omega = LIMITS.clip(state[3] + acceleration[0] * DT, state[4] + acceleration[1] * DT)
        state = np.array([*se2.integrate_twist(state[:3], v, 0.0, omega, DT), v, omega])
        states.append(state)
    return states


def drive(
    planner: TimedElasticBand,
    pose: tuple[float, float, float],
    goal: Goal,
    seconds: float = 40.0,
) -> Drive:
    state = np.array([*pose, 0.0, 0.0])
    states, plans = [state], []
    for step in range(round(seconds / 0.05)):
        plans.append(planner.plan(state[:3], state[3], state[4], goal))
        for k, after in enumerate(after_command(state, plans[-1].acceleration)):
            states.append(after)
            if at_goal(after, goal):
                return Drive(np.array(states), plans, 0.05 * step + (k + 1) * DT)
        state = states[-1]
    return Drive(np.array(states), plans, None)


def clearance(world: World, states: Array) -> float:
    """Least distance of the footprint from what is blocked, by shapely; negative on overlap."""
    blocked = shapely.union_all([Polygon(solid.outline, solid.holes) for solid in world.solids])
    if world.boundary is not None:
        floor = Polygon(world.boundary)
        blocked = blocked.union(shapely.buffer(floor, 2.0).difference(floor))
    bases = [Polygon(polygons.place(BOX, state)) for state in states[::3]]
    return min(
        base.distance(blocked) if not base.intersects(blocked) else -base.intersection(blocked).area
        for base in bases
    )


def keeps_limits(run: Drive) -> bool:
    changes = np.abs(np.diff(run.states[:, 3:], axis=0))
    asked = np.array([plan.acceleration for plan in run.plans])
    return bool(
        np.abs(asked[:, 0]).max() <= 0.5
        and np.abs(asked[:, 1]).max() <= 2.0
        and changes[:, 0].max() <= 0.5 * DT + 1e-9
        and changes[:, 1].max() <= 2.0 * DT + 1e-9
        and run.states[:, 3].max() <= 0.5
        and run.states[:, 3].min() >= -0.2
        and np.abs(run.states[:, 4]).max() <= 1.745
    )


@pytest.fixture(scope="module")
def at_table() -> TimedElasticBand:
    return teb([TABLE])


def test_it_is_a_local_planner(at_table: TimedElasticBand) -> None:
    planner: LocalPlanner = at_table
    plan = planner.plan(np.array([2.0, 0.0, 0.0]), 0.0, 0.0, Goal(np.array([3.0, 0.0, 0.0])))
    assert plan.poses.shape[1] == 4
    assert plan.velocities.shape == (len(plan.poses), 2)
    assert plan.braking.shape[1] == 3
    assert plan.reached
    assert not plan.emergency
    np.testing.assert_allclose(plan.poses[-1, 1:], [3.0, 0.0, 0.0], atol=1e-12)
    assert (np.diff(plan.poses[:, 0]) > 0.0).all()


@pytest.mark.parametrize("length", [1.5, 4.0])
def test_a_straight_line_takes_the_time_that_the_limits_allow(length: float) -> None:
    run = drive(teb([]), (0.0, 0.0, 0.0), Goal(np.array([length, 0.0, 0.0]), stop=True))
    assert run.time == pytest.approx(length / 0.5 + 1.0, rel=0.05)
    assert math.dist(run.end[:2], [length, 0.0]) < 0.03
    assert keeps_limits(run)


@pytest.mark.parametrize("stop", [True, False])
@pytest.mark.parametrize(
    ("pose", "most"),
    [
        ((0.6, 0.0, -math.pi / 2), 6.0),  # on the way, beside the table
        ((-0.6, 0.0, math.pi / 2), 8.5),  # beyond the table, turned about
        ((0.6, 0.0, math.pi / 2), 8.0),  # beside it, turned about where there is no room to
        ((0.6, 3.2, math.pi / 2), 5.5),  # behind
        ((1.2, 2.0, -math.pi / 2), 5.0),  # beside
        ((0.6, 2.0, 0.5), 3.0),  # a turn on the spot
    ],
)
def test_docks_and_drives_through_beside_a_table(
    at_table: TimedElasticBand, pose: tuple[float, float, float], most: float, stop: bool
) -> None:
    goal = Goal(np.array(pose), stop)
    run = drive(at_table, (0.6, 2.0, -math.pi / 2), goal)
    assert run.time is not None
    assert run.time < most
    assert keeps_limits(run)
    assert clearance(at_table.world, run.states) > 0.02 - 1e-9
    if stop:
        assert math.dist(goal.pose[:2], run.end[:2]) < 0.03
        assert abs(wrap(goal.pose[2] - run.end[2])) < 0.1


def test_at_rest_at_the_goal_it_stays(at_table: TimedElasticBand) -> None:
    goal = Goal(np.array([0.6, 1.0, -math.pi / 2]), stop=True)
    end = drive(at_table, (0.6, 2.0, -math.pi / 2), goal).end
    for _ in range(20):
        plan = at_table.plan(end[:3], end[3], end[4], goal)
        assert plan.reached
        assert not plan.emergency
        end = after_command(end, plan.acceleration)[-1]
    np.testing.assert_allclose(end[3:], 0.0, atol=1e-12)


@pytest.mark.parametrize("half", [0.3, 0.4])
def test_drives_its_nose_to_a_table_and_leaves_it(half: float) -> None:
    planner = teb([polygons.rectangle(2.0 * half, 2.0 * half)])
    nose_in = Goal(np.array([half + 0.4, 0.0, math.pi]), stop=True)
    run = drive(planner, (2.5, 1.0, 0.0), nose_in)
    away = drive(planner, tuple(run.end[:3]), Goal(np.array([2.5, 1.0, 0.0]), stop=True))
    for part in (run, away):
        assert part.time is not None
        assert part.time < 10.0
        assert clearance(planner.world, part.states) > 0.0
        assert keeps_limits(part)
    assert away.states[:, 3].min() < 0.0  # it had to reverse


def door(gap: float) -> list[ObstacleLike]:
    side = 3.0 - 0.5 * gap
    wall = polygons.rectangle(0.15, side)
    return [wall + [0.0, 0.5 * (gap + side)], wall - [0.0, 0.5 * (gap + side)]]


@pytest.mark.parametrize(
    "begin",
    [
        (-2.0, 0.0, 0.0),
        pytest.param((-2.0, 2.0, -1.57), marks=pytest.mark.slow),
        pytest.param((-0.6, 1.5, 1.57), marks=pytest.mark.slow),
    ],
)
def test_passes_a_door_that_is_a_fifth_of_a_metre_wider(begin: tuple[float, float, float]) -> None:
    planner = teb(door(0.67), polygons.rectangle(8.0, 6.0))
    run = drive(planner, begin, Goal(np.array([2.0, 0.0, 0.0]), stop=True))
    assert run.time is not None
    assert run.time < 14.0
    assert clearance(planner.world, run.states) > 0.0


@pytest.mark.parametrize(
    "goal", [(3.0, 0.0, 0.0), pytest.param((3.0, 0.0, math.pi), marks=pytest.mark.slow)]
)
def test_the_global_path_leads_it_out_of_a_trap(goal: tuple[float, float, float]) -> None:
    outline = [[1.0, -1.2], [1.2, -1.2], [1.2, 1.2], [-1.0, 1.2], [-1.0, 1.0], [1.0, 1.0],
               [1.0, -1.0], [-1.0, -1.0], [-1.0, -1.2]]  # fmt: skip
    planner = teb([np.array(outline)])
    run = drive(planner, (0.3, 0.0, 0.0), Goal(np.array(goal), stop=True))
    assert run.time is not None
    assert run.time < 1.2 * planner.planner.plan((0.3, 0.0, 0.0), goal).time + 2.0
    assert clearance(planner.world, run.states) > 0.0


@pytest.mark.slow
def test_leaves_a_corridor_that_it_can_not_turn_in_in_reverse() -> None:
    wall = polygons.rectangle(5.0, 0.2)
    planner = teb([wall + [0.0, 0.435], wall - [0.0, 0.435]], polygons.rectangle(10.0, 5.0))
    run = drive(planner, (-1.5, 0.0, 0.0), Goal(np.array([-4.0, 1.0, math.pi / 2]), stop=True))
    assert run.time is not None
    assert run.states[:, 3].min() < -0.15
    assert clearance(planner.world, run.states) > 0.0


def cluttered(rng: np.random.Generator) -> World:
    solids: list[ObstacleLike] = []
    for _ in range(int(rng.integers(3, 9))):
        angles = np.sort(rng.uniform(0.0, math.tau, int(rng.integers(3, 7))))
        radii = rng.uniform(0.1, 0.7) * rng.uniform(0.4, 1.0, len(angles))
        points = np.column_stack([np.cos(angles), np.sin(angles)]) * radii[:, None]
        points += rng.uniform(-3.5, 3.5, 2)
        if Polygon(points).is_valid and Polygon(points).area > 0.01:
            solids.append(points)
    return World(solids, polygons.rectangle(8.0, 8.0))


def free_pose(world: World, rng: np.random.Generator) -> Array:
    while True:
        pose = np.array([*rng.uniform(-3.5, 3.5, 2), rng.uniform(-math.pi, math.pi)])
        if clearance(world, pose[None]) > 0.04:
            return pose


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 40))]
)
def test_random_worlds_without_contact_and_within_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = cluttered(rng)
    planner = teb([*world.obstacles], world.boundary)
    begin = free_pose(world, rng)
    for stop in (False, True):
        goal = Goal(free_pose(world, rng), stop)
        shortest = planner.planner.plan(tuple(begin), tuple(goal.pose)).time
        run = drive(planner, tuple(begin), goal, seconds=2.0 * shortest + 10.0)
        assert clearance(world, run.states) > 0.0
        assert keeps_limits(run)
        assert run.time is not None
        assert run.time <= 1.3 * shortest + 2.0
        for plan in run.plans[::10]:
            assert clearance(world, np.repeat(plan.braking, 3, axis=0)) > 0.0


@given(seed=st.integers(0, 10**6))
@settings(max_examples=60)
def test_commands_keep_the_limits_and_leave_a_free_braking_arc(seed: int) -> None:
    """From any state that can still brake, moving as it likes, also beyond its limits."""
    rng = np.random.default_rng(seed)
    planner = STATIC
    pose = np.array([*rng.uniform(-2.5, 2.5, 2), rng.uniform(-4.0, 4.0)])
    v, omega = rng.uniform(-0.3, 0.6), rng.uniform(-2.0, 2.0)
    goal = Goal(np.array([*rng.uniform(-2.5, 2.5, 2), rng.uniform(-4.0, 4.0)]), rng.random() < 0.5)
    plan = planner.plan(pose, v, omega, goal)
    a, alpha = plan.acceleration
    assert abs(a) <= 0.5
    assert abs(alpha) <= 2.0
    v, omega = LIMITS.clip(v, omega)
    assert -0.2 - 1e-9 <= v + 0.05 * a <= 0.5 + 1e-9
    assert abs(omega + 0.05 * alpha) <= 1.745 + 1e-9
    brake = planner.brake(pose, v, omega)
    if not brake.emergency:
        states = np.vstack([after_command(np.array([*pose, v, omega]), plan.acceleration)])
        assert clearance(planner.world, np.repeat(states[:, :3], 3, axis=0)) >= 0.0
        assert clearance(planner.world, np.repeat(plan.braking, 3, axis=0)) >= 0.0


STATIC = teb([TABLE, polygons.disc(0.4) + np.array([1.2, 1.2])], polygons.rectangle(6.0, 6.0))


def test_a_blocked_arc_is_refused_whatever_the_band_says(
    at_table: TimedElasticBand, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted fault: a band that drives into the table at full speed."""
    pose, goal = np.array([1.0, 0.0, math.pi]), Goal(np.array([-1.0, 0.0, math.pi]))
    monkeypatch.setattr(at_table, "_command", lambda band, state: (0.5, 0.0))
    refused = 0
    state = np.array([*pose, 0.0, 0.0])
    for _ in range(60):
        plan = at_table.plan(state[:3], state[3], state[4], goal)
        refused += plan.acceleration != (0.5, 0.0)
        states = after_command(state, plan.acceleration)
        assert clearance(at_table.world, np.array(states)) > 0.0
        state = states[-1]
    assert refused > 10


def test_without_the_check_the_same_fault_ends_in_the_table(at_table: TimedElasticBand) -> None:
    state = np.array([1.0, 0.0, math.pi, 0.0, 0.0])
    for _ in range(40):
        state = after_command(state, (0.5, 0.0))[-1]
    assert clearance(at_table.world, state[None]) < 0.0


def test_unknown_states_and_goals_brake() -> None:
    planner = teb([TABLE])
    goal = Goal(np.array([2.0, 0.0, 0.0]))
    here = np.array([1.5, 0.0, 0.0])
    for pose, v, omega in (
        (np.array([math.nan, 0.0, 0.0]), 0.5, 0.0),
        (np.array([0.0, math.inf, 0.0]), 0.5, 0.0),
        (here, math.nan, 0.0),
        (here, 0.5, math.inf),
        (np.zeros(3), 0.5, 0.0),  # in the table
    ):
        plan = planner.plan(pose, v, omega, goal)
        assert plan.emergency
        assert plan.acceleration[0] == (-0.5 if v == 0.5 else 0.0)
    for wrong in (np.array([math.nan, 0.0, 0.0]), np.array([0.0, math.inf, 0.0]), np.zeros(2)):
        plan = planner.plan(here, 0.5, 0.0, Goal(wrong))
        assert plan.emergency
        assert plan.acceleration == (-0.5, 0.0)


def test_where_there_is_no_path_it_brakes() -> None:
    ring = World([polygons.disc(2.0)]).obstacles[0]
    inside = World([], ring)
    planner = GlobalPlanner(inside, 0.5, 1.745, inflation=0.3)
    band = TimedElasticBand(inside, BOX, LIMITS, TebParameters(), planner)
    plan = band.plan(np.zeros(3), 0.5, 0.0, Goal(np.array([9.0, 0.0, 0.0])))
    assert abs(plan.acceleration[0]) <= 0.5
    shut = teb([polygons.rectangle(0.2, 6.0)], polygons.rectangle(6.0, 4.0))
    plan = shut.plan(np.array([-1.5, 0.0, 0.0]), 0.4, 0.0, Goal(np.array([1.5, 0.0, 0.0])))
    assert plan.emergency
    assert plan.acceleration == (-0.5, 0.0)


@pytest.mark.parametrize(
    ("limits", "footprint"),
    [
        (BaseLimits(0.0, 0.2, 1.0, 0.5, 2.0), BOX),
        (BaseLimits(0.5, -0.2, 1.0, 0.5, 2.0), BOX),
        (BaseLimits(0.5, 0.2, 1.0, math.nan, 2.0), BOX),
        (LIMITS, BOX[:2]),
        (LIMITS, np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]])),
    ],
)
def test_what_can_not_be_planned_with_is_refused(limits: BaseLimits, footprint: Array) -> None:
    world = World([])
    with pytest.raises(InputError):
        TimedElasticBand(world, footprint, limits, TebParameters(), GlobalPlanner(world, 0.5, 1.0))


def test_every_plan_is_bounded_in_time() -> None:
    """Far goals, huge coordinates, many obstacles: a plan may be slow, but never hangs."""
    rng = np.random.default_rng(0)
    many = [polygons.disc(0.1, 8) + rng.uniform(1.0, 30.0, 2) for _ in range(300)]
    planner = teb(many)
    for far in (20.0, 1e4, 1e8):
        began = time.perf_counter()
        plan = planner.plan(np.zeros(3), 0.0, 0.0, Goal(np.array([far, far, 0.0])))
        assert time.perf_counter() - began < 20.0
        assert len(plan.poses) <= 401


def test_a_far_goal_is_reached_part_by_part() -> None:
    planner = teb([polygons.disc(0.5) + np.array([3.0, 0.1])], horizon=4.0)
    run = drive(planner, (0.0, 0.0, 0.0), Goal(np.array([6.0, 0.0, 0.0]), stop=True))
    assert run.time is not None
    assert run.time < 15.0
    assert not run.plans[0].reached
    assert run.plans[-1].reached


def test_a_goal_that_creeps_keeps_the_band_and_one_that_leaps_gets_a_new_one() -> None:
    planner = teb([])
    at = np.array([3.0, 0.0, 0.0])
    assert planner.plan(np.zeros(3), 0.3, 0.0, Goal(at)).restarted
    assert not planner.plan(np.zeros(3), 0.3, 0.0, Goal(at + [0.1, 0.1, 0.0])).restarted
    assert planner.plan(np.zeros(3), 0.3, 0.0, Goal(at + [0.0, 3.0, 0.0])).restarted


def test_avoids_what_moves() -> None:
    """A disc crosses the way just when the base would be there."""
    begin, goal = np.array([-2.0, 0.0, 0.0]), Goal(np.array([2.5, 0.0, 0.0]), stop=True)
    speed = np.array([0.0, -0.35])

    def seen(now: float) -> World:
        return World([Disc(np.array([0.0, 1.6]) + now * speed, 0.3, speed)])

    planner = teb([Disc((0.0, 1.6), 0.3, (0.0, -0.35))])
    state, nearest = np.array([*begin, 0.0, 0.0]), math.inf
    for step in range(400):
        world = seen(0.05 * step)
        planner.update(world)
        plan = planner.plan(state[:3], state[3], state[4], goal)
        state = after_command(state, plan.acceleration)[-1]
        nearest = min(nearest, clearance(seen(0.05 * (step + 1)), state[None]))
        if at_goal(state, goal):
            break
    assert at_goal(state, goal)
    assert nearest > 0.0


def test_an_obstacle_that_appears_is_seen() -> None:
    planner = teb([])
    goal = Goal(np.array([4.0, 0.0, 0.0]), stop=True)
    state = np.array([0.0, 0.0, 0.0, 0.0, 0.0])
    world = World([polygons.rectangle(0.4, 1.5) + np.array([2.3, 0.2])])
    for step in range(400):
        if step == 40:
            planner.update(world)
        plan = planner.plan(state[:3], state[3], state[4], goal)
        states = after_command(state, plan.acceleration)
        assert clearance(world, np.array(states)) > 0.0
        state = states[-1]
        if at_goal(state, goal):
            break
    assert at_goal(state, goal)


def test_a_base_that_was_carried_off_gets_a_new_band() -> None:
    planner, goal = teb([]), Goal(np.array([3.0, 0.0, 0.0]))
    assert planner.plan(np.zeros(3), 0.0, 0.0, goal).restarted
    assert not planner.plan(np.array([0.1, 0.05, 0.0]), 0.3, 0.0, goal).restarted
    assert planner.plan(np.array([0.1, 1.0, 0.0]), 0.3, 0.0, goal).restarted


def test_two_runs_are_equal_to_the_bit() -> None:
    goal = Goal(np.array([-0.6, 0.0, math.pi / 2]), stop=True)
    first, second = (drive(teb([TABLE]), (0.6, 2.0, -1.5), goal) for _ in range(2))
    np.testing.assert_array_equal(first.states, second.states)
