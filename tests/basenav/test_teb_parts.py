"""Obstacles, residuals, band and solver of the Timed Elastic Band, against plain references."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from shapely.geometry import Polygon

from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.obstacle import Disc, Obstacle, ObstacleLike
from motm_wbc.basenav.teb_band import (
    LEAST_INTERVALS,
    Band,
    band_along,
    gone_along,
    joined,
    resized,
    with_goal,
)
from motm_wbc.basenav.teb_obstacles import (
    Parts,
    footprint_sides,
    near_parts,
    pack_parts,
    place_footprint,
    separation,
)
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.teb_residuals import BLOCK, normal_equations, ways
from motm_wbc.basenav.teb_solver import optimised
from motm_wbc.basenav.teb_terms import Ends, Neighbours, terms_of
from motm_wbc.basenav.teb_world import scene_of
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
BOX = polygons.rectangle(0.68, 0.47)
SIDES = footprint_sides(BOX)
EMPTY = pack_parts([], None)


def star(rng: np.random.Generator, centre: Array) -> Array:
    """A simple polygon about a point, concave as a rule."""
    angles = (np.arange(7) + rng.uniform(0.1, 0.9, 7)) * math.tau / 7
    radii = rng.uniform(0.2, 0.9, 7)
    return centre + radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def distance(parts: Parts, part: int, pose: Array, beyond: float = math.inf) -> float:
    base = np.empty_like(SIDES)
    place_footprint(SIDES, *pose, base)
    return separation(base, parts, part, 0.0, 0.0, beyond)[0]


@given(seed=st.integers(0, 10**6))
@settings(max_examples=40)
def test_parts_cover_the_solids_and_the_outside_of_the_boundary(seed: int) -> None:
    rng = np.random.default_rng(seed)
    floor = star(rng, np.zeros(2)) * 4.0
    world = World([star(rng, rng.uniform(-2.0, 2.0, 2)) for _ in range(3)], floor)
    parts = pack_parts(world.solids, world.boundary)
    shapes = [
        Polygon(parts.sides[first:end, :2])
        for first, end in zip(parts.starts[:-1], parts.starts[1:], strict=True)
    ]
    assert all(shape.convex_hull.area <= shape.area + 1e-12 for shape in shapes)
    covered = shapely.union_all(shapes)
    outside = shapely.buffer(Polygon(floor), 1.0).difference(Polygon(floor))
    blocked = shapely.union_all([Polygon(points) for points in world.obstacles] + [outside])
    assert blocked.difference(covered).area < 1e-9
    free = Polygon(floor).difference(blocked)
    assert covered.intersection(free).area < 1e-9


@given(seed=st.integers(0, 10**6))
@settings(max_examples=100)
def test_separation_is_the_distance_of_shapely_and_parts_what_overlaps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, math.tau, int(rng.integers(3, 9))))
    solid = rng.uniform(0.05, 0.8) * np.column_stack([np.cos(angles), np.sin(angles)])
    if Polygon(solid).area < 1e-3:
        return
    parts = pack_parts(World([solid]).solids, None)
    pose = np.array([*rng.uniform(-1.2, 1.2, 2), rng.uniform(-4.0, 4.0)])
    base = np.empty_like(SIDES)
    place_footprint(SIDES, *pose, base)
    away, nx, ny, _, _ = separation(base, parts, 0, 0.0, 0.0, math.inf)
    body, shape = Polygon(polygons.place(BOX, pose)), Polygon(solid)
    assert math.hypot(nx, ny) == pytest.approx(1.0)
    if away > 0.0:
        assert away == pytest.approx(body.distance(shape), abs=1e-9)
        return
    assert body.intersects(shape)
    apart = shapely.affinity.translate(body, -away * nx, -away * ny)
    assert apart.intersection(shape).area < 1e-9
    nearly = shapely.affinity.translate(body, -0.99 * away * nx, -0.99 * away * ny)
    assert nearly.intersects(shape)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=100)
def test_the_gradient_of_the_separation_is_that_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = pack_parts(World([rng.uniform(0.1, 0.6) * polygons.disc(1.0, 5)]).solids, None)
    pose = np.array([*rng.uniform(-1.2, 1.2, 2), rng.uniform(-4.0, 4.0)])
    base = np.empty_like(SIDES)
    place_footprint(SIDES, *pose, base)
    _, nx, ny, wx, wy = separation(base, parts, 0, 0.0, 0.0, math.inf)
    exact = np.array([nx, ny, ny * (wx - pose[0]) - nx * (wy - pose[1])])
    ahead = np.array([distance(parts, 0, pose + 1e-6 * axis) for axis in np.eye(3)])
    behind = np.array([distance(parts, 0, pose - 1e-6 * axis) for axis in np.eye(3)])
    here = distance(parts, 0, pose)
    if np.abs(ahead - 2.0 * here + behind).max() < 1e-9:  # else a kink lies between them
        np.testing.assert_allclose((ahead - behind) / 2e-6, exact, atol=1e-5)


def test_beyond_the_distance_asked_for_a_lower_bound_is_enough() -> None:
    parts = pack_parts(World([BOX + np.array([2.0, 1.0])]).solids, None)
    for pose in ([0.0, 0.0, 0.3], [1.0, -0.5, 2.0], [3.0, 2.0, -1.0]):
        exact = distance(parts, 0, np.array(pose))
        assert 0.1 <= distance(parts, 0, np.array(pose), beyond=0.1) <= exact + 1e-12


def random_band(rng: np.random.Generator, count: int = 8) -> Band:
    steps = rng.uniform([-0.2, -0.3, -0.6], [0.4, 0.3, 0.6], (count, 3))
    poses = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return Band(poses, rng.uniform(0.1, 0.5, count))


def unknowns(band: Band) -> Array:
    return np.column_stack([band.poses, np.append(band.intervals, 0.0)]).ravel()[:-1]


def band_of(values: Array) -> Band:
    blocks = np.append(values, 0.0).reshape(-1, BLOCK)
    return Band(blocks[:, :3].copy(), blocks[:-1, 3].copy())


def full(band: Array) -> Array:
    """Symmetric matrix of its lower band (n, w)."""
    matrix = np.zeros((len(band), len(band)))
    for k in range(band.shape[1]):
        rows = np.arange(k, len(band))
        matrix[rows, rows - k] = matrix[rows - k, rows] = band[: len(band) - k, k]
    return matrix


WORLD = World(
    [BOX + np.array([1.0, 0.3]), polygons.disc(0.3) + np.array([0.6, -0.8])],
    polygons.rectangle(6.0, 5.0),
)


@pytest.mark.parametrize("stop", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_the_gradient_of_all_residuals_is_that_of_finite_differences(seed: int, stop: bool) -> None:
    band = random_band(np.random.default_rng(seed))
    parameters = TebParameters(distance=0.2, nearness_distance=0.6)
    parts = pack_parts(WORLD.solids, WORLD.boundary)
    near = Neighbours(SIDES, parts, *near_parts(parts, *band, 3.0))
    terms, ends = terms_of(LIMITS, parameters), Ends(0.3, -0.4, stop)
    _, normal = normal_equations(terms, ends, near, *band)
    values = unknowns(band)

    def cost(shift: Array) -> float:
        return normal_equations(terms, ends, near, *band_of(values + shift))[0]

    slopes = [(cost(1e-6 * e) - cost(-1e-6 * e)) / 4e-6 for e in np.eye(len(values))]
    scale = np.abs(normal.gradient).max()
    np.testing.assert_allclose(normal.gradient, slopes, atol=1e-6 * scale)


@pytest.mark.parametrize("seed", range(5))
def test_the_normal_matrix_is_the_sum_of_the_residuals_outer_products(seed: int) -> None:
    """Where all residuals are small, it is half the second derivative of the cost."""
    band = random_band(np.random.default_rng(seed), 5)
    parameters = TebParameters(
        rolling_weight=0.0, speed_weight=0.0, acceleration_weight=0.0, forward_weight=0.0,
        nearness_weight=0.0,
    )  # fmt: skip
    terms = terms_of(LIMITS, parameters)
    near = Neighbours(SIDES, EMPTY, *near_parts(EMPTY, *band, 3.0))
    ends = Ends(0.0, 0.0, True)
    _, normal = normal_equations(terms, ends, near, *band)
    matrix, values = full(normal.band), unknowns(band)
    assert np.linalg.eigvalsh(matrix).min() > -1e-9

    def gradient(shift: Array) -> Array:
        return normal_equations(terms, ends, near, *band_of(values + shift))[1].gradient

    # linear in the headings: turn rate and its acceleration
    headings = [BLOCK * i + 2 for i in range(6)]
    for i in headings:
        unit = 1e-6 * np.eye(len(values))[i]
        column = (gradient(unit) - gradient(-unit)) / 2e-6
        np.testing.assert_allclose(matrix[headings, i], column[headings], rtol=1e-5, atol=1e-4)


def test_ways_are_those_of_exact_arcs() -> None:
    for v, omega in ((0.5, 0.0), (0.4, 1.5), (-0.2, -0.7), (0.0, 1.0), (0.3, 1e-5)):
        begin = np.array([1.0, -2.0, 0.7])
        end = se2.integrate_twist(begin, v, 0.0, omega, 0.3)
        end[2] = begin[2] + 0.3 * omega
        np.testing.assert_allclose(ways(np.vstack([begin, end]))[0], [0.3 * v, 0.3 * omega],
                                   atol=1e-12)  # fmt: skip


@given(seed=st.integers(0, 10**6))
@settings(max_examples=50)
def test_resizing_keeps_ends_and_duration_and_nears_the_interval(seed: int) -> None:
    rng = np.random.default_rng(seed)
    band = random_band(rng, int(rng.integers(3, 20)))
    band = Band(band.poses, rng.uniform(0.01, 1.5, len(band.intervals)))
    first, last, duration = band.poses[0], band.poses[-1], band.duration
    for _ in range(20):
        band = Band(*resized(*band, 0.2, 0.4, 200))
        np.testing.assert_array_equal(band.poses[0], first)
        np.testing.assert_array_equal(band.poses[-1], last)
        assert band.duration == pytest.approx(duration)
        assert len(band.poses) == len(band.intervals) + 1 > LEAST_INTERVALS
    assert band.intervals.max() <= 0.6
    if len(band.intervals) > LEAST_INTERVALS:
        assert band.intervals.min() >= 0.1


def test_a_band_along_a_path_turns_and_drives_at_the_limits() -> None:
    points = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    start, goal = np.array([0.0, 0.0, 1.0]), np.array([2.0, 1.0, math.pi])
    band, whole = band_along(points, False, start, goal, LIMITS, 0.3, 60.0)
    assert whole
    assert band.duration == pytest.approx(3.0 / 0.5 + (1.0 + math.pi) / 1.745)
    assert wrap(band.poses[-1, 2] - goal[2]) == pytest.approx(0.0, abs=1e-12)
    rates = np.abs(ways(band.poses)) / band.intervals[:, None]
    assert rates.max(axis=0) == pytest.approx([0.5, 1.745])
    short, whole = band_along(points, False, start, goal, LIMITS, 0.3, 4.0)
    assert not whole
    assert short.duration == pytest.approx(4.0)
    back, _ = band_along(points, True, start, goal, LIMITS, 0.3, 60.0)
    assert (ways(back.poses)[:, 0] <= 1e-12).all()


def test_a_far_goal_costs_no_more_than_the_horizon() -> None:
    far = np.array([1e9, 0.0, 0.0])
    points = np.array([[0.0, 0.0], far[:2]])
    band, whole = band_along(points, False, np.zeros(3), far, LIMITS, 0.3, 30.0)
    assert not whole
    assert len(band.intervals) <= 101


def test_going_along_a_band_leaves_what_lies_ahead() -> None:
    goal = np.array([2.0, 0.0, 0.0])
    points = np.array([[0.0, 0.0], goal[:2]])
    band, _ = band_along(points, False, np.zeros(3), goal, LIMITS, 0.3, 60.0)
    here = np.array([0.4, 0.01, 0.02 + math.tau])
    left, away = gone_along(*band, here, 0.4)
    assert away == pytest.approx(math.hypot(0.01, 0.4 * 0.02))
    assert left.duration == pytest.approx(1.6 / 0.5, rel=0.02)
    np.testing.assert_allclose(left.poses[0], [0.4, 0.01, 0.02], atol=1e-12)
    both = joined(left, Band(with_goal(left, goal).poses + [2.0, 0.0, 0.0], left.intervals))
    assert len(both.poses) == len(both.intervals) + 1


@pytest.mark.parametrize("length", [1.0, 2.0, 5.0])
def test_an_optimised_straight_line_is_nearly_time_optimal(length: float) -> None:
    goal = np.array([length, 0.0, 0.0])
    points = np.array([[0.0, 0.0], goal[:2]])
    band, _ = band_along(points, False, np.zeros(3), goal, LIMITS, 0.3, 60.0)
    parameters, ends = TebParameters(), Ends(0.0, 0.0, True)
    for _ in range(5):  # as from step to step
        band = optimised(
            band, terms_of(LIMITS, parameters), ends, SIDES, EMPTY, outline_of(BOX).radius,
            parameters,
        )  # fmt: skip
    assert band.duration == pytest.approx(length / 0.5 + 0.5 / 0.5, rel=0.05)
    speeds = ways(band.poses)[:, 0] / band.intervals
    assert speeds.max() <= 1.03 * 0.5
    assert np.abs(band.poses[:, 1:]).max() < 1e-6


def test_an_optimised_band_goes_round_an_obstacle_at_the_distance_asked_for() -> None:
    parts = pack_parts(World([polygons.disc(0.2) + np.array([1.5, 0.25])]).solids, None)
    goal, points = np.array([3.0, 0.0, 0.0]), np.array([[0.0, 0.0], [3.0, 0.0]])
    band, _ = band_along(points, False, np.zeros(3), goal, LIMITS, 0.3, 60.0)
    assert min(distance(parts, 0, pose) for pose in band.poses) < -0.1
    parameters = TebParameters(distance=0.1)
    for _ in range(5):
        band = optimised(
            band, terms_of(LIMITS, parameters), Ends(0.0, 0.0, True), SIDES, parts,
            outline_of(BOX).radius, parameters,
        )  # fmt: skip
    assert min(distance(parts, 0, pose) for pose in band.poses) > 0.09
    assert band.duration < 1.1 * (3.0 / 0.5 + 1.0)
    sideways = ways(band.poses)[:, 0] - np.hypot(*np.diff(band.poses[:, :2], axis=0).T)
    assert np.abs(sideways).max() < 0.01


@pytest.mark.parametrize(
    "wrong",
    [
        {"interval_slack": 0.3},
        {"horizon": 2.0},
        {"distance": -0.1},
        {"obstacle_weight": math.nan},
        {"inner_iterations": 0},
        {"no_such_weight": 1.0},
    ],
)
def test_parameters_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        TebParameters.model_validate(wrong)


# --- what is kept of a world ---


def a_world(shift: float = 0.0) -> World:
    room = polygons.rectangle(10.0, 8.0)
    things: list[ObstacleLike] = [
        polygons.rectangle(0.4, 0.4) + np.array([2.0 + shift, 0.0]),
        Obstacle(room + 30.0),
    ]
    return World([*things, Disc((0.0, 3.0), 0.3, (0.1, 0.0))], room)


def test_what_stands_still_is_prepared_once_though_other_things_move() -> None:
    outline = outline_of(BOX)
    world = a_world()
    scene = scene_of(world, outline, 0.02)
    for other in (world.after(0.05), world.after(0.05).after(0.05), a_world()):
        later = scene_of(other, outline, 0.02, scene)
        assert later.edges is scene.edges
        assert later.standing is scene.standing
    assert scene_of(world.after(1.0), outline, 0.02, scene).parts.boxes[-1] == pytest.approx(
        scene.parts.boxes[-1] + [0.1, 0.0, 0.1, 0.0]
    )


def test_what_has_changed_is_prepared_anew() -> None:
    outline = outline_of(BOX)
    world = a_world()
    scene = scene_of(world, outline, 0.02)
    ways = np.zeros((3, 3))
    ways[0, 2] = 0.01
    stopped = World([*world.obstacles[:2], Disc((0.0, 3.0), 0.3)], world.boundary)
    open_floor = World([*world.obstacles[:2], Disc((0.0, 3.0), 0.3, (0.1, 0.0))])
    for other in (world.transformed(ways), a_world(1e-3), stopped, open_floor):
        assert scene_of(other, outline, 0.02, scene).edges is not scene.edges


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1, 2.7])
def test_what_just_touches_still_has_a_direction(angle: float) -> None:
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    square = polygons.rectangle(0.5, 0.5)
    for gap in (-1e-17, 0.0, 1e-17, 1e-16, 1e-15, 1e-13):
        parts = pack_parts(World([(square + np.array([0.59 + gap, 0.0])) @ turn.T]).solids, None)
        base = footprint_sides(BOX)
        place_footprint(footprint_sides(BOX), 0.0, 0.0, angle, base)
        away, nx, ny, _, _ = separation(base, parts, 0, 0.0, 0.0, 1.0)
        assert away == pytest.approx(0.0, abs=1e-12)
        assert (nx, ny) == pytest.approx((-math.cos(angle), -math.sin(angle)), abs=1e-6)
