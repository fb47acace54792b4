import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.geometry import polygons
from motm_wbc.geometry.closest import segment_cylinder, segment_prism, segment_segment
from motm_wbc.geometry.upright import UprightCylinders, UprightPrisms

COUNT = 1500
THIN = 1e-3  # coal has no bare segment: a capsule of this radius stands for it


def random_segments(rng):
    a = rng.uniform(-0.6, 0.6, (COUNT, 3))
    return a, a + 0.3 * rng.normal(size=(COUNT, 3))


def coal_capsule(a, b):
    along = b - a
    length = np.linalg.norm(along)
    z = along / length
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    pose = coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), 0.5 * (a + b))
    return coal.Capsule(THIN, length), pose


def coal_distance(first, second):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    return coal.distance(*first, *second, request, result)


def turned(yaw, x, y):
    c, s = np.cos(yaw), np.sin(yaw)
    return coal.Transform3s(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array([x, y, 0]))


def check_witnesses(points, a, b):
    """Witness points lie on the segment, distance and normal follow from them."""
    np.testing.assert_allclose(np.linalg.norm(points.normal, axis=1), 1.0, atol=1e-9)
    gap = points.on_segment + points.distance[:, None] * points.normal
    np.testing.assert_allclose(gap, points.on_other, atol=1e-9)
    along = b - a
    t = np.einsum("mi,mi->m", points.on_segment - a, along) / np.einsum("mi,mi->m", along, along)
    assert t.min() > -1e-9 and t.max() < 1 + 1e-9
    np.testing.assert_allclose(a + t[:, None] * along, points.on_segment, atol=1e-9)


def test_segments_agree_with_coal():
    rng = np.random.default_rng(1)
    a, b = random_segments(rng)
    c, d = np.roll(a, 1, axis=0), np.roll(b, 1, axis=0)
    points = segment_segment(a, b, c, d)
    pairs = zip(a, b, c, d, strict=True)
    expected = [coal_distance(coal_capsule(*p[:2]), coal_capsule(*p[2:])) + 2 * THIN for p in pairs]
    np.testing.assert_allclose(points.distance, expected, atol=1e-9)
    check_witnesses(points, a, b)


def test_boxes_agree_with_coal_outside_and_inside():
    rng = np.random.default_rng(2)
    a, b = random_segments(rng)
    size, yaw = rng.uniform(0.04, 0.8, (COUNT, 3)), rng.uniform(-3, 3, COUNT)
    outlines = [
        polygons.place(polygons.rectangle(*s[:2]), np.array([0.1, -0.1, w]))
        for s, w in zip(size, yaw, strict=True)
    ]
    faces = 0.5 * np.column_stack([-size[:, 2], size[:, 2]])
    points = segment_prism(a, b, UprightPrisms.over(np.array(outlines), faces))
    expected = np.array(
        [
            coal_distance(coal_capsule(p, q), (coal.Box(*s), turned(w, 0.1, -0.1))) + THIN
            for p, q, s, w in zip(a, b, size, yaw, strict=True)
        ]
    )
    assert (expected < -1e-3).sum() > 100  # overlaps are part of the test
    np.testing.assert_allclose(points.distance, expected, atol=1e-9)
    check_witnesses(points, a, b)


def test_cylinders_agree_with_coal_outside_and_inside():
    rng = np.random.default_rng(3)
    a, b = random_segments(rng)
    radius, half = rng.uniform(0.02, 0.4, (2, COUNT))
    cylinders = UprightCylinders(
        np.column_stack([np.full(COUNT, 0.1), np.full(COUNT, -0.1), radius]),
        np.column_stack([-half, half]),
    )
    points = segment_cylinder(a, b, cylinders)
    expected = np.array(
        [
            coal_distance(coal_capsule(p, q), (coal.Cylinder(r, 2 * h), turned(0, 0.1, -0.1)))
            + THIN
            for p, q, r, h in zip(a, b, radius, half, strict=True)
        ]
    )
    assert (expected < -1e-3).sum() > 100
    np.testing.assert_allclose(points.distance, expected, atol=2e-6)  # coal's, beside a rim
    check_witnesses(points, a, b)


def test_prisms_agree_with_dense_sampling():
    rng = np.random.default_rng(4)
    for corners in (3, 5, 8):
        angles = np.sort(rng.uniform(0, 2 * np.pi, (20, corners)), axis=1)
        outline = 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=2)
        faces = np.tile([0.1, 0.4], (20, 1))
        a = rng.uniform(-0.8, 0.8, (20, 3))
        b = a + rng.normal(size=(20, 3)) * 0.2
        points = segment_prism(a, b, UprightPrisms.over(outline, faces))
        for k in np.flatnonzero(points.distance > 0):
            t = np.linspace(0, 1, 4001)[:, None]
            samples = a[k] + t * (b[k] - a[k])
            flat = distance_to_polygon(samples[:, :2], outline[k])
            tall = np.maximum(np.maximum(0.1 - samples[:, 2], samples[:, 2] - 0.4), 0)
            nearest = np.hypot(flat, tall).min()
            assert points.distance[k] <= nearest + 1e-12
            assert points.distance[k] == pytest.approx(nearest, abs=1e-5)


def distance_to_polygon(points, outline):
    edge = np.roll(outline, -1, axis=0) - outline
    offset = points[:, None] - outline
    t = np.clip((offset * edge).sum(2) / (edge * edge).sum(1), 0, 1)
    away = np.linalg.norm(offset - t[:, :, None] * edge, axis=2).min(axis=1)
    inside = ((edge[:, 0] * offset[:, :, 1] - edge[:, 1] * offset[:, :, 0]) >= 0).all(axis=1)
    return np.where(inside, 0.0, away)


def test_moving_against_the_normal_takes_an_overlap_away():
    rng = np.random.default_rng(5)
    a, b = random_segments(rng)
    outline = np.tile(polygons.rectangle(0.5, 0.4), (COUNT, 1, 1))
    prisms = UprightPrisms.over(outline, np.tile([-0.3, 0.3], (COUNT, 1)))
    cylinders = UprightCylinders(
        np.tile([0.0, 0.0, 0.3], (COUNT, 1)), np.tile([-0.3, 0.3], (COUNT, 1))
    )
    for solve, solids in ((segment_prism, prisms), (segment_cylinder, cylinders)):
        points = solve(a, b, solids)
        inside = points.distance < -1e-6
        assert inside.sum() > 100
        out = -points.normal * (-points.distance + 1e-6)[:, None]
        moved = solve(a + out, b + out, solids)
        assert moved.distance[inside].min() >= 0.0
        assert moved.distance[inside].max() <= 1e-5


@pytest.mark.parametrize(
    ("a", "b", "distance", "normal"),
    [
        ([0, 0, 0.5], [0, 0, 0.8], 0.2, [0, 0, -1]),  # over the top
        ([-0.5, 0, 0.1], [0.5, 0, 0.1], -0.2, [0, 0, -1]),  # straight through, up is nearest
        ([0.4, -1, 0.0], [0.4, 1, 0.0], 0.1, [-1, 0, 0]),  # along a face
        ([0.0, 0.0, 0.3], [0.0, 0.0, 0.3], 0.0, [0, 0, -1]),  # a point on the top
        ([0.6, 0.6, 0.7], [0.6, 0.6, 0.7], np.sqrt(0.34), None),  # a point off a corner
    ],
)
def test_box_by_hand(a, b, distance, normal):
    prisms = UprightPrisms.over(polygons.rectangle(0.6, 0.6)[None], np.array([[-0.3, 0.3]]))
    points = segment_prism(np.array([a], float), np.array([b], float), prisms)
    assert points.distance[0] == pytest.approx(distance, abs=1e-12)
    if normal is not None:
        np.testing.assert_allclose(points.normal[0], normal, atol=1e-9)


@pytest.mark.parametrize(
    ("c", "d", "distance"),
    [
        ([0, 1, 0], [1, 1, 0], 1.0),  # parallel, side by side
        ([2, 0, 0], [3, 0, 0], 1.0),  # on one line
        ([0.5, -1, 0.0], [0.5, 1, 0.0], 0.0),  # crossing
        ([0.5, 0.0, 0.2], [0.5, 0.0, 0.2], 0.2),  # a point
        ([0, 0, 0], [1, 0, 0], 0.0),  # the same segment
    ],
)
def test_segments_by_hand(c, d, distance):
    a, b = np.zeros((1, 3)), np.array([[1.0, 0, 0]])
    points = segment_segment(a, b, np.array([c], float), np.array([d], float))
    assert points.distance[0] == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(points.normal[0]) == pytest.approx(1.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(-0.05, 0.05))
def test_distance_is_continuous_across_the_surface(seed, shift):
    rng = np.random.default_rng(seed)
    a = rng.uniform(-0.2, 0.2, (1, 3)) + np.array([0, 0, 0.3 + shift])
    b = a + rng.normal(size=(1, 3)) * 0.1
    prisms = UprightPrisms.over(polygons.rectangle(0.5, 0.5)[None], np.array([[0.0, 0.3]]))
    step = np.array([0, 0, 1e-6])
    first, second = segment_prism(a, b, prisms), segment_prism(a + step, b + step, prisms)
    assert abs(second.distance[0] - first.distance[0]) <= 1.001e-6


def test_a_stack_of_prisms_pads_outlines_without_changing_them():
    triangle = np.array([[0, 0], [1, 0], [0, 1.0]])
    prisms = UprightPrisms.stack([triangle, polygons.rectangle(1, 1)], np.array([[0, 1], [0, 1.0]]))
    assert prisms.edges.shape == (2, 4, 7)
    a = np.array([[2.0, 2.0, 0.5], [2.0, 0.0, 0.5]])
    points = segment_prism(a, a, prisms)
    np.testing.assert_allclose(points.distance, [1.5 * np.sqrt(2.0), 1.5])
