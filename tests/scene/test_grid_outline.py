"""Polygons of a grid's blocked cells: never less than the cells, little more."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from shapely.geometry import Polygon

from motm_wbc.geometry import polygons
from motm_wbc.scene.grid_outline import cell_regions, filled_outward, without_pinches

MASKS = hnp.arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))
TOLERANCES = st.sampled_from([0.0, 0.5, 1.0, 2.0])


def cells(mask) -> shapely.Geometry:
    return shapely.union_all([shapely.box(i, j, i + 1, j + 1) for i, j in np.argwhere(mask)])


def covered(regions) -> shapely.Geometry:
    return shapely.union_all([Polygon(one.outline, one.holes).buffer(0.0) for one in regions])


@given(MASKS, TOLERANCES)
def test_no_cell_is_uncovered_and_little_is_added(mask, tolerance):
    shape = covered(cell_regions(mask, tolerance))
    assert cells(mask).difference(shape).area < 1e-9
    allowed = cells(without_pinches(mask)).buffer(tolerance + 1e-9, join_style="mitre")
    assert shape.difference(allowed).area < 1e-9


@given(MASKS)
def test_without_tolerance_the_polygons_are_the_cells(mask):
    regions = cell_regions(mask, 0.0)
    joined = without_pinches(mask)
    assert covered(regions).area == pytest.approx(joined.sum(), abs=1e-9)
    for one in regions:
        assert polygons.signed_area(one.outline) > 0.0
        assert all(polygons.signed_area(hole) < 0.0 for hole in one.holes)


@given(MASKS)
def test_pinches_are_filled_by_neighbours_only(mask):
    joined = without_pinches(mask)
    assert (joined | ~mask).all()
    low, right = joined[:-1, :-1], joined[1:, :-1]
    up, far = joined[:-1, 1:], joined[1:, 1:]
    assert not (low & far & ~right & ~up).any()
    assert not (right & up & ~low & ~far).any()
    if mask.any() and mask.size > 1:
        reach = np.pad(mask, 1)
        near = sum(
            np.roll(reach, (a, b), (0, 1)).astype(int) for a in (-1, 0, 1) for b in (-1, 0, 1)
        )[1:-1, 1:-1]
        first = joined & ~mask
        assert not first.any() or (near[first] > 0).any()


def test_a_slanted_wall_has_few_corners():
    column, row = np.mgrid[0:300, 0:300]
    for angle in (0.1, 0.5, math.pi / 4, 1.2):
        across = -math.sin(angle) * (column - 150) + math.cos(angle) * (row - 150)
        wall = np.abs(across) < 3.0
        (region,) = cell_regions(wall, 1.42)
        (plain,) = cell_regions(wall, 0.0)
        assert len(region.outline) <= 20 and len(plain.outline) > 100


def test_a_room_is_a_hole_and_a_tiny_one_is_filled():
    mask = np.ones((20, 20), dtype=bool)
    mask[3:15, 4:16] = False
    mask[17, 17] = False
    (region,) = cell_regions(mask, 1.0)
    assert [Polygon(hole).area for hole in region.holes] == [144.0]


def test_a_ring_that_would_cross_itself_gets_less_tolerance():
    # A corridor one cell wide with a bend: cutting both of its corners would close it.
    ring = np.array([[0, 0], [9, 0], [9, 5], [5, 5], [5, 4], [8, 4], [8, 1], [0, 1]], dtype=float)
    (filled,) = filled_outward([ring], 3.0)
    assert Polygon(filled).is_valid
    assert Polygon(filled).covers(Polygon(ring))


def test_nothing_blocked():
    assert cell_regions(np.zeros((4, 5), dtype=bool), 1.0) == []
