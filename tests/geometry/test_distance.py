"""Distances against an independent reference, against coal and fcl, and their properties.

The reference knows only how far a point is from a body, written naively in extended
precision, and that this is a convex function along a segment: it narrows it down.
"""

import math
from dataclasses import dataclass

import coal
import fcl
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from motm_wbc.geometry import polygons
from motm_wbc.geometry.distance import segment_cylinder, segment_prism, segment_segment
from motm_wbc.geometry.prism import outline_edges

THIN = 1e-3  # coal has no bare segment: a capsule of this radius stands for it
EXACT = 1e-11  # [m]
UP = np.array([0.0, 0.0, 1.0])
TOUCH = 2e-9  # [m] below which the kernels may tell a gap from below


@dataclass
class Bar:
    """A segment as the other body."""

    ends: np.ndarray

    def solve(self, a, b):
        out = np.full(7, np.nan)
        segment_segment(a, b, *self.ends, out)
        return out

    def from_point(self, points):
        return point_to_segments(points, self.ends[None, 0], self.ends[None, 1])[:, 0]

    def moved(self, yaw, shift):
        return Bar(turned(self.ends, yaw) + shift)


@dataclass
class Prism:
    outline: np.ndarray
    faces: tuple[float, float]

    def solve(self, a, b):
        out = np.full(7, np.nan)
        segment_prism(a, b, outline_edges(self.outline), *self.faces, out)
        return out

    def from_point(self, points):
        corners = self.outline.astype(np.longdouble)
        following = np.roll(corners, -1, axis=0)
        away = point_to_segments(points[:, :2], corners, following).min(axis=1)
        edge, offset = following - corners, points[:, None, :2] - corners
        inside = (edge[:, 0] * offset[..., 1] >= edge[:, 1] * offset[..., 0]).all(axis=1)
        return np.hypot(np.where(inside, 0.0, away), beyond(points[:, 2], self.faces))

    def moved(self, yaw, shift):
        low, high = self.faces
        return Prism(turned(self.outline, yaw) + shift[:2], (low + shift[2], high + shift[2]))

    def reach(self, axes):
        level = (axes[:, :2] @ self.outline.T).max(axis=1)
        return level + np.maximum(axes[:, 2] * self.faces[0], axes[:, 2] * self.faces[1])

    def corners(self):
        return np.array([[*corner, z] for corner in self.outline for z in self.faces])


@dataclass
class Cylinder:
    disc: tuple[float, float, float]
    faces: tuple[float, float]

    def solve(self, a, b):
        out = np.full(7, np.nan)
        segment_cylinder(a, b, *self.disc, *self.faces, out)
        return out

    def from_point(self, points):
        x, y, radius = self.disc
        away = np.maximum(np.hypot(points[:, 0] - x, points[:, 1] - y) - radius, 0.0)
        return np.hypot(away, beyond(points[:, 2], self.faces))

    def moved(self, yaw, shift):
        x, y = turned(np.array([self.disc[:2]]), yaw)[0] + shift[:2]
        return Cylinder((x, y, self.disc[2]), tuple(face + shift[2] for face in self.faces))

    def reach(self, axes):
        x, y, radius = self.disc
        level = axes[:, 0] * x + axes[:, 1] * y + radius * np.hypot(axes[:, 0], axes[:, 1])
        return level + np.maximum(axes[:, 2] * self.faces[0], axes[:, 2] * self.faces[1])


def turned(points, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    result = points.copy()
    result[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]])
    return result


def beyond(height, faces):
    return np.maximum(np.maximum(faces[0] - height, height - faces[1]), 0.0)


def point_to_segments(points, starts, ends):
    """(m, k) distances of m points from k segments."""
    along = (ends - starts).astype(np.longdouble)
    offset = points[:, None] - starts
    squared = np.maximum((along * along).sum(axis=1), 1e-300)
    t = np.clip((offset * along).sum(axis=2) / squared, 0.0, 1.0)
    return np.sqrt(((offset - t[:, :, None] * along) ** 2).sum(axis=2))


def reference(body, a, b):
    """Distance of a segment from a body, zero where they overlap."""
    start, along = a.astype(np.longdouble), (b - a).astype(np.longdouble)
    low, high, least = np.longdouble(0.0), np.longdouble(1.0), np.inf
    for _ in range(12):  # each narrows the bracket 32 times
        t = np.linspace(low, high, 65)
        distance = body.from_point(start + t[:, None] * along)
        best = int(distance.argmin())
        least = min(least, distance[best])
        low, high = t[max(best - 1, 0)], t[min(best + 1, 64)]
    return float(least)


def depth_along(body, a, b, axes):
    """How far to move the segment along each unit axis to take it out of the body."""
    return body.reach(axes) - np.minimum(axes @ a, axes @ b)


def prism_depth(prism, a, b):
    """Depth from the hull of the Minkowski difference."""
    corners = prism.corners()
    hull = ConvexHull(np.concatenate([corners - a, corners - b]))
    return float((-hull.equations[:, 3]).min())


def searched_depth(body, a, b):
    """Depth in a cylinder from a search over all azimuths of the way out.

    In the upright plane of an azimuth the best way is level, or square to the segment.
    """
    along, middle, width, least = b - a, 0.0, math.pi, np.inf
    for _ in range(10):
        azimuth = middle + np.linspace(-width, width, 2001)
        level = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(2001)])
        square = level * abs(along[2]) - np.sign(along[2]) * (level @ along)[:, None] * UP
        square /= np.linalg.norm(square, axis=1)[:, None]
        best = np.minimum(*(depth_along(body, a, b, axes) for axes in (level, square)))
        least, middle, width = min(least, best.min()), azimuth[best.argmin()], width / 100
    return min(least, *depth_along(body, a, b, np.array([UP, -UP])))


def check_separated(body, a, b, out, scale=1.0):
    """Distance as the reference; witnesses and normal follow from it."""
    assert np.isfinite(out).all()
    assert abs(np.linalg.norm(out[4:]) - 1.0) < 1e-12
    place = point_to_segments(out[None, 1:4], a[None], b[None])[0, 0]
    assert place < 1e-13 * scale
    expected = reference(body, a, b)
    if expected > TOUCH:
        assert out[0] == pytest.approx(expected, abs=EXACT * scale)
    else:
        assert out[0] <= TOUCH
    if out[0] > TOUCH:
        on_other = out[None, 1:4] + out[0] * out[None, 4:]
        assert body.from_point(on_other)[0] < EXACT * scale


def check_overlap(body, a, b, out):
    """The depth is one along its own normal, and moving out by it ends the overlap."""
    assert np.isfinite(out).all()
    assert abs(np.linalg.norm(out[4:]) - 1.0) < 1e-12
    depth = depth_along(body, a, b, -out[None, 4:])[0]
    assert -out[0] == pytest.approx(depth, abs=1e-12)
    free = body.solve(a - (depth + 1e-7) * out[4:], b - (depth + 1e-7) * out[4:])
    assert free[0] == pytest.approx(1e-7, abs=1e-11)


# Awkward pairs: coordinates on a common grid (parallel, in a face, touching, in one line),
# the same with a little noise, and segments of all lengths.
GRID = [-0.5, -0.25, 0.0, 0.25, 0.5]
coordinate = st.one_of(st.sampled_from(GRID), st.floats(-1.0, 1.0))
noise = st.one_of(st.just(0.0), st.sampled_from([1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5]))
stretch = st.sampled_from([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 1.0, 1.0, 20.0])
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
extent = st.one_of(st.sampled_from([0.25, 0.5, 1.0]), st.floats(1e-4, 3.0))
angle = st.one_of(st.sampled_from([0.0, 0.5 * math.pi, 0.25 * math.pi]), st.floats(-4.0, 4.0))


@st.composite
def segments(draw):
    a, along = draw(vector), draw(vector)
    wobble = draw(noise) * draw(vector)
    return a, a + draw(stretch) * (along + wobble)


@st.composite
def boxes(draw):
    outline = polygons.rectangle(draw(extent), draw(extent))
    outline = polygons.place(outline, np.array([0.0, 0.0, draw(angle)]))
    bottom = draw(st.sampled_from(GRID))
    return Prism(outline, (bottom, bottom + draw(extent)))


@st.composite
def many_sided(draw):
    count = draw(st.integers(3, 9))
    gaps = np.array([draw(st.floats(0.05, 1.0)) for _ in range(count)])
    angles = np.cumsum(gaps) * math.tau / gaps.sum()
    outline = np.column_stack([draw(extent) * np.cos(angles), draw(extent) * np.sin(angles)])
    return Prism(outline, (0.0, draw(extent)))


@st.composite
def cylinders(draw):
    bottom = draw(st.sampled_from(GRID))
    disc = (draw(coordinate), draw(coordinate), draw(extent))
    return Cylinder(disc, (bottom, bottom + draw(extent)))


bars = segments().map(np.array).map(Bar)
solids = st.one_of(boxes(), many_sided(), cylinders())
bodies = st.one_of(solids, bars)


@settings(max_examples=600, deadline=None)
@given(bodies, segments())
def test_the_distance_is_the_reference_s(body, segment):
    a, b = segment
    out = body.solve(a, b)
    check_separated(body, a, b, out, scale=max(1.0, np.abs(segment).max()))


def random_segment(rng):
    a = rng.uniform(-0.6, 0.6, 3)
    return a, a + 0.3 * rng.normal(size=3)


def random_solids(rng, count):
    """Boxes, prisms and cylinders about the place where random segments are."""
    for k in range(count):
        if k % 3 == 0:
            outline = polygons.rectangle(*rng.uniform(0.04, 0.8, 2))
            half = rng.uniform(0.02, 0.4)
            body = Prism(outline, (-half, half))
        elif k % 3 == 1:
            angles = np.sort(rng.uniform(0, math.tau, rng.integers(3, 9)))
            spread = rng.uniform(0.1, 0.6, 2)
            body = Prism(spread * np.column_stack([np.cos(angles), np.sin(angles)]), (-0.2, 0.3))
        else:
            half = rng.uniform(0.02, 0.4)
            body = Cylinder((0.0, 0.0, rng.uniform(0.02, 0.4)), (-half, half))
        yield body.moved(rng.uniform(-3, 3), np.array([0.1, -0.1, rng.uniform(-0.1, 0.1)]))


def test_random_pairs_have_the_reference_s_distance():
    rng = np.random.default_rng(1)
    for body in random_solids(rng, 900):
        a, b = random_segment(rng)
        check_separated(body, a, b, body.solve(a, b))
    for _ in range(300):
        (a, b), ends = random_segment(rng), np.array(random_segment(rng))
        check_separated(Bar(ends), a, b, Bar(ends).solve(a, b))


@settings(max_examples=250, deadline=None)
@given(solids, segments())
def test_an_overlap_ends_when_the_segment_moves_against_the_normal(body, segment):
    a, b = segment
    assume(np.abs(segment).max() < 3.0)
    out = body.solve(a, b)
    assume(out[0] <= 0.0)
    check_overlap(body, a, b, out)


def test_the_depth_in_prisms_is_that_of_the_hull_of_the_minkowski_difference():
    rng = np.random.default_rng(2)
    overlaps = 0
    for body in random_solids(rng, 4500):
        a, b = random_segment(rng)
        out = body.solve(a, b) if isinstance(body, Prism) else np.ones(7)
        if out[0] < 0.0:
            overlaps += 1
            assert -out[0] == pytest.approx(prism_depth(body, a, b), abs=1e-12)
            check_overlap(body, a, b, out)
    assert overlaps > 300


def test_no_direction_leads_out_of_a_solid_faster():
    rng = np.random.default_rng(8)
    sphere = rng.normal(size=(20000, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    overlaps = 0
    for body in random_solids(rng, 2000):
        a, b = random_segment(rng)
        out = body.solve(a, b)
        if out[0] < 0.0:
            overlaps += 1
            nearby = -out[4:] + np.geomspace(1e-6, 1.0, 20000)[:, None] * sphere
            nearby /= np.linalg.norm(nearby, axis=1)[:, None]
            for axes in (sphere, nearby):
                assert depth_along(body, a, b, axes).min() >= -out[0] - 1e-12
    assert overlaps > 150


def test_the_depth_in_cylinders_is_that_of_a_search_over_all_azimuths():
    rng = np.random.default_rng(3)
    ways = []
    while len(ways) < 600:
        half = rng.uniform(0.02, 0.5)
        body = Cylinder((0.02, -0.01, rng.uniform(0.02, 0.5)), (-half, half))
        a, b = rng.uniform(-0.4, 0.4, (2, 3))
        out = body.solve(a, b)
        if out[0] < 0.0:
            ways.append(out[4:])
            check_overlap(body, a, b, out)
            assert -out[0] == pytest.approx(searched_depth(body, a, b), abs=1e-11)
    slope = np.abs(np.array(ways)[:, 2])
    assert ((slope > 0.05) & (slope < 0.95)).sum() > 50  # over a rim
    assert (slope < 1e-9).sum() > 50  # through the mantle
    assert (slope > 1.0 - 1e-9).sum() > 50  # up and down


def coal_capsule(a, b, radius=THIN):
    along = b - a
    length = np.linalg.norm(along)
    z = along / length
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    rotation = np.column_stack([x, np.cross(z, x), z])
    return coal.Capsule(radius, length), coal.Transform3s(rotation, 0.5 * (a + b))


def coal_distance(first, second):
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    return coal.distance(*first, *second, request, result)


def test_coal_agrees_on_boxes_cylinders_and_segments():
    rng = np.random.default_rng(4)
    overlaps = 0
    for k in range(2400):
        (a, b), shift = random_segment(rng), rng.uniform(-0.2, 0.2, 3)
        yaw, (x, y, z) = rng.uniform(-3, 3), rng.uniform(0.04, 0.8, 3)
        c, s = math.cos(yaw), math.sin(yaw)
        pose = coal.Transform3s(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), shift)
        if k % 3 == 0:
            body = Prism(polygons.rectangle(x, y), (-0.5 * z, 0.5 * z)).moved(yaw, shift)
            other = (coal.Box(x, y, z), pose)
        elif k % 3 == 1:
            body = Cylinder((0.0, 0.0, 0.5 * x), (-0.5 * z, 0.5 * z)).moved(yaw, shift)
            other = (coal.Cylinder(0.5 * x, z), pose)
        else:
            body = Bar(np.array(random_segment(rng)))
            other = coal_capsule(*body.ends, radius=1e-6)
        distance = body.solve(a, b)[0]
        overlaps += distance < -1e-3
        assert distance == pytest.approx(coal_distance(coal_capsule(a, b), other) + THIN, abs=1e-5)
    assert overlaps > 100


def test_fcl_agrees_on_what_touches():
    rng = np.random.default_rng(5)
    touching = 0
    for k in range(1000):
        (a, b), radius = random_segment(rng), 0.05
        capsule, pose = coal_capsule(a, b, radius)
        first = fcl.CollisionObject(
            fcl.Capsule(radius, 2.0 * capsule.halfLength),
            fcl.Transform(pose.getRotation(), pose.getTranslation()),
        )
        x, y, z = rng.uniform(0.1, 0.8, 3)
        if k % 2:
            body, shape = Prism(polygons.rectangle(x, y), (-0.5 * z, 0.5 * z)), fcl.Box(x, y, z)
        else:
            body, shape = Cylinder((0.0, 0.0, x), (-0.5 * z, 0.5 * z)), fcl.Cylinder(x, z)
        gap = body.solve(a, b)[0] - radius
        if abs(gap) > 1e-4:
            hit = fcl.collide(first, fcl.CollisionObject(shape), fcl.CollisionRequest()) > 0
            assert hit == (gap < 0.0)
            touching += hit
    assert 200 < touching < 800


@settings(max_examples=400, deadline=None)
@given(bodies, segments())
def test_the_ends_of_the_segment_may_be_swapped(body, segment):
    a, b = segment
    scale = max(1.0, np.abs(segment).max())
    assert body.solve(a, b)[0] == pytest.approx(body.solve(b, a)[0], abs=TOUCH * scale)


@settings(max_examples=400, deadline=None)
@given(bodies, segments(), angle, vector)
def test_turning_and_moving_all_changes_nothing(body, segment, yaw, shift):
    a, b = segment
    moved = turned(np.array(segment), yaw) + shift
    before, after = body.solve(a, b), body.moved(yaw, shift).solve(*moved)
    scale = max(1.0, np.abs(segment).max())
    assert after[0] == pytest.approx(before[0], abs=TOUCH * scale)


@settings(max_examples=400, deadline=None)
@given(bodies, segments(), vector, st.sampled_from([1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0]))
def test_the_distance_changes_no_faster_than_the_segment_moves(body, segment, way, size):
    a, b = segment
    step = size * way
    change = body.solve(a + step, b + step)[0] - body.solve(a, b)[0]
    assert abs(change) <= np.linalg.norm(step) + TOUCH * max(1.0, np.abs(segment).max())


def test_the_normal_is_the_gradient_of_the_distance_outside_and_inside():
    rng = np.random.default_rng(6)
    size, inside, outside = 1e-6, 0, 0
    others = [Bar(np.array(random_segment(rng))) for _ in range(600)]
    for body in [*random_solids(rng, 3000), *others]:
        a, b = random_segment(rng)
        out = body.solve(a, b)
        if -1e-3 < out[0] < 1e-2:
            continue
        steps = size * np.eye(3)
        ahead = np.array([body.solve(a + step, b + step)[0] for step in steps]) - out[0]
        behind = out[0] - np.array([body.solve(a - step, b - step)[0] for step in steps])
        if np.abs(ahead - behind).max() < 3e-4 * size:  # no crease between
            np.testing.assert_allclose((ahead + behind) / (2 * size), -out[4:], atol=2e-4)
            inside, outside = inside + (out[0] < 0), outside + (out[0] > 0)
    assert inside > 300
    assert outside > 2500


@settings(max_examples=300, deadline=None)
@given(solids, segments(), st.sampled_from([0.0, 1e-16, 1e-12, 1e-10, 1e-9, 1e-8]))
def test_at_contact_the_normal_is_a_unit_vector_that_leads_away(body, segment, gap):
    a, b = segment
    assume(np.abs(segment).max() < 3.0)
    out = body.solve(a, b)
    move = (out[0] - gap) * out[4:]
    near = body.solve(a + move, b + move)
    assert near[0] == pytest.approx(gap, abs=TOUCH)
    assert np.linalg.norm(near[4:]) == pytest.approx(1.0, abs=1e-12)
    away = body.solve(a + move - 1e-3 * near[4:], b + move - 1e-3 * near[4:])
    assert away[0] - near[0] > 0.5e-3


finite = st.one_of(coordinate, st.floats(-1e30, 1e30))
wild = st.tuples(finite, finite, finite).map(np.array)


@settings(max_examples=400, deadline=None)
@given(bodies, st.tuples(wild, wild))
def test_finite_numbers_have_a_finite_distance_and_a_unit_normal(body, segment):
    out = body.solve(*segment)
    assert np.isfinite(out).all()
    assert np.linalg.norm(out[4:]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "distance", "normal"),
    [
        ([0, 0, 0.5], [0, 0, 0.8], 0.2, [0, 0, -1]),  # over the top
        ([-0.5, 0, 0.1], [0.5, 0, 0.1], -0.2, [0, 0, -1]),  # straight through, up is nearest
        ([0.4, -1, 0.0], [0.4, 1, 0.0], 0.1, [-1, 0, 0]),  # along a face
        ([0.3, -1, 0.0], [0.3, 1, 0.0], 0.0, [-1, 0, 0]),  # in a face
        ([0.3, -1, 0.0], [0.3, 1, 0.1], 0.0, [-1, 0, 0]),  # the same, sloping
        ([0.0, 0.0, 0.3], [0.0, 0.0, 0.3], 0.0, [0, 0, -1]),  # a point on the top
        ([0.0, 0.0, -0.3], [0.0, 0.0, -2.0], 0.0, [0, 0, 1]),  # standing below
        ([0.6, 0.6, 0.7], [0.6, 0.6, 0.7], np.sqrt(0.34), None),  # a point off a corner
        ([0.3, 0.3, 0.3], [0.9, 0.8, 0.7], 0.0, None),  # out of a corner
        ([0.25, 0.0, -0.2], [0.25, 0.0, 0.2], -0.05, [-1, 0, 0]),  # standing inside
        ([-9e3, 0.0, 0.35], [9e3, 0.0, 0.35], 0.05, [0, 0, -1]),  # very long
    ],
)
def test_box_by_hand(a, b, distance, normal):
    out = Prism(polygons.rectangle(0.6, 0.6), (-0.3, 0.3)).solve(np.array(a, float), np.array(b))
    assert out[0] == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(out[4:]) == pytest.approx(1.0)
    if normal is not None:
        np.testing.assert_allclose(out[4:], normal, atol=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "distance", "normal"),
    [
        ([0, 0, 0.5], [0, 0, 0.8], 0.2, [0, 0, -1]),  # over the top
        ([-0.5, 0, 0.1], [0.5, 0, 0.1], -0.2, [0, 0, -1]),  # straight through, up is nearest
        ([0.4, -1, 0.0], [0.4, 1, 0.0], 0.1, [-1, 0, 0]),  # beside the mantle
        ([0.3, -1, 0.0], [0.3, 1, 0.0], 0.0, [-1, 0, 0]),  # a tangent of the mantle
        ([0.3, 0.0, -1.0], [0.3, 0.0, 1.0], 0.0, [-1, 0, 0]),  # standing on the mantle
        ([0.3, -1, 0.3], [0.3, 1, 0.3], 0.0, None),  # a tangent of the rim
        ([0.6, -1, 0.7], [0.6, 1, 0.7], 0.5, [-0.6, 0, -0.8]),  # beside the rim
        ([0.0, 0.0, 0.3], [0.0, 0.0, 0.3], 0.0, [0, 0, -1]),  # a point on the top
        ([0.2, 0.0, 0.0], [0.2, 0.0, 0.0], -0.1, [-1, 0, 0]),  # a point inside
        ([0.0, 0.0, -5.0], [0.0, 0.0, 5.0], -0.3, None),  # along the axis
        ([0.1, -9e3, 0.35], [0.1, 9e3, 0.35], 0.05, [0, 0, -1]),  # very long
    ],
)
def test_cylinder_by_hand(a, b, distance, normal):
    out = Cylinder((0.0, 0.0, 0.3), (-0.3, 0.3)).solve(np.array(a, float), np.array(b, float))
    assert out[0] == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(out[4:]) == pytest.approx(1.0)
    if normal is not None:
        np.testing.assert_allclose(out[4:], normal, atol=1e-9)


@pytest.mark.parametrize(
    ("c", "d", "distance", "normal"),
    [
        ([0, 1, 0], [1, 1, 0], 1.0, [0, 1, 0]),  # parallel, side by side
        ([2, 0, 0], [3, 0, 0], 1.0, [1, 0, 0]),  # on one line
        ([0.5, -1, 0.0], [0.5, 1, 0.0], 0.0, None),  # crossing
        ([0.5, -1, 1e-11], [0.5, 1, 1e-11], 1e-11, [0, 0, 1]),  # almost crossing
        ([0.5, -1, -1e-11], [0.5, 1, -1e-11], 1e-11, [0, 0, -1]),
        ([0.5, 0.0, 0.2], [0.5, 0.0, 0.2], 0.2, [0, 0, 1]),  # a point
        ([0.5, 0.0, 0.0], [0.5, 0.0, 0.0], 0.0, None),  # a point on the segment
        ([0, 0, 0], [1, 0, 0], 0.0, None),  # the same segment
        ([1, 0, 0], [3, 2, 0], 0.0, [0, 0, 1]),  # end to end
        ([-1, 1e-7, 0], [2, -1e-7, 0], 0.0, None),  # crossing, almost parallel
    ],
)
def test_segments_by_hand(c, d, distance, normal):
    a, b = np.zeros(3), np.array([1.0, 0, 0])
    out = Bar(np.array([c, d], float)).solve(a, b)
    assert out[0] == pytest.approx(distance, abs=1e-12)
    assert np.linalg.norm(out[4:]) == pytest.approx(1.0, abs=1e-12)
    if distance == 0.0:
        assert abs(out[4]) < 1e-6  # square to the first segment
    if normal is not None:
        assert min(np.abs(out[4:] - normal).max(), np.abs(out[4:] + normal).max()) < 1e-9
        if distance > 0.0:
            np.testing.assert_allclose(out[4:], normal, atol=1e-9)


def test_the_deepest_point_of_a_level_segment_is_the_middle_of_what_lies_inside():
    a, b = np.array([-0.1, 0.0, 0.28]), np.array([0.9, 0.0, 0.28])
    for body in (
        Prism(polygons.rectangle(0.6, 0.6), (-0.3, 0.3)),
        Cylinder((0.0, 0.0, 0.3), (-0.3, 0.3)),
    ):
        np.testing.assert_allclose(body.solve(a, b)[:4], [-0.02, 0.1, 0.0, 0.28], atol=1e-8)


def test_the_deepest_point_moved_out_by_the_depth_lies_on_the_solid():
    rng = np.random.default_rng(7)
    overlaps = 0
    for body in random_solids(rng, 2000):
        a, b = random_segment(rng)
        out = body.solve(a, b)
        if out[0] < 0.0:
            overlaps += 1
            assert body.from_point(out[None, 1:4] + out[0] * out[None, 4:])[0] < 1e-9
    assert overlaps > 150
