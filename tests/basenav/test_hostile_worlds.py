"""Input that nobody means to give: a clear error or a right answer, soon."""

import math
import time

import numpy as np
import pytest

from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.obstacle import Disc, Obstacle
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry.polygons import disc, rectangle

SQUARE = rectangle(2.0, 2.0)


def grid_of(count, spacing, size):
    """`count` x `count` squares."""
    places = spacing * (np.arange(count) - 0.5 * (count - 1))
    return [rectangle(size, size) + np.array([x, y]) for x in places for y in places]


@pytest.mark.parametrize("shift", [1e5, 1e6, -1e6])
def test_far_from_the_origin_paths_are_the_same(shift):
    away = np.array([shift, -shift])
    near = GlobalPlanner(World(grid_of(6, 2.0, 0.9)), 0.5, 1.745, inflation=0.2)
    far = GlobalPlanner(
        World([points + away for points in grid_of(6, 2.0, 0.9)]), 0.5, 1.745, inflation=0.2
    )
    for start, goal in ((-6.0, -5.7), (6.0, 5.1)), ((-2.1, 3.0), (4.0, -0.3)):
        here = near.plan((*start, 0.3), (*goal, 1.0))
        there = far.plan((start[0] + shift, start[1] - shift, 0.3), (*(goal + away), 1.0))
        assert there.time == pytest.approx(here.time, abs=1e-6)


def test_coordinates_that_nothing_can_be_told_from_are_refused():
    with pytest.raises(InputError, match="beyond") as caught:
        World([SQUARE, SQUARE + 1e9])
    assert caught.value.where == "obstacles[1]"


def test_tiny_obstacles_bend_a_path():
    dust = [rectangle(1e-4, 1e-4) + np.array([0.1 * k, 0.0]) for k in range(60)]
    nav = GlobalPlanner(World(dust), 0.5, 1.745)
    path = nav.plan((-1.0, 0.0, None), (7.0, 0.0, None))
    assert 8.0 < path.length < 8.0 + 1e-6
    assert path.time == pytest.approx(cost_to_go(nav.goal_field((7, 0, None)), -1, 0, math.nan))
    grown = GlobalPlanner(World(dust), 0.5, 1.745, inflation=0.2)
    assert grown.plan((-1.0, 0.0, None), (7.0, 0.0, None)).length > 8.0


def test_start_is_goal_in_a_large_world():
    nav = GlobalPlanner(World(grid_of(12, 2.0, 0.9)), 0.5, 1.745, inflation=0.2)
    path = nav.plan((0.0, 0.0, 0.5), (0.0, 0.0, -0.5))
    assert path.length == 0.0
    assert path.time == pytest.approx(1.0 / 1.745)


def test_a_symmetric_world_of_touching_squares():
    nav = GlobalPlanner(World(grid_of(7, 1.0, 1.0)), 0.5, 1.745)  # one block of 7 x 7 m
    path = nav.plan((-4.0, 0.0, None), (4.0, 0.0, None))
    assert path.length == pytest.approx(7.0 + 2.0 * math.hypot(0.5, 3.5))
    with pytest.raises(NoPath, match="goal"):
        nav.plan((-4.0, 0.0, None), (0.5, 0.0, None))  # on the edge between two


def test_the_same_obstacle_many_times_is_one():
    once = GlobalPlanner(World([SQUARE]), 0.5, 1.745, inflation=0.3)
    often = GlobalPlanner(World([SQUARE] * 60), 0.5, 1.745, inflation=0.3)
    start, goal = (-3.0, 0.1, 0.0), (3.0, 0.0, 0.0)
    assert often.plan(start, goal).time == pytest.approx(once.plan(start, goal).time, abs=1e-12)


@pytest.mark.parametrize("goal", [(30.0, 0.0, None), (1e7, 0.0, 0.0), (0.0, -13.01, None)])
def test_goals_outside_the_boundary(goal):
    nav = GlobalPlanner(World(grid_of(12, 2.0, 0.9), rectangle(26.0, 26.0)), 0.5, 1.745, 0.1)
    with pytest.raises(NoPath, match="goal"):
        nav.plan((0.0, 0.0, 0.0), goal)


def test_far_away_goals_of_an_open_world():
    nav = GlobalPlanner(World(grid_of(12, 2.0, 0.9)), 0.5, 1.745)
    assert nav.plan((0.0, 0.0, 0.0), (1e7, 0.0, None)).length == pytest.approx(1e7, rel=1e-6)
    for far in (1e8, 1e160, 1e308):
        with pytest.raises(InputError, match="within"):
            nav.plan((0.0, 0.0, 0.0), (far, 0.0, None))
    for far in (1e160, 1e308, math.inf, math.nan):
        assert nav.world.near(0.0, (far, -far), (0.0, far), far) is nav.world.inflated(0.0)


def test_a_floor_that_leaves_no_room():
    nav = GlobalPlanner(World(grid_of(8, 0.2, 0.1), rectangle(2.0, 2.0)), 0.5, 1.745, 1.1)
    with pytest.raises(NoPath):
        nav.plan((0.0, 0.95, 0.0), (0.95, 0.0, 0.0))


def test_numbers_that_are_none_are_refused():
    nav = GlobalPlanner(World(grid_of(6, 2.0, 0.9)), 0.5, 1.745)
    with pytest.raises(InputError, match="near"):
        nav.goal_field((1, 1, None), near=(math.nan, 0.0, 0.0))
    with pytest.raises(InputError, match="reach"):
        nav.goal_field((1, 1, None), near=(0.0, 0.0, 0.0), reach=math.nan)
    with pytest.raises(InputError, match="transforms"):
        nav.world.transformed(np.full((36, 3), math.nan))
    with pytest.raises(InputError, match="transforms"):
        nav.world.transformed([["x"]])
    with pytest.raises(InputError, match="time"):
        nav.world.after(math.inf)
    with pytest.raises(InputError, match="velocity"):
        World([Disc((0.0, 0.0), 1.0, (math.nan, 0.0))])
    with pytest.raises(InputError, match="holes"):
        World([Obstacle(SQUARE, (2.0 * SQUARE,))])


def test_two_thousand_obstacles_take_no_longer_than_what_is_near():
    rng = np.random.default_rng(0)
    places = rng.uniform(-40.0, 40.0, (2000, 2))
    places = places[np.hypot(*places.T) > 1.5]
    ring = [rectangle(90.0, 0.2) + np.array([0.0, y]) for y in (-45.0, 45.0)]
    ring += [rectangle(0.2, 90.2) + np.array([x, 0.0]) for x in (-45.0, 45.0)]
    world = World([*(disc(0.3, 6) + place for place in places), *ring])
    nav = GlobalPlanner(world, 0.5, 1.745, inflation=0.2, v_reverse=0.2)
    nav.plan((0.0, 0.0, 0.0), (0.3, 0.0, 0.0))  # compiled
    begin = time.process_time()
    assert nav.plan((0.0, 0.0, 0.0), (0.5, 4.0, None)).length < 8.0
    with pytest.raises(NoPath, match="no path"):
        nav.plan((0.0, 0.0, 0.0), (60.0, 0.0, None))  # behind the wall about all
    assert time.process_time() - begin < 5.0
