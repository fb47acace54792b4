"""Arguments from outside: what is refused, and with what words."""

import math
from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.basenav import checks
from motm_wbc.basenav.obstacle import Disc
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.polygons import disc, rectangle, signed_area

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.0, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = rectangle(0.7, 0.5)
NO_NUMBERS = [math.nan, math.inf, None, "a", 1j, np.ones(2), np.ones((40, 40)), 10**400]


def said(call):
    """One line."""
    with pytest.raises(InputError) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200
    return caught.value


@pytest.mark.parametrize("check", [checks.number, checks.positive, checks.not_negative])
@pytest.mark.parametrize("value", NO_NUMBERS, ids=str)
def test_what_is_no_number_is_named(check, value):
    assert said(lambda: check(value, "speed")).where == "speed"


def test_numbers_of_any_type_are_given_back():
    for value in (2, 2.0, np.float32(2.0), np.int64(2)):
        for check in (checks.number, checks.positive, checks.not_negative):
            assert check(value, "speed") == 2.0
    assert checks.not_negative(0, "speed") == 0.0
    assert checks.number(-1, "speed") == -1.0
    said(lambda: checks.positive(0.0, "speed"))
    said(lambda: checks.not_negative(-1e-300, "speed"))


@pytest.mark.parametrize(
    "values", [None, "ab", [1, None], [[1, 2], [3]], [1j, 2.0], np.ones((2, 2)), [10**400, 1], {}]
)
def test_what_is_no_vector_is_named(values):
    assert said(lambda: checks.vector(values, 2, "velocity")).where == "velocity"


def test_arrays_are_ones_own():
    given = np.ones(2)
    found = checks.vector(given, 2, "velocity")
    found[0] = 5.0
    assert given[0] == 1.0
    assert np.isnan(checks.numbers([math.nan, 1], (2,), "x")[0])
    assert "beyond" in said(lambda: checks.coordinates([1e8, 0], (2,), "x")).what


@pytest.mark.parametrize(
    ("points", "word"),
    [
        (None, "shape"),
        ("abc", "numbers"),
        ([[0, 0], [1]], "numbers"),
        ([], "shape"),
        (np.zeros((4, 3)), "shape"),
        (BOX * math.nan, "NaN"),
        (BOX[:2], "three points"),
        ([[0, 0], [1, 0], [2, 0]], "area"),
        (1e-4 * BOX, "area"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "simple"),
        (disc(0.5, 5)[[0, 2, 4, 1, 3]], "simple"),
        ([[0, 0], [2, 0], [2, 1], [1, 0.2], [0, 1]], "convex"),
        (1000.0 * BOX, "metres"),
        (BOX + 20.0, "metres"),
    ],
)
def test_what_is_no_footprint_is_named(points, word):
    error = said(lambda: checks.footprint(points))
    assert error.where == "footprint"
    assert word in error.what


@pytest.mark.parametrize(
    "points", [BOX, BOX[::-1], np.repeat(BOX, 2, axis=0), BOX.tolist(), 14 * BOX]
)
def test_footprints_are_counter_clockwise(points):
    assert signed_area(checks.footprint(points)) > 0.3


@pytest.mark.parametrize("name", ["v_max", "v_reverse", "omega_max", "a_max", "alpha_max"])
@pytest.mark.parametrize("value", [*NO_NUMBERS, -1.0], ids=str)
def test_limits_out_of_range_are_named(name, value):
    assert checks.limits(LIMITS) is LIMITS
    assert said(lambda: checks.limits(replace(LIMITS, **{name: value}))).where == name


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"arm_xy": np.array([math.nan, 0.0])}, "arm_xy"),
        ({"arm_xy": np.zeros(3)}, "arm_xy"),
        ({"radius": math.nan}, "radius"),
        ({"radius": -0.1}, "radius"),
        ({"bearing": math.nan}, "bearing"),
        ({"bearing": "wide"}, "bearing"),
    ],
)
def test_regions_that_nothing_could_be_kept_in_are_refused(changes, where):
    region = {"arm_xy": np.zeros(2), "radius": 0.7, "bearing": 1.0}
    assert ReachRegion(**region).contains(np.zeros(3), np.array([0.5, 0.0]))
    assert said(lambda: ReachRegion(**{**region, **changes})).where == where


def test_what_lies_outside_is_told_from_what_lies_inside_an_obstacle():
    nav = GlobalPlanner(World([rectangle(1.0, 1.0)], rectangle(10.0, 10.0)), 0.5, 1.745)
    for place, word in (((9.0, 0.0), "outside the boundary"), ((0.1, 0.0), "inside an obstacle")):
        with pytest.raises(NoPath, match=f"goal .* {word}"):
            nav.plan((3.0, 0.0, None), (*place, None))
        with pytest.raises(NoPath, match=f"start .* {word}"):
            nav.plan((*place, None), (3.0, 0.0, None))


@pytest.mark.parametrize("shape", [Disc((0.0, 0.0), 1e-6), 1e-6 * BOX, rectangle(10.0, 1e-9)])
def test_obstacles_too_small_to_be_in_the_way_are_refused(shape):
    assert "no area" in said(lambda: World([shape])).what


def test_obstacles_do_not_leave_the_world():
    world = World([Disc((0.0, 0.0), 1.0, (1.0, 0.0))])
    assert said(lambda: world.after(1e9)).where == "time"
    assert said(lambda: world.transformed([[0.0, 1e9, 0.0]])).where == "transforms"
    assert len(World(points for points in (BOX, BOX + 2.0)).solids) == 2
