"""The world of navigation: what it accepts, and what it looks like to a disc."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon

from motm_wbc.basenav.visibility import is_blocked, line_of_sight, push_out
from motm_wbc.basenav.walls import NEXT, PREVIOUS, TURN, TWIN
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.geometry.polygons import disc, rectangle, signed_area

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ELL = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], dtype=float)
STAR = np.array([[0, -2], [0.3, -0.3], [2, 0], [0.3, 0.3], [0, 2], [-0.3, 0.3], [-2, 0]])


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([[0, 0], [1, 0], [math.nan, 1]], "NaN"),
        ([[0, 0], [1, 0], [math.inf, 1]], "infinite"),
        ([[0, 0], [1, 0], [0, 0], [1, 0]], "three distinct"),
        ([[0, 0], [1, 0], [2, 0]], "no area"),
        ([[0, 0, 0], [1, 0, 0], [2, 1, 0]], "shape"),
        ([["a", "b"]], "numbers"),
        ([], "shape"),
    ],
)
def test_bad_polygons_are_named(points, said):
    with pytest.raises(InputError, match=said) as caught:
        World([SQUARE, points])
    assert caught.value.where == "obstacles[1]"
    with pytest.raises(InputError, match=said) as caught:
        World([], boundary=points)
    assert caught.value.where == "boundary"


@pytest.mark.parametrize("radius", [-0.1, math.nan, math.inf])
def test_bad_inflation_is_refused(radius):
    with pytest.raises(InputError, match="inflation"):
        World([SQUARE]).inflated(radius)


def test_any_winding_and_doubled_points_give_the_same_obstacle():
    for points in (SQUARE, SQUARE[::-1], np.repeat(SQUARE, 2, axis=0)):
        (obstacle,) = World([points]).obstacles
        assert signed_area(obstacle) == 1.0
        assert len(obstacle) == 4
        with pytest.raises(ValueError, match="read-only"):
            obstacle[0, 0] = 5.0


def test_a_polygon_that_crosses_itself_counts_with_its_lobes():
    bow_tie = np.array([[0, 0], [2, 2], [2, 0], [0, 2]], dtype=float)
    lobes = World([bow_tie]).obstacles
    assert sum(signed_area(lobe) for lobe in lobes) == pytest.approx(2.0)


def test_inflation_is_kept_and_empty_worlds_are_free():
    world = World([SQUARE])
    assert world.inflated(0.3) is world.inflated(0.3)
    empty = World([]).inflated(0.5)
    assert not is_blocked(empty.walls, 3.0, 4.0)
    assert line_of_sight(empty.walls, 0.0, 0.0, 5.0, 5.0)


@pytest.mark.parametrize("shape", [SQUARE, ELL, STAR, disc(0.2, 32), rectangle(2.0, 0.1)])
@pytest.mark.parametrize("radius", [0.05, 0.3, 1.2])
def test_inflation_contains_the_true_one_and_little_more(shape, radius):
    grown = World([shape]).inflated(radius).region
    exact = Polygon(shape).buffer(radius, quad_segs=64)
    assert exact.difference(grown).area < 1e-9
    slack = radius / math.cos(math.pi / 16) - radius  # of a circumscribed arc
    assert grown.difference(exact.buffer(slack + 1e-3)).area < 1e-9


def test_boundary_shrinks_by_the_radius():
    room = World([SQUARE + 2.0], boundary=rectangle(10.0, 10.0))
    inflated = room.inflated(0.5)
    hull = Polygon(inflated.region.geoms[0].exterior)
    assert hull.equals(Polygon(rectangle(9.0, 9.0)))
    assert is_blocked(inflated.walls, 4.7, 0.0)
    assert not is_blocked(inflated.walls, 4.3, 0.0)
    assert is_blocked(inflated.walls, 1.6, 2.5)
    assert is_blocked(inflated.walls, 20.0, 0.0)


def test_a_boundary_that_is_filled_leaves_nothing_free():
    walls = World([], boundary=rectangle(1.0, 1.0)).inflated(0.6).walls
    point = np.empty(2)
    assert push_out(walls, 0.0, 0.0, point) == math.inf


def test_rings_are_linked_and_straight_corners_are_gone():
    walls = World([np.array([[0, 0], [1, 0], [2, 0], [2, 1], [0, 1]], float)]).inflated(0.0).walls
    assert walls.corners.shape[0] == 4
    assert walls.corners[:, TURN] == pytest.approx([math.pi / 2] * 4)
    for corner, links in enumerate(walls.links):
        assert walls.links[links[NEXT], PREVIOUS] == corner
        assert links[TWIN] == corner


def test_where_outlines_touch_corners_are_twins():
    walls = World([SQUARE, SQUARE + 1.0]).inflated(0.0).walls
    shared = [i for i, links in enumerate(walls.links) if links[TWIN] != i]
    assert len(shared) == 2
    assert walls.corners[shared, :2].tolist() == [[1.0, 1.0], [1.0, 1.0]]


def test_lines_of_sight_run_along_edges_but_not_between_what_touches():
    alone = World([SQUARE]).inflated(0.0).walls
    assert line_of_sight(alone, -1.0, 1.0, 3.0, 1.0)
    assert line_of_sight(alone, 0.0, 1.0, 1.0, 1.0)
    assert line_of_sight(alone, 2.0, 0.0, 0.0, 2.0)  # grazes a corner
    assert not line_of_sight(alone, 0.0, 0.0, 1.0, 1.0)  # the diagonal, from corner to corner
    assert not line_of_sight(alone, 0.5, 0.0, 0.5, 1.0)  # from edge to edge
    touching = World([SQUARE, SQUARE + 1.0]).inflated(0.0).walls
    assert not line_of_sight(touching, -1.0, 1.0, 3.0, 1.0)  # between them
    assert not line_of_sight(touching, 0.0, 2.0, 2.0, 0.0)  # through the common corner
    beside = World([SQUARE, SQUARE + np.array([1.0, 0.0])]).inflated(0.0).walls
    assert not line_of_sight(beside, 1.0, -1.0, 1.0, 2.0)  # along the common edge
    assert line_of_sight(beside, -1.0, 1.0, 3.0, 1.0)


def test_turned_squares_that_touch_up_to_rounding_have_no_gap():
    c, s = math.cos(0.3), math.sin(0.3)
    turn = np.array([[c, s], [-s, c]])
    walls = World([SQUARE @ turn, (SQUARE * 0.5 + [1.0, 0.25]) @ turn]).inflated(0.0).walls
    start, goal = np.array([1.0, -0.5]) @ turn, np.array([1.0, 1.5]) @ turn
    assert not line_of_sight(walls, *start, *goal)


ELL_WALLS = World([ELL]).inflated(0.0).walls
ELL_CORE = Polygon(ELL).buffer(-1e-6, join_style="mitre")


@given(st.floats(-1, 4), st.floats(-1, 4), st.floats(-1, 4), st.floats(-1, 4))
def test_sight_agrees_with_shapely(px, py, qx, qy):
    segment = shapely.LineString([(px, py), (qx, qy)])
    if any(is_blocked(ELL_WALLS, x, y) for x, y in ((px, py), (qx, qy))):
        return  # sight is asked for between free points only
    if segment.intersects(ELL_CORE):
        assert not line_of_sight(ELL_WALLS, px, py, qx, qy)
    elif not segment.intersects(Polygon(ELL)):
        assert line_of_sight(ELL_WALLS, px, py, qx, qy)


@given(st.floats(-1, 4), st.floats(-1, 4))
def test_the_nearest_free_point_agrees_with_shapely(x, y):
    polygon = Polygon(ELL)
    point = np.empty(2)
    pushed = push_out(World([ELL]).inflated(0.0).walls, x, y, point)
    inside = polygon.contains(Point(x, y))
    expected = polygon.exterior.distance(Point(x, y)) if inside else 0.0
    assert pushed == pytest.approx(expected, abs=1e-9)
    assert math.dist((x, y), point) == pytest.approx(pushed, abs=1e-9)
