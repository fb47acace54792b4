"""The global planner: paths worked out by hand, degenerate input, and properties."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Polygon

from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.pathrtr import Speeds, path_time
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry.polygons import disc, rectangle

SQUARE = rectangle(2.0, 2.0)  # corners at +-1


def planner(obstacles, boundary=None, **settings):
    return GlobalPlanner(World(obstacles, boundary), v_max=0.5, omega_max=1.0, **settings)


def test_open_floor_is_a_straight_line():
    path = planner([]).plan((0, 0, math.pi / 2), (3, 4, None))
    assert path.points.tolist() == [[0, 0], [3, 4]]
    assert path.length == 5.0
    assert path.time == pytest.approx(10.0 + math.pi / 2 - math.atan2(4, 3))
    assert not path.backward


def test_a_path_runs_along_the_edge_of_a_square():
    path = planner([SQUARE]).plan((-2, 0, None), (2, 0, None))
    assert path.length == pytest.approx(2 + 2 * math.sqrt(2))
    assert path.time == pytest.approx(path.length / 0.5 + math.pi / 2)
    assert len(path.points) == 4
    assert abs(path.points[1:3, 1]) == pytest.approx([1.0, 1.0])


def test_the_heading_chooses_the_side():
    above = planner([SQUARE]).plan((-2, 0, math.pi / 2), (2, 0, None))
    below = planner([SQUARE]).plan((-2, 0, -math.pi / 2), (2, 0, None))
    assert above.points[1, 1] == pytest.approx(1.0)
    assert below.points[1, 1] == pytest.approx(-1.0)


def test_a_longer_path_with_less_turning_wins():
    # the short way round the wall's end needs a turn of about pi, the other one less
    wall = rectangle(0.2, 4.0) + np.array([0.0, 0.5])
    slow_turns = GlobalPlanner(World([wall]), v_max=1.0, omega_max=0.2)
    assert slow_turns.plan((-0.3, 0, math.pi / 2), (0.3, 0, -math.pi / 2)).points[1, 1] > 0.0
    fast_turns = GlobalPlanner(World([wall]), v_max=1.0, omega_max=1e9)
    assert fast_turns.plan((-0.3, 0, math.pi / 2), (0.3, 0, -math.pi / 2)).points[1, 1] < 0.0


def test_backing_up_is_chosen_where_it_is_faster():
    goal = (-0.4, 0.0, 0.0)
    assert planner([], v_reverse=0.2).plan((0, 0, 0.0), goal).backward
    assert planner([], v_reverse=0.2).plan((0, 0, 0.0), goal).time == pytest.approx(2.0)
    ahead = planner([]).plan((0, 0, 0.0), goal)
    assert not ahead.backward
    assert ahead.time == pytest.approx(0.8 + math.tau)


def test_start_is_goal():
    path = planner([SQUARE]).plan((3, 0, 0.5), (3, 0, -0.5))
    assert path.time == pytest.approx(1.0)
    assert path.length == 0.0
    assert path.points.tolist() == [[3, 0]]
    assert planner([]).plan((3, 0, None), (3, 0, -0.5)).time == 0.0


def test_unreachable_goals_and_places_inside_obstacles_have_no_path():
    yard = [rectangle(6.0, 1.0) + np.array([0, y]) for y in (-3, 3)]
    yard += [rectangle(1.0, 6.0) + np.array([x, 0]) for x in (-3, 3)]
    closed = planner(yard)
    with pytest.raises(NoPath):
        closed.plan((0, 0, None), (9, 0, None))
    assert cost_to_go(closed.goal_field((9, 0, None)), 0.0, 0.0, 0.0) == math.inf
    with pytest.raises(NoPath, match="start"):
        planner([SQUARE]).plan((0, 0, None), (9, 0, None))
    with pytest.raises(NoPath, match="goal"):
        planner([SQUARE]).plan((9, 0, None), (0, 0, None))
    with pytest.raises(NoPath, match="goal"):
        planner([], boundary=rectangle(4.0, 4.0)).plan((0, 0, None), (9, 0, None))


def test_no_way_out_between_obstacles_that_touch():
    corners_touch = [SQUARE + np.array([x, y]) for x, y in ((2, 0), (0, 2), (-2, 0), (0, -2))]
    with pytest.raises(NoPath):
        planner(corners_touch).plan((0, 0, None), (9, 0, None))
    gap = [SQUARE + np.array([2.001, 0]), *corners_touch[1:]]
    assert planner(gap).plan((0, 0, None), (9, 0, None)).length > 9.0


def test_inside_an_inflated_obstacle_it_is_pushed_out_and_says_so():
    nav = planner([SQUARE], inflation=0.3)
    path = nav.plan((-1.29, 0.0, 0.0), (1.2, 0.0, None))
    assert path.start_push == pytest.approx(0.01)
    assert path.goal_push == pytest.approx(0.1)
    assert path.points[0].tolist() == [-1.29, 0.0]
    assert path.points[1] == pytest.approx([-1.3, 0.0])
    assert path.points[-1].tolist() == [1.2, 0.0]
    inner = path_time(path.points[1:-1], 0.0, None, nav.speeds)
    assert path.time == pytest.approx(inner + 0.11 / 0.5)
    field = nav.goal_field((1.2, 0.0, None))
    assert cost_to_go(field, -1.29, 0.0, 0.0) == pytest.approx(path.time, abs=1e-9)


def test_a_pocket_is_no_way_out():
    # between the three, inflated, lies a pocket that is closed; its points are nearest
    nav = planner(
        [
            disc(0.5) + np.array([0.0, 1.0]),
            disc(0.5) + np.array([0.87, -0.5]),
            disc(0.5) + np.array([-0.87, -0.5]),
        ],
        inflation=0.4,
    )
    assert len(nav.inflated.region.geoms[0].interiors) == 1
    path = nav.plan((0.0, 0.12, 0.0), (5.0, 0.0, None))
    assert path.start_push > 0.2
    assert cost_to_go(nav.goal_field((5.0, 0.0, None)), 0.0, 0.12, 0.0) == pytest.approx(path.time)


@pytest.mark.parametrize("bad", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, math.inf), (0, 0), "x"])
def test_bad_poses_are_refused(bad):
    with pytest.raises(InputError, match="start"):
        planner([]).plan(bad, (1, 0, None))
    with pytest.raises(InputError, match="goal"):
        planner([]).goal_field(bad)


@pytest.mark.parametrize(
    ("name", "value"), [("v_max", 0.0), ("omega_max", math.nan), ("v_reverse", -0.1)]
)
def test_bad_speeds_are_refused(name, value):
    speeds = {"v_max": 0.5, "omega_max": 1.0, name: value}
    with pytest.raises(InputError, match=name):
        GlobalPlanner(World([]), **speeds)


def test_fields_are_kept_for_each_goal():
    nav = planner([SQUARE])
    first = nav.goal_field((3, 0, None))
    assert nav.goal_field((3, 0, math.nan)) is first
    assert nav.goal_field((3, 0, 0.0)) is not first


def test_collinear_corners_are_passed_straight():
    row = [rectangle(1.0, 1.0) + np.array([x, 0.0]) for x in (0.0, 2.0, 4.0, 6.0)]
    path = planner(row).plan((-1.0, 0.5, 0.0), (8.0, 0.5, 0.0))
    assert path.length == 9.0
    assert path.time == pytest.approx(18.0, abs=1e-12)
    around = planner(row).plan((-1.0, 0.0, None), (7.0, 0.0, None))
    assert around.length == pytest.approx(7.0 + 2 * math.hypot(0.5, 0.5))


def test_answers_are_the_same_to_the_bit():
    rng = np.random.default_rng(3)
    obstacles = [disc(0.4, 7) + rng.uniform(-3, 3, 2) for _ in range(8)]
    first, second = planner(obstacles, inflation=0.1), planner(obstacles, inflation=0.1)
    for _ in range(20):
        a, b = rng.uniform(-4, 4, 3), rng.uniform(-4, 4, 3)
        paths = [nav.route(a, b) for nav in (first, second)]
        assert (paths[0] is None) == (paths[1] is None)
        if paths[0] is not None:
            assert paths[0].points.tobytes() == paths[1].points.tobytes()
            assert paths[0].time == paths[1].time


coordinate = st.floats(-4.0, 4.0)
angle = st.floats(-math.pi, math.pi)
boxes = st.lists(
    st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.2, 2), st.floats(0.2, 2)),
    min_size=1,
    max_size=4,
)


@settings(max_examples=60, deadline=None)
@given(boxes, st.tuples(coordinate, coordinate, angle), st.tuples(coordinate, coordinate, angle))
def test_paths_are_free_and_as_fast_as_the_field_says(sizes, start, goal):
    obstacles = [rectangle(w, h) + np.array([x, y]) for x, y, w, h in sizes]
    nav = GlobalPlanner(World(obstacles), 0.5, 1.745, inflation=0.2, v_reverse=0.2)
    path = nav.route(np.array(start), np.array(goal))
    time = cost_to_go(nav.goal_field(goal), *start)
    if path is None:
        assert time == math.inf
        return
    assert time == pytest.approx(path.time, abs=1e-9)
    begin = 1 if path.start_push > 0.0 else 0
    end = len(path.points) - (1 if path.goal_push > 0.0 else 0)
    inner = path.points[begin:end]
    pushed = (path.start_push + path.goal_push) / 0.5
    again = path_time(inner, start[2], goal[2], Speeds(0.5, 0.2, 1.745), path.backward)
    assert path.time == pytest.approx(again + pushed, abs=1e-9)
    if len(inner) > 1:
        nearest = min(LineString(inner).distance(Polygon(points)) for points in obstacles)
        assert nearest > 0.2 - 1e-6


@settings(max_examples=60, deadline=None)
@given(boxes, st.tuples(coordinate, coordinate, angle), st.tuples(coordinate, coordinate, angle))
def test_the_way_back_takes_as_long_with_headings_turned_about(sizes, start, goal):
    obstacles = [rectangle(w, h) + np.array([x, y]) for x, y, w, h in sizes]
    nav = GlobalPlanner(World(obstacles), 0.5, 1.745, v_reverse=0.2)
    there = nav.route(np.array(start), np.array(goal))
    back = nav.route(
        np.array(goal) + np.array([0, 0, math.pi]), np.array(start) + np.array([0, 0, math.pi])
    )
    if there is not None and back is not None and there.start_push == back.start_push == 0.0:
        assert there.time == pytest.approx(back.time, abs=1e-9)
