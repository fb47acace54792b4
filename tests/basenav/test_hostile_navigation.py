"""Degenerate and hostile worlds and queries: a clear error or a right answer, in bounded time.

Time is that of the processor, so that a busy machine fails nothing. What hangs in compiled
code can't be interrupted: the watchdog ends the process and says where it was.
"""

import faulthandler
import math
import sys
import time

import numpy as np
import pytest

from motm_wbc.basenav import Disc, GlobalPlanner, Obstacle, World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry import polygons

SECONDS = 1.0  # that any call on a small world may take
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ROOM = 10.0 * (SQUARE - 0.5)
START, GOAL = (-2.0, 0.5, 0.0), (3.0, 0.5, 0.0)
nan, inf = math.nan, math.inf


@pytest.fixture(autouse=True)
def watchdog():
    faulthandler.dump_traceback_later(300.0, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture(autouse=True, scope="module")
def compiled():
    plan([SQUARE])


def bounded(call, seconds=SECONDS):
    began = time.process_time()
    try:
        return call()
    finally:
        assert time.process_time() - began < seconds


def plan(obstacles, start=START, goal=GOAL, *, boundary=None, inflation=0.0, **speeds):
    numbers = {"v_max": 0.5, "omega_max": 1.745, "inflation": inflation, **speeds}
    return GlobalPlanner(World(obstacles, boundary), **numbers).plan(start, goal)


def refused(call, where):
    """The error is one line that names what is wrong and where."""
    with pytest.raises(InputError) as caught:
        bounded(call)
    assert caught.value.where.startswith(where)
    assert caught.value.what
    assert "\n" not in str(caught.value)


SQUARES = {
    "collinear corners": [[0, 0], [0.5, 0], [1, 0], [1, 0.3], [1, 1], [0, 1]],
    "doubled corners": [[0, 0], [0, 0], [1, 0], [1, 0], [1, 1], [0, 1], [0, 0]],
    "edges of 1e-13 m": [[0, 0], [1e-13, 0], [1, 0], [1, 1e-12], [1, 1], [0, 1]],
    "clockwise": SQUARE[::-1],
    "a spike": [[0, 0], [1, 0], [1.5, 0], [1, 0], [1, 1], [0, 1]],
    "lists": SQUARE.tolist(),
    "tuples": tuple(map(tuple, SQUARE.tolist())),
    "integers": SQUARE.astype(int),
    "single precision": SQUARE.astype(np.float32),
    "python objects": SQUARE.astype(object),
    "not contiguous": np.repeat(SQUARE, 2, axis=1)[:, ::2],
    "read-only": SQUARE[:],
    "a hole elsewhere": Obstacle(SQUARE, (SQUARE + 5.0,)),
    "twice the same": Obstacle(SQUARE, (0.2 * SQUARE + 0.4, 0.2 * SQUARE + 0.4)),
}


@pytest.mark.parametrize("shape", SQUARES.values(), ids=SQUARES)
@pytest.mark.parametrize("inflation", [0.0, 0.3])
def test_odd_squares_are_squares(shape, inflation):
    found = bounded(lambda: plan([shape], inflation=inflation))
    plain = plan([SQUARE], inflation=inflation)
    assert found.time == pytest.approx(plain.time, abs=1e-9)


@pytest.mark.parametrize("inflation", [1e-13, 1e-12, 1e-11, 3e-11, 1e-10, 1e-9, 1e-7, 1e-4])
def test_no_inflation_is_so_small_that_obstacles_vanish(inflation):
    found = bounded(lambda: plan([SQUARE], inflation=inflation))
    assert found.length == pytest.approx(plan([SQUARE]).length, abs=1e-3)


REFUSED = {
    "NaN": ([[0, 0], [1, nan], [1, 1]], ""),
    "infinite": ([[0, 0], [1, inf], [1, 1]], ""),
    "beyond squares": (SQUARE * 1e300, ""),
    "three columns": ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], ""),
    "flat": ([0, 1, 2], ""),
    "two points": ([[0, 0], [1, 1]], ""),
    "one line": ([[0, 0], [1, 1], [2, 2]], ""),
    "a sliver of no area": ([[0, 0], [1, 0], [1, 1e-9]], ""),
    "a square micrometre": (SQUARE * 1e-6, ""),
    "empty": ([], ""),
    "ragged": ([[0, 0], [1]], ""),
    "text": ("abc", ""),
    "nothing": (None, ""),
    "a number": (3.0, ""),
    "a mapping": ({"a": 1}, ""),
    "complex": (SQUARE.astype(complex), ""),
    "hole takes all": (Obstacle(SQUARE, (3.0 * SQUARE - 1.0,)), ".holes"),
    "hole with NaN": (Obstacle(SQUARE, ([[0, 0], [nan, 1], [1, 1]],)), ".holes[0]"),
    "one hole, no tuple": (Obstacle(SQUARE, 0.5 * SQUARE), ".holes"),
    "holes None": (Obstacle(SQUARE, None), ".holes"),
    "velocity NaN": (Obstacle(SQUARE, (), (nan, 0.0)), ".velocity"),
    "velocity infinite": (Obstacle(SQUARE, (), (inf, 0.0)), ".velocity"),
    "velocity of three": (Obstacle(SQUARE, (), (0.0, 0.0, 0.0)), ".velocity"),
    "velocity None": (Obstacle(SQUARE, (), None), ".velocity"),
    "velocity text": (Obstacle(SQUARE, (), "ab"), ".velocity"),
    "disc of radius 0": (Disc((0, 0), 0.0), ".radius"),
    "disc of radius NaN": (Disc((0, 0), nan), ".radius"),
    "disc of radius < 0": (Disc((0, 0), -1.0), ".radius"),
    "disc without radius": (Disc((0, 0), None), ".radius"),
    "disc of radius text": (Disc((0, 0), "a"), ".radius"),
    "disc of two radii": (Disc((0, 0), np.array([1.0, 2.0])), ".radius"),
    "disc at NaN": (Disc((nan, 0), 1.0), ".centre"),
    "disc of velocity NaN": (Disc((0, 0), 1.0, (0.0, nan)), ".velocity"),
}


@pytest.mark.parametrize(("shape", "where"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_obstacle_is_named(shape, where):
    refused(lambda: World([SQUARE, shape]), f"obstacles[1]{where}")


@pytest.mark.parametrize("obstacles", [None, 5])
def test_what_is_no_list_of_obstacles_is_named(obstacles):
    refused(lambda: World(obstacles), "obstacles")


@pytest.mark.parametrize("boundary", ["abc", [], SQUARE[:2], SQUARE * nan, Obstacle(SQUARE)])
def test_what_is_no_boundary_is_named(boundary):
    refused(lambda: World([], boundary), "boundary")


@pytest.mark.parametrize("number", [nan, inf, -1.0, None, "a"])
@pytest.mark.parametrize("name", ["v_max", "omega_max", "v_reverse", "inflation"])
def test_numbers_out_of_range_are_named(name, number):
    refused(lambda: plan([SQUARE], **{name: number}), name)


@pytest.mark.parametrize("name", ["v_max", "omega_max"])
def test_speeds_of_zero_are_named(name):
    refused(lambda: plan([SQUARE], **{name: 0.0}), name)


@pytest.mark.parametrize("when", [nan, inf, None, "a"])
def test_times_that_are_none_are_named(when):
    refused(lambda: World([SQUARE]).after(when), "time")


@pytest.mark.parametrize(
    "transforms", [[[nan, 0, 0]], np.zeros((2, 3)), np.zeros(3), None, "a", [[1, 2], [3]]]
)
def test_transforms_that_are_none_are_named(transforms):
    refused(lambda: World([SQUARE]).transformed(transforms), "transforms")


POSES = {
    "NaN": (nan, 0.0, 0.0),
    "infinite": (0.0, inf, 0.0),
    "heading infinite": (0.0, 0.0, inf),
    "no place": (None, 0.0, 0.0),
    "two": (0.0, 0.0),
    "four": (0.0, 0.0, 0.0, 0.0),
    "text": "abc",
    "nothing": None,
    "complex": (1j, 0.0, 0.0),
    "a column": np.zeros((3, 1)),
}


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_what_is_no_pose_is_named(pose):
    refused(lambda: plan([SQUARE], start=pose), "start")
    refused(lambda: plan([SQUARE], goal=pose), "goal")


QUERIES = {  # start, goal, expected length
    "the same": ((2, 2, 1.0), (2, 2, 1.0), 0.0),
    "the same, other heading": ((2, 2, 1.0), (2, 2, -2.0), 0.0),
    "the same, free": ((2, 2, None), (2, 2, None), 0.0),
    "1e-12 m apart": ((2, 2, 0.0), (2 + 1e-12, 2, 0.0), 0.0),
    "1e-8 m apart": ((2, 2, 0.0), (2 + 1e-8, 2, 0.0), 1e-8),
    "corner to corner": ((0, 0, 0.0), (1, 1, 0.0), 2.0),
    "edge to edge": ((0.5, 0, 0.0), (0.5, 1, 0.0), 2.0),
    "along an edge": ((-1, 1, 0.0), (2, 1, 0.0), 3.0),
    "grazing a corner": ((-1, 0, 0.0), (0, -1, None), math.sqrt(2.0)),
    "heading 1e9": ((-1, 1, 1e9), (2, 1, 0.0), 3.0),
    "heading NaN: free": ((-1, 1, nan), (2, 1, 0.0), 3.0),
    "100 km": ((1e5, 1e5, 0.0), (-1e5, -1e5, 0.0), 2e5 * math.sqrt(2.0)),
}


@pytest.mark.parametrize(("start", "goal", "length"), QUERIES.values(), ids=QUERIES)
def test_odd_queries_have_right_answers(start, goal, length):
    found = bounded(lambda: plan([SQUARE], start, goal))
    assert found.length == pytest.approx(length, abs=1e-9, rel=1e-5)
    assert found.start_push == found.goal_push == 0.0


@pytest.mark.parametrize("offset", [1e5, 1e6])
def test_far_from_the_origin_all_is_the_same(offset):
    start, goal = ((x + offset, y + offset, heading) for x, y, heading in (START, GOAL))
    found = bounded(lambda: plan([SQUARE + offset], start, goal, inflation=0.3))
    assert found.time == pytest.approx(plan([SQUARE], inflation=0.3).time, abs=1e-6)


BLOCKED = {
    "goal in an obstacle": ([SQUARE], START, (0.5, 0.5, 0), None, 0.0),
    "start in an obstacle": ([SQUARE], (0.5, 0.5, 0), GOAL, None, 0.3),
    "both in an obstacle": ([SQUARE], (0.5, 0.5, 0), (0.5, 0.5, 0), None, 0.0),
    "goal outside": ([], (0, 0, 0), (9, 0, 0), ROOM, 0.0),
    "start outside": ([], (9, 0, 0), (0, 0, 0), ROOM, 0.3),
    "both outside": ([], (9, 0, 0), (9, 1, 0), ROOM, 0.0),
    "a room smaller than the disc": ([], (0, 0, 0), (0.1, 0, 0), SQUARE - 0.5, 0.6),
    "a room as large as the disc": ([], (0, 0, 0), (0.1, 0, 0), SQUARE - 0.5, 0.5),
    "a room that is filled": ([ROOM], (0, 0, 0), (1, 0, 0), ROOM, 0.0),
    "goal walled in": ([Obstacle(2 * ROOM, (ROOM,))], (20, 0, 0), (0, 0, 0), None, 0.0),
    "a gate narrower than the disc": (
        [SQUARE * [9, 1] - [10, 0], SQUARE * [9, 1] + [-0.5, 0]],
        (-0.75, -2, 0),
        (-0.75, 3, 0),
        np.array([[-10, -5], [8.5, -5], [8.5, 5], [-10, 5]]),
        0.3,
    ),
}


@pytest.mark.parametrize("query", BLOCKED.values(), ids=BLOCKED)
def test_where_there_is_no_path_it_is_said(query):
    obstacles, start, goal, boundary, inflation = query
    with pytest.raises(NoPath) as caught:
        bounded(lambda: plan(obstacles, start, goal, boundary=boundary, inflation=inflation))
    assert "\n" not in str(caught.value)


PUSHED = {  # goal, boundary, how far it is pushed
    "1 cm inside the inflation": ((-0.29, 0.5, 0.0), None, 0.01),
    "at the obstacle": ((-1e-3, 0.5, 0.0), None, 0.299),
    "on the obstacle's edge": ((0.0, 0.5, 0.0), None, 0.3),
    "at the rim of the room": ((-4.9, 0.0, 0.0), ROOM, 0.2),
}


@pytest.mark.parametrize(("goal", "boundary", "push"), PUSHED.values(), ids=PUSHED)
def test_what_lies_in_the_inflation_is_pushed_out(goal, boundary, push):
    found = bounded(lambda: plan([SQUARE], START, goal, boundary=boundary, inflation=0.3))
    assert found.goal_push == pytest.approx(push, abs=1e-9)
    back = bounded(lambda: plan([SQUARE], goal, START, boundary=boundary, inflation=0.3))
    assert back.start_push == pytest.approx(push, abs=1e-9)


@pytest.mark.parametrize("size", [1e-4, 1e-3])
def test_tiny_obstacles_are_gone_round(size):
    for shape in (size * (SQUARE - 0.5), Disc((0.0, 0.0), 0.5 * size)):
        found = bounded(lambda shape=shape: plan([shape], (-1, 0, 0), (1, 0, 0)))
        assert len(found.points) >= 3
        assert 2.0 < found.length < 2.0 + size


def comb(teeth):
    points = [[0, 0]]
    for k in range(teeth):
        points += [[k + 0.2, 0], [k + 0.2, 5], [k + 0.8, 5], [k + 0.8, 0]]
    return np.array([*points, [teeth, 0], [teeth, -1], [0, -1]])


def spiral(turns):
    angle = np.linspace(0.0, turns * math.tau, 50 * turns)
    line = np.column_stack([np.cos(angle), np.sin(angle)])
    radius = 1.0 + 0.25 * angle[:, None]
    return np.vstack([radius * line, ((radius + 0.3) * line)[::-1]])


def test_a_comb_is_left_and_entered():
    found = bounded(lambda: plan([comb(60)], (5, 1, 0), (55, 1, 0)))
    between = 49.6 + 2.0 * math.hypot(0.2, 4.0)
    assert found.length == pytest.approx(between)


def test_a_spiral_is_driven_to_its_end():
    found = bounded(lambda: plan([spiral(8)], (0, 0, 0), (20, 0, 0), inflation=0.2), 5.0)
    assert 300.0 < found.length < 330.0


def wavy(corners):
    angle = np.linspace(0.0, math.tau, corners, endpoint=False)
    return (3.0 + np.sin(37 * angle))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def scattered(count):
    rng = np.random.default_rng(0)
    return [polygons.disc(0.3, 6) + rng.uniform(-60, 60, 2) for _ in range(count)]


@pytest.mark.slow
def test_of_two_thousand_obstacles_near_ones_count():
    found = bounded(lambda: plan(scattered(2000), (0, 0, 0), (6, 0, 0), inflation=0.1), 10.0)
    assert 6.0 <= found.length < 9.0


@pytest.mark.slow
def test_two_thousand_obstacles_are_crossed():
    found = bounded(lambda: plan(scattered(2000), (-59, -59, 0), (59, 59, 0), inflation=0.1), 90.0)
    assert 118.0 * math.sqrt(2.0) <= found.length < 175.0


@pytest.mark.slow
@pytest.mark.parametrize("inflation", [0.0, 0.3])
def test_an_obstacle_with_five_thousand_corners_is_gone_round(inflation):
    found = bounded(lambda: plan([wavy(5000)], (-6, 0, 0), (6, 0.3, 0), inflation=inflation), 30.0)
    assert 12.0 < found.length < 20.0
