import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.geometry import polygons
from motm_wbc.geometry.outlines import facing_end, outline_disc, outline_outline
from motm_wbc.geometry.prism import outline_edges


def random_outline(rng, centre):
    points = rng.normal(size=(rng.integers(4, 9), 2)) * rng.uniform(0.05, 0.5)
    hull = shapely.convex_hull(shapely.MultiPoint(points))
    return polygons.counter_clockwise(np.array(hull.exterior.coords)[:-1]) + centre


def nearest(first, second):
    out = np.full(5, np.nan)
    outline_outline(outline_edges(first), outline_edges(second), out)
    return out


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 10**6))
def test_distances_are_shapelys_and_depths_part_the_two(seed):
    rng = np.random.default_rng(seed)
    a, b = random_outline(rng, np.zeros(2)), random_outline(rng, rng.uniform(-0.8, 0.8, 2))
    distance, x, y, nx, ny = nearest(a, b)
    first, second = shapely.Polygon(a), shapely.Polygon(b)
    assert np.hypot(nx, ny) == 1.0 or abs(np.hypot(nx, ny) - 1.0) < 1e-12
    assert (
        shapely.distance(first, second) == np.clip(distance, 0, None)
        or abs(shapely.distance(first, second) - max(distance, 0.0)) < 1e-12
    )
    away = np.array([nx, ny])
    if distance > 1e-9:
        assert first.distance(shapely.Point(x, y)) < 1e-9
        assert second.distance(shapely.Point(*(np.array([x, y]) + distance * away))) < 1e-9
    elif distance < -1e-9:
        parted = shapely.distance(shapely.Polygon(a + (distance - 1e-9) * away), second)
        assert 0.0 < parted < 1e-8
        for angle in np.linspace(0, 2 * np.pi, 60):  # no shorter way
            shorter = 0.999 * distance * np.array([np.cos(angle), np.sin(angle)])
            assert shapely.Polygon(a + shorter).intersection(second).area > 0.0


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10**6))
def test_a_disc_is_its_centre_and_its_radius(seed):
    rng = np.random.default_rng(seed)
    a, centre, radius = random_outline(rng, np.zeros(2)), rng.uniform(-0.8, 0.8, 2), 0.2
    out = np.full(5, np.nan)
    outline_disc(outline_edges(a), *centre, radius, out)
    polygon, point = shapely.Polygon(a), shapely.Point(*centre)
    inside = polygon.contains(point)
    expected = -polygon.exterior.distance(point) if inside else polygon.distance(point)
    assert abs(out[0] - (expected - radius)) < 1e-12
    # the witness is on the outline, and the centre lies along the normal
    assert polygon.exterior.distance(shapely.Point(out[1], out[2])) < 1e-9
    np.testing.assert_allclose(out[1:3] + expected * out[3:], centre, atol=1e-9)


def test_touching_and_parallel_outlines_have_a_normal():
    square = polygons.rectangle(1.0, 1.0)
    for shift in ([1.0, 0.0], [1.0, 0.3], [1.0, 1.0], [0.3, 1.2]):
        out = nearest(square, square + shift)
        assert np.isfinite(out).all() and abs(np.hypot(out[3], out[4]) - 1.0) < 1e-12
        assert out[3:] @ shift > 0.0


def test_edges_side_by_side_have_two_ends():
    base, block = polygons.rectangle(0.6, 0.4), polygons.rectangle(0.2, 0.3)
    turn = 0.05
    placed = polygons.place(block, np.array([0.5, 0.1, turn]))
    first, second = outline_edges(base), outline_edges(placed)
    nearest_pair = nearest(base, placed)
    ends = {}
    for low in (True, False):
        out = nearest_pair.copy()
        assert facing_end(first, second, low, out)
        ends[low] = out
    for out in ends.values():
        np.testing.assert_array_equal(out[3:], nearest_pair[3:])
        assert abs(out[1] - 0.3) < 1e-12  # on the base's front
        other = out[1:3] + out[0] * out[3:]
        assert shapely.Polygon(placed).exterior.distance(shapely.Point(other)) < 1e-9
        assert out[0] >= nearest_pair[0] - 1e-12
    assert abs(ends[True][2] - ends[False][2]) > 0.2
    far = polygons.place(block, np.array([0.5, 0.1, 0.7]))  # not side by side
    assert not facing_end(first, outline_edges(far), True, nearest(base, far))
