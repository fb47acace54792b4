"""The navigator's one step: what is driven, refused, reached, and said."""

from __future__ import annotations

import math

import numpy as np
import pytest

from motm_wbc.basenav import Goal, Navigator, NavStatus, World
from motm_wbc.basenav.navigator import disc_radius, fitting_inflation, half_width
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
FLOOR = polygons.rectangle(10.0, 6.0)
GOAL = Goal(np.array([2.0, 0.0, 0.0]))
PERIOD = 0.05


@pytest.fixture
def navigator() -> Navigator:
    return Navigator(World([polygons.disc(0.3) + np.array([1.0, 2.0])], FLOOR), BOX, LIMITS)


def test_it_drives_and_says_when_it_is_there(navigator):
    pose, v, statuses = np.zeros(3), np.zeros(2), []
    for k in range(120):
        step = navigator.step(PERIOD * k, pose, v[0], v[1], GOAL)
        statuses.append(step.status)
        after = v + PERIOD * np.array(step.acceleration)
        mean = 0.5 * (v + after)
        pose, v = se2.integrate_twist(pose, mean[0], 0.0, mean[1], PERIOD), after
    first = statuses.index(NavStatus.REACHED)
    assert set(statuses[:first]) == {NavStatus.DRIVING}
    assert set(statuses[first:]) == {NavStatus.REACHED}  # latched
    assert np.abs(v).max() < 1e-9  # nobody has given another goal


@pytest.mark.parametrize("bad", [math.nan, math.inf, "fast", None])
@pytest.mark.parametrize("where", ["time", "pose", "v", "omega"])
def test_a_state_that_is_no_use_makes_it_brake(navigator, bad, where):
    navigator.step(0.0, np.zeros(3), 0.4, 0.2, GOAL)
    state = {"time": 0.05, "pose": np.array([0.02, 0.0, 0.0]), "v": 0.4, "omega": 0.2}
    state[where] = [bad, 0.0, 0.0] if where == "pose" else bad
    step = navigator.step(state["time"], state["pose"], state["v"], state["omega"], GOAL)
    assert step.status is NavStatus.REFUSED and step.message
    assert step.acceleration[0] < -0.4
    for _ in range(40):  # and stays at it
        step = navigator.step(math.nan, np.zeros(3), math.nan, math.nan, GOAL)
        assert step.status is NavStatus.REFUSED
    assert step.acceleration == pytest.approx((0.0, 0.0), abs=1e-9)
    assert navigator.step(3.0, np.zeros(3), 0.0, 0.0, GOAL).status is NavStatus.DRIVING


def test_a_stale_state_makes_it_brake(navigator):
    navigator.step(1.0, np.zeros(3), 0.4, 0.0, GOAL)
    for time in (1.0, 0.5):
        step = navigator.step(time, np.zeros(3), 0.4, 0.0, GOAL)
        assert step.status is NavStatus.REFUSED and "stale" in step.message
        assert step.acceleration[0] < 0.0


@pytest.mark.parametrize("pose", [np.array([1.0, math.nan, 0.0]), np.zeros(2), "there", None])
def test_a_goal_that_is_no_use_makes_it_brake(navigator, pose):
    step = navigator.step(0.0, np.zeros(3), 0.4, 0.0, Goal(pose))
    assert step.status is NavStatus.REFUSED
    assert step.acceleration[0] < 0.0


def test_a_world_that_is_no_use_makes_it_brake(navigator):
    step = navigator.step(0.0, np.zeros(3), 0.4, 0.0, GOAL, world="garden")
    assert step.status is NavStatus.REFUSED and step.message == "a World is needed, got str"
    step = navigator.step(0.02, np.zeros(3), 0.4, 0.0, None)
    assert step.status is NavStatus.REFUSED and step.message == "a Goal is needed, got NoneType"
    assert step.acceleration[0] < 0.0
    assert navigator.step(0.05, np.zeros(3), 0.4, 0.0, GOAL).status is NavStatus.DRIVING


def test_another_world_is_minded(navigator):
    wall = polygons.rectangle(0.2, 8.0) + np.array([1.0, 0.0])
    step = navigator.step(0.0, np.zeros(3), 0.0, 0.0, GOAL, World([wall], FLOOR))
    assert step.status is NavStatus.BLOCKED and "no path" in step.message
    step = navigator.step(0.05, np.zeros(3), 0.0, 0.0, GOAL, World([], FLOOR))
    assert step.status is NavStatus.DRIVING


def test_no_progress_is_reported(navigator):
    statuses = [navigator.step(0.5 * k, np.zeros(3), 0.0, 0.0, GOAL).status for k in range(30)]
    assert statuses[0] is NavStatus.DRIVING and statuses[-1] is NavStatus.STUCK
    another = Goal(np.array([-2.0, 0.0, 0.0]))
    assert navigator.step(20.0, np.zeros(3), 0.0, 0.0, another).status is NavStatus.DRIVING


def test_the_disc_lies_between_half_the_width_and_the_outer_radius():
    assert half_width(BOX) == pytest.approx(0.235)
    assert half_width(BOX[::-1] + 0.1) == pytest.approx(0.135)
    assert half_width(BOX + [0.3, 0.0]) == pytest.approx(0.235)  # the axle near the rear edge
    assert half_width(BOX[:, ::-1]) == pytest.approx(0.34)  # wider than long
    assert half_width(BOX + 1.0) == 0.0
    assert 0.235 < disc_radius(BOX) < math.hypot(0.34, 0.235)
    assert disc_radius(polygons.disc(0.3, 64)) == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize(
    ("gap", "expected"), [(0.7, disc_radius(BOX)), (0.54, 0.255), (0.3, 0.255)]
)
def test_a_narrow_gap_gets_a_disc_of_the_width(gap, expected):
    posts = [polygons.rectangle(0.4, 4.0) + np.array([1.0, y * (2.0 + 0.5 * gap)]) for y in (-1, 1)]
    found = fitting_inflation(World(posts, FLOOR), BOX, LIMITS, np.zeros(3), GOAL.pose, 0.02)
    assert found == pytest.approx(expected)


def test_unknown_planners_are_refused():
    with pytest.raises(InputError, match="did you mean 'staa'"):
        Navigator(World([]), BOX, LIMITS, planner="stas")
