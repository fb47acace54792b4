"""Drives in closed loop: what is measured is so, and what goes wrong is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely.geometry import Polygon

from motm_wbc.basenav.obstacle import Disc
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.experiments.nav import drive as module
from motm_wbc.experiments.nav.drive import drive
from motm_wbc.geometry import polygons
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
TABLE = polygons.rectangle(1.0, 1.0) + np.array([2.0, 0.2])
FLOOR = polygons.rectangle(12.0, 6.0)
START = np.zeros(3)
QUICK = StaaParameters(expansions=30)


def go(world, goal, **options):
    return drive(world, BOX, LIMITS, options.pop("start", START), np.array(goal), **options)


@pytest.fixture(scope="module")
def world() -> World:
    return World([TABLE], FLOOR)


@pytest.mark.parametrize("stop", [False, True])
def test_a_goal_is_reached_and_the_figures_hold(world, stop):
    result = go(world, (4.0, 0.5, 0.6), stop=stop)
    assert result.success and result.failure_reason is None
    rows = result.trajectory
    assert result.time_s == pytest.approx(rows[-1, 0])
    assert math.dist(rows[-1, 1:3], (4.0, 0.5)) <= 0.10 and abs(rows[-1, 3] - 0.6) <= 0.35
    assert (np.abs(rows[-1, 4:]).max() < 1e-6) == stop
    steps = np.hypot(*np.diff(rows[:, 1:3], axis=0).T)
    assert result.path_length_m == pytest.approx(steps.sum())
    rates = np.abs(np.diff(rows[:, 4:], axis=0)) * 120.0
    assert rates[:, 0].max() <= 0.5 + 1e-6 and rates[:, 1].max() <= 2.0 + 1e-6
    assert result.max_speed_excess == result.max_acceleration_excess == 0.0
    table = Polygon(TABLE)
    floor = Polygon(FLOOR).exterior
    placed = [Polygon(polygons.place(BOX, row[1:4])) for row in rows]
    least = min(min(one.distance(table), one.distance(floor)) for one in placed)
    assert result.min_clearance_m == pytest.approx(least, abs=1e-9)
    assert result.collisions == 0 and result.step_ms is not None


def test_equal_input_gives_equal_output(world):
    first, second = (go(world, (3.5, -0.5, 0.0), seed=4, noise=(0.005, 0.005)) for _ in range(2))
    assert np.array_equal(first.trajectory, second.trajectory)
    other = go(world, (3.5, -0.5, 0.0), seed=5, noise=(0.005, 0.005))
    assert not np.array_equal(first.trajectory[:200], other.trajectory[:200])
    assert first.success and other.success


def test_a_drive_may_begin_at_speed(world):
    result = go(world, (-2.0, -2.0, 0.0), start=np.array([-4.0, -2.0, 0.0]), velocity=(0.5, 0.0))
    assert result.success
    assert result.trajectory[0, 4] == 0.5
    assert result.time_s is not None and result.time_s < 4.0


def test_no_way_is_said_at_once():
    wall = polygons.rectangle(0.2, 8.0) + np.array([2.0, 0.0])
    result = go(World([wall], FLOOR), (4.0, 0.0, 0.0))
    assert not result.success and result.collisions == 0
    assert result.failure_reason is not None and result.failure_reason.startswith("no path")
    assert result.time_s is None and result.global_path_length_m is None


def test_a_gap_that_the_footprint_just_fits_through_is_tried():
    posts = [polygons.rectangle(0.4, 2.7) + np.array([2.0, y]) for y in (1.62, -1.62)]
    result = go(World(posts, FLOOR), (4.0, 0.0, 0.0))  # 0.54 m wide; the base has 0.47 m
    assert result.success and result.inflation_m == pytest.approx(0.255)


def test_a_gap_that_leaves_no_margin_is_no_way():
    posts = [polygons.rectangle(0.4, 2.7) + np.array([2.0, y]) for y in (1.602, -1.602)]
    result = go(World(posts, FLOOR), (4.0, 0.0, 0.0))  # 0.504 m wide; 0.47 m and twice 0.02 m
    assert result.failure_reason is not None and result.failure_reason.startswith("no path")


def test_a_base_wider_than_it_reaches_back_does_not_try_a_gap_of_less():
    fork = polygons.rectangle(2.0, 1.0) + np.array([0.6, 0.0])  # 0.4 m behind the axle
    posts = [polygons.rectangle(0.4, 3.0) + np.array([4.0, y]) for y in (1.95, -1.95)]  # 0.9 m
    floor = polygons.rectangle(12.0, 6.0) + np.array([2.0, 0.0])
    world = World(posts, floor)
    result = drive(world, fork, LIMITS, np.array([-1.0, 0, 0]), np.array([6.0, 0, 0]))
    assert result.failure_reason is not None and result.failure_reason.startswith("no path")


def test_the_time_limit_ends_a_drive(world):
    result = go(world, (5.0, 0.0, 0.0), time_limit=1.0)
    assert not result.success
    assert result.failure_reason is not None and "time limit of 1.0 s" in result.failure_reason
    assert result.trajectory[-1, 0] == pytest.approx(1.0)


def test_what_can_not_get_on_is_stuck():
    narrow = [polygons.rectangle(1.0, 2.0) + np.array([2.0, y]) for y in (1.2, -1.2)]
    floor = polygons.rectangle(12.0, 4.0)
    result = go(World(narrow, floor), (4.0, 0.0, 0.0), inflation=0.15, staa=QUICK)  # 0.4 m
    assert not result.success and result.collisions == 0
    assert result.failure_reason is not None and result.failure_reason.startswith("stuck at")


def test_a_contact_is_found_and_ends_the_drive(world, monkeypatch):
    class Blind(module.Navigator):
        """Drives as if there were nothing in the way."""

        def __init__(self, _, *rest, **named):
            super().__init__(World([]), *rest, **named)

    monkeypatch.setattr(module, "Navigator", Blind)
    result = go(world, (4.0, 0.2, 0.0))
    assert not result.success and (result.collisions, result.excused) == (1, 0)
    assert result.min_clearance_m == 0.0
    assert result.failure_reason is not None
    assert result.failure_reason.startswith("collision at (1.15")


def test_being_run_into_at_rest_is_excused(monkeypatch):
    hasty = World([Disc((1.5, 0.0), 0.3, (-0.5, 0.0))])

    class Asleep(module.Navigator):
        """Never moves."""

        def step(self, time, pose, v, omega, goal, world=None):
            plan = self._planner.brake(pose, v, omega)
            return module.NavStep((0.0, 0.0), plan, module.NavStatus.DRIVING)

    monkeypatch.setattr(module, "Navigator", Asleep)
    result = go(hasty, (4.0, 0.0, 0.0))
    assert (result.collisions, result.excused) == (1, 1)
    assert result.failure_reason is not None and "run into at rest" in result.failure_reason
    moving = drive(hasty, BOX, LIMITS, START, np.array([4.0, 0.0, 0.0]), velocity=(0.3, 0.0))
    assert (moving.collisions, moving.excused) == (1, 0)


def test_commands_beyond_the_limits_are_counted(world, monkeypatch):
    class Wild(module.Navigator):
        """Asks for more than there is."""

        def step(self, *args, **named):
            step = super().step(*args, **named)
            return module.NavStep((0.6, 0.0), step.plan, step.status)

    monkeypatch.setattr(module, "Navigator", Wild)
    result = go(world, (-5.0, 0.0, 0.0), start=np.array([-5.5, -2.0, 0.0]), time_limit=1.2)
    assert result.max_acceleration_excess == pytest.approx(0.2)
    assert result.max_speed_excess > 0.01
    assert np.abs(result.trajectory[:, 4]).max() <= 0.5


def test_the_world_moves_on(world):
    seen = []
    cart = World([Disc((2.0, 2.0), 0.3, (0.0, -0.4))], FLOOR)
    result = go(cart, (4.0, 0.0, 0.0), time_limit=0.5, observer=seen.append)
    assert [moment.time for moment in seen] == pytest.approx(np.arange(10) * 0.05)
    centres = [moment.world.obstacles[0].mean(axis=0)[1] for moment in seen]
    assert np.diff(centres) == pytest.approx(-0.02)
    assert not result.success


@pytest.mark.parametrize("bad", [(0.0, 0.0), (0.0, 0.0, math.nan)])
def test_bad_poses_are_refused(world, bad):
    with pytest.raises(InputError, match="goal"):
        go(world, bad)
    with pytest.raises(InputError, match="start"):
        go(world, (0.0, 0.0, 0.0), start=np.array(bad))
