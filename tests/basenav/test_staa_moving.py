"""The local planner among obstacles that move, judged by shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.movers import half_way, meets_mover, movers_of, nearness_of_movers
from motm_wbc.basenav.obstacle import Disc, Obstacle
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import Goal, StaaPlan, StaaStar
from motm_wbc.basenav.staa_escape import WaysOut
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import NO_ACTIONS
from motm_wbc.basenav.staa_root import NOWHERE, with_direction
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
PERIOD, RAMP = 0.05, 6
OUTLINE = outline_of(BOX)


def staa(world: World, **options: object) -> StaaStar:
    planner = GlobalPlanner(world, 0.5, 1.745, inflation=0.3, v_reverse=0.2)
    chosen = {"clock_guard": 10.0} | options
    return StaaStar(world, BOX, LIMITS, StaaParameters.model_validate(chosen), planner)


@pytest.fixture(scope="module")
def planner() -> StaaStar:
    return staa(World([]))


def depth(world: World, pose: Array) -> float:
    """Area of the footprint that lies in obstacles [m^2]."""
    base = Polygon(polygons.place(BOX, pose))
    solids = [Polygon(s.outline, s.holes) for s in world.solids]
    out = base.difference(Polygon(world.boundary)).area if world.boundary is not None else 0.0
    return max([out, *(base.intersection(solid).area for solid in solids)])


class Run:
    """A drive: what was hit, how fast the base was then, and when the goal was reached."""

    def __init__(self, planner: StaaStar, world: World, start: Array, goal: Goal) -> None:
        self.planner, self.world, self.goal = planner, world, goal
        self.state = np.array([*start, 0.0, 0.0])
        self.time, self.rested = 0.0, 0.0
        self.hits: list[float] = []  # how long it had been at rest
        self.plans: list[StaaPlan] = []

    def step(self) -> StaaPlan:
        self.planner.update(self.world.after(self.time))
        plan = self.planner.plan(
            self.state[:3],
            self.state[3],
            self.state[4],
            self.goal,
            previous=self.plans[-1] if self.plans else None,
        )
        a, alpha = plan.acceleration
        assert abs(a) <= LIMITS.a_max + 1e-12
        assert abs(alpha) <= LIMITS.alpha_max + 1e-12
        dt = PERIOD / RAMP
        for _ in range(RAMP):
            v, omega = self.state[3] + a * dt, self.state[4] + alpha * dt
            assert (v, omega) == pytest.approx(LIMITS.clip(v, omega), abs=1e-9)
            self.state = np.array(
                [*se2.integrate_twist(self.state[:3], v, 0.0, omega, dt), v, omega]
            )
            self.time += dt
        still = abs(self.state[3]) < 1e-9 and abs(self.state[4]) < 1e-9
        self.rested = self.rested + PERIOD if still else 0.0
        if depth(self.world.after(self.time), self.state[:3]) > 1e-6:
            self.hits.append(self.rested)
        self.plans.append(plan)
        return plan

    def reach(self, seconds: float) -> bool:
        """Drive until the goal is reached or the time is up."""
        while self.time < seconds:
            self.step()
            off = self.goal.pose - self.state[:3]
            near = math.hypot(off[0], off[1]) <= 0.1 and abs(wrap(off[2])) <= 0.35
            if near and (not self.goal.stop or self.rested > 0.0):
                return True
        return False


def random_movers(rng: np.random.Generator, way: Array, count: int) -> list[Disc | Obstacle]:
    """Obstacles that come past the straight way about when the base does, or at any time."""
    movers: list[Disc | Obstacle] = []
    while len(movers) < count:
        share, angle = rng.random(), rng.uniform(0.0, math.tau)
        velocity = rng.uniform(0.1, 0.5) * np.array([math.cos(angle), math.sin(angle)])
        when = max(0.0, share * 12.0 + rng.uniform(-3.0, 3.0))
        begin = way[0] + share * (way[1] - way[0]) - when * velocity
        if math.dist(begin, way[0]) < 1.5:
            continue
        radius = rng.uniform(0.1, 0.3)
        if rng.random() < 0.5:
            movers.append(Disc(begin, radius, velocity))
        else:
            movers.append(Obstacle(polygons.disc(radius, 5) + begin, (), velocity))
    return movers


@given(seed=st.integers(0, 10**6), margin=st.sampled_from([0.0, 0.05]))
@settings(max_examples=60, deadline=None)
def test_the_prediction_agrees_with_shapely(seed: int, margin: float) -> None:
    rng = np.random.default_rng(seed)
    ring = polygons.disc(0.9, 8)
    world = World([
        Disc(rng.uniform(-1.5, 1.5, 2), 0.3, rng.uniform(-0.5, 0.5, 2)),
        Obstacle(ring + rng.uniform(-1.0, 1.0, 2), (), rng.uniform(-0.5, 0.5, 2)),
        Obstacle(3.0 * ring, (2.5 * ring,), (0.1, 0.3)),
        Disc((0.0, 0.0), 0.2),  # does not move
    ])  # fmt: skip
    movers = movers_of(world.solids)
    time, pose = rng.uniform(0.0, 4.0), np.array([*rng.uniform(-3, 3, 2), rng.uniform(-3, 3)])
    base = Polygon(polygons.place(polygons.rectangle(0.68 + 2 * margin, 0.47 + 2 * margin), pose))
    moved = [Polygon(s.outline, s.holes) for s in world.after(time).solids if s.moves]
    overlap = max(base.intersection(solid).area for solid in moved)
    met = meets_mover(movers, OUTLINE, margin, *with_direction(pose), time)
    if overlap == 0.0 or overlap > 1e-9:
        # beyond the true distance the sharp corners of the grown outline don't count
        near = Polygon(polygons.place(BOX, pose)).distance(moved[0].union(moved[1]).union(moved[2]))
        assert met == (overlap > 0.0) or (not met and near >= margin)
    nearness = nearness_of_movers(movers, OUTLINE, pose[0], pose[1], time)
    circle = min(solid.boundary.distance(base.centroid) for solid in moved) - OUTLINE.inner
    assert nearness == pytest.approx(1.0 - min(max(circle, 0.0), 1.0), abs=1e-9)


def test_nothing_thin_slips_through_between_two_checks() -> None:
    needle = Obstacle(polygons.rectangle(0.01, 0.01) + np.array([0.0, -3.0]), (), (0.0, 20.0))
    movers = movers_of(World([needle]).solids)
    times = np.arange(0.0, 0.4, 0.1)
    place = with_direction(np.zeros(3))
    assert not any(meets_mover(movers, OUTLINE, 0.0, *place, time) for time in times)
    grown = half_way(movers, OUTLINE, 0.0, 0.0, 0.1)
    assert any(meets_mover(movers, OUTLINE, grown, *place, time) for time in times)


def test_it_waits_for_what_crosses_and_then_goes_on(planner: StaaStar) -> None:
    wall = Obstacle(polygons.rectangle(0.4, 6.0) + np.array([2.0, -1.0]), (), (0.0, 0.5))
    run = Run(planner, World([wall]), np.zeros(3), Goal(np.array([4.0, 0.0, 0.0])))
    assert run.reach(25.0)
    assert not run.hits


def test_a_blocked_stand_is_caught(planner: StaaStar) -> None:
    """Planted: braking ends where something comes by; the brake must not be called safe."""
    pose = np.zeros(3)
    for velocity, safe in ((-0.5, False), (0.5, True)):
        planner.update(World([Disc((0.12, 0.9), 0.2, (0.0, velocity))]))
        ways = ways_from(planner, pose, 0.3)
        assert ways.can_stand(1.0)[-1] == safe
        assert ways.safe(1.0, 5.0)[-1] == safe
        assert planner.brake(pose, 0.3, 0.0).emergency != safe
    planner.update(World([Disc((0.12, 0.9), 0.2, (0.0, -0.5))]))
    fleeing = planner.plan(pose, 0.3, 0.0, Goal(np.array([4.0, 0.0, 0.0])))
    assert fleeing.acceleration[0] >= 0.0  # on, out of its way


def ways_from(planner: StaaStar, pose: Array, v: float) -> WaysOut:
    """Ways out of a planner's world."""
    root, _ = planner._root(pose, v, 0.0, NOWHERE, NO_ACTIONS, NO_ACTIONS)
    assert root.ways is not None
    return root.ways


@pytest.mark.parametrize("seed", range(8))
def test_ways_out_last_as_long_as_they_say(planner: StaaStar, seed: int) -> None:
    """What is called safe for so long is driven, and judged by shapely."""
    rng = np.random.default_rng(200 + seed)
    world = World(random_movers(rng, np.array([[0.0, 0.0], [2.0, 0.0]]), 8))
    planner.update(world)
    plan = planner.brake(np.zeros(3), 0.4, 0.5)
    last = lasts_of(planner, plan.way_out)
    pose, v, omega, time = np.zeros(3), 0.4, 0.5, 0.0
    for row in plan.way_out:
        for _ in range(round(row[4] / PERIOD)):
            v1 = v + float(np.clip(row[1] - v, -row[0] * PERIOD, row[0] * PERIOD))
            w1 = omega + float(np.clip(row[3] - omega, -row[2] * PERIOD, row[2] * PERIOD))
            mean = 0.5 * (v + v1), 0.5 * (omega + w1)
            pose = se2.integrate_twist(pose, mean[0], 0.0, mean[1], PERIOD)
            v, omega, time = v1, w1, time + PERIOD
            assert depth(world.after(time), pose) < 1e-6 or time > last - 0.3


def lasts_of(planner: StaaStar, actions: Array) -> float:
    """How long a planner thinks that actions last from the origin."""
    root, _ = planner._root(np.zeros(3), 0.4, 0.5, NOWHERE, NO_ACTIONS, NO_ACTIONS)
    return planner._time_of(root, actions)


def test_standing_in_the_way_it_drives_out_of_it(planner: StaaStar) -> None:
    world = World([Disc((3.0, 0.0), 0.3, (-0.5, 0.0))])
    run = Run(planner, world, np.array([0.0, 0.0, math.pi / 2]), Goal(np.zeros(3), stop=True))
    while run.time < 10.0:
        run.step()
    assert not run.hits


def test_what_rests_is_kept_when_something_moves() -> None:
    world = World([Disc((2.0, 0.0), 0.3), Disc((0.0, 3.0), 0.2, (0.1, 0.0))])
    planner = staa(world)
    before = planner.planner.world
    planner.update(world.after(1.0))
    assert planner.planner.world is before
    assert len(before.solids) == 1
    planner.update(World([Disc((2.0, 0.5), 0.3)]))
    assert planner.planner.world is not before
    assert len(planner.planner.world.solids) == 1


@pytest.mark.parametrize("seed", range(6))
def test_random_crossings_without_contact(planner: StaaStar, seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal = Goal(np.array([4.0, rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)]), seed % 2 == 1)
    movers = random_movers(rng, np.array([[0.0, 0.0], goal.pose[:2]]), 1 + seed)
    run = Run(planner, World(movers), np.zeros(3), goal)
    assert run.reach(60.0)  # in one of them, something as fast as the base follows it for 20 s
    assert all(rested >= 1.0 for rested in run.hits)
    for plan in run.plans[::5]:
        if not plan.emergency:
            assert math.isfinite(plan.cost_to_go)


@pytest.mark.parametrize("seed", range(12))
def test_every_braking_arc_and_the_stand_after_it_are_free(planner: StaaStar, seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    movers = random_movers(rng, np.array([[0.0, 0.0], [4.0, 0.0]]), 4)
    world = World([*movers, Disc(rng.uniform(1.0, 3.0, 2), 0.3)])
    run = Run(planner, world, np.zeros(3), Goal(np.array([4.0, 0.0, 0.0])))
    while run.time < 4.0:
        begun, v, omega = run.time, run.state[3], run.state[4]
        plan = run.step()
        if plan.emergency:
            continue
        v, omega = run.state[3], run.state[4]
        duration = max(abs(v) / LIMITS.a_max, abs(omega) / LIMITS.alpha_max)
        count = len(plan.braking)
        for k in range(0, count, 4):
            share = k / max(count - 1, 1)
            when = begun + PERIOD + (1.0 - math.sqrt(1.0 - share)) * duration
            assert depth(world.after(when), plan.braking[k]) < 1e-6
        for stood in (0.0, 0.5, 1.0):
            when = begun + PERIOD + duration + stood
            assert depth(world.after(when), plan.braking[-1]) < 1e-6
