import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.geometry.convex_parts import convex_parts

L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
COMB = [
    [0, 0],
    [5, 0],
    [5, 2],
    [4, 2],
    [4, 1],
    [3, 1],
    [3, 2],
    [2, 2],
    [2, 1],
    [1, 1],
    [1, 2],
    [0, 2],
]


def check(outline):
    polygon = shapely.Polygon(outline)
    parts = convex_parts(np.array(outline, dtype=float))
    shapes = [shapely.Polygon(part) for part in parts]
    for part, shape in zip(parts, shapes, strict=True):
        assert shapely.is_ccw(shapely.linearrings([*part, part[0]]))
        assert shape.convex_hull.area == pytest.approx(shape.area, rel=1e-9)
    assert sum(shape.area for shape in shapes) == pytest.approx(polygon.area, rel=1e-9)
    assert shapely.union_all(shapes).symmetric_difference(polygon).area < 1e-9 * polygon.area
    return parts


def test_a_convex_polygon_stays_whole():
    assert len(check([[0, 0], [1, 0], [1, 1], [0, 1]])) == 1


@pytest.mark.parametrize("order", [1, -1])
def test_an_l_is_two_rectangles(order):
    assert len(check(L_SHAPE[::order])) == 2


def test_a_comb():
    assert len(check(COMB)) <= 5


@given(st.lists(st.floats(0.3, 3.0), min_size=5, max_size=14))
def test_stars_are_covered_without_overlap(radii):
    angles = np.arange(len(radii)) * math.tau / len(radii)
    check([[r * math.cos(a), r * math.sin(a)] for r, a in zip(radii, angles, strict=True)])
