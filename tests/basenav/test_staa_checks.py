"""Footprint checks, proximity grid, actions and braking of the local planner."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav.footprint_check import edge_map, grown_corners, outline_of, pose_is_clear
from motm_wbc.basenav.proximity import largest_under, proximity_grid, rings_of, sample_outline
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_admissible import executed, in_reach
from motm_wbc.basenav.staa_motion import (
    arc,
    braking_rates,
    drive_of,
    profile,
    stopping_duration,
    stopping_span,
    travel,
    velocity_after,
)
from motm_wbc.basenav.staa_root import keep_of, with_direction
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.base_motion import BaseLimits, braking_arc

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
DRIVE = drive_of(LIMITS, step=0.3, period=0.05, ramp_steps=6)
BOX = polygons.rectangle(0.68, 0.47)
SHAPES = [BOX, np.array([[0.5, 0.0], [-0.2, 0.3], [-0.3, -0.2]]), polygons.disc(0.3, 9)]


def star(rng: np.random.Generator, centre: np.ndarray) -> np.ndarray:
    """A simple polygon, concave as a rule, of random winding."""
    count = int(rng.integers(3, 9))
    angles = np.sort(rng.uniform(0.0, math.tau, count))
    radii = rng.uniform(0.05, 0.8, count)
    points = centre + radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return points if rng.random() < 0.5 else points[::-1].copy()


@given(seed=st.integers(0, 10**6), margin=st.sampled_from([0.0, 0.02, 0.1]))
@settings(max_examples=60, deadline=None)
def test_footprint_check_agrees_with_shapely(seed: int, margin: float) -> None:
    rng = np.random.default_rng(seed)
    solids = [star(rng, rng.uniform(-2.0, 2.0, 2)) for _ in range(rng.integers(1, 6))]
    solids = [solid for solid in solids if Polygon(solid).is_valid and Polygon(solid).area > 1e-3]
    assume(solids)
    boundary = np.array([[-2.5, -2.5], [2.5, -2.5], [2.0, 2.5], [-2.5, 2.5]])
    bounded = rng.random() < 0.5
    outline = outline_of(SHAPES[seed % len(SHAPES)])
    grown = grown_corners(outline, margin)
    rings = World(solids, boundary if bounded else None).rings
    world = edge_map(rings, bounded, float(np.linalg.norm(grown, axis=1).max()))
    blocked = shapely.union_all([Polygon(solid) for solid in solids])
    for _ in range(40):
        pose = np.array([*rng.uniform(-3.0, 3.0, 2), rng.uniform(-4.0, 4.0)])
        base = Polygon(polygons.place(grown, pose))
        overlap = base.intersection(blocked).area
        if bounded:
            overlap += base.difference(Polygon(boundary)).area
        if overlap == 0.0:
            assert pose_is_clear(world, outline, pose, margin)
        elif overlap > 1e-9:
            assert not pose_is_clear(world, outline, pose, margin)


def test_what_lies_wholly_inside_or_around_is_seen() -> None:
    outline = outline_of(BOX)
    big = edge_map([polygons.rectangle(20.0, 20.0)], False, 0.5)
    assert not pose_is_clear(big, outline, np.array([0.0, 0.0, 0.3]), 0.0)
    assert pose_is_clear(big, outline, np.array([12.0, 0.0, 0.3]), 0.0)
    needle = edge_map([polygons.rectangle(0.001, 0.001)], False, 0.5)
    assert not pose_is_clear(needle, outline, np.array([0.1, 0.1, 0.3]), 0.0)
    pen = edge_map([polygons.rectangle(2.0, 2.0)[::-1]], True, 0.5)
    assert pose_is_clear(pen, outline, np.array([0.0, 0.0, 0.3]), 0.0)
    assert not pose_is_clear(pen, outline, np.array([0.8, 0.0, 0.0]), 0.0)
    assert not pose_is_clear(pen, outline, np.array([50.0, 0.0, 0.0]), 0.0)
    assert pose_is_clear(edge_map([], False, 0.5), outline, np.zeros(3), 0.0)


def test_touching_is_free_and_the_margin_counts() -> None:
    outline = outline_of(polygons.rectangle(0.5, 0.5))
    block = polygons.place(polygons.rectangle(1.0, 1.0), np.array([0.75, 0.0, 0.0]))
    wall = edge_map([block], False, 0.5)
    assert pose_is_clear(wall, outline, np.zeros(3), 0.0)
    assert not pose_is_clear(wall, outline, np.array([0.001, 0.0, 0.0]), 0.0)
    assert not pose_is_clear(wall, outline, np.array([-0.019, 0.0, 0.0]), 0.02)
    assert pose_is_clear(wall, outline, np.array([-0.021, 0.0, 0.0]), 0.02)


def test_proximity_falls_from_one_to_zero_within_its_radius() -> None:
    rings = rings_of([polygons.rectangle(0.4, 0.4)], False)
    grid = proximity_grid(rings, (0.0, 0.0), 2.0, 0.05, 0.25, 0.4)
    row = int((0.0 - grid.y0) / grid.cell)
    along = [grid.values[row, int((x - grid.x0) / grid.cell)] for x in np.arange(0.0, 0.6, 0.05)]
    assert along[0] == pytest.approx(1.0)
    assert along[-1] == 0.0
    assert (np.diff(along) <= 0.0).all()
    assert 0.0 < along[6] < 1.0  # 0.1 m off the box
    assert (grid.around >= grid.values).all()
    outline = outline_of(BOX)
    samples = sample_outline(outline)
    assert largest_under(grid, samples, 1.5, 0.0, 1.0, 0.0) == 0.0
    near = largest_under(grid, samples, 0.6, 0.0, 1.0, 0.0)
    assert largest_under(grid, samples, 0.7, 0.0, 1.0, 0.0) < near <= 1.0


def test_a_cell_has_the_same_value_in_every_square() -> None:
    rings = rings_of([polygons.disc(0.3), polygons.rectangle(6.0, 6.0)[::-1]], True)
    first = proximity_grid(rings, (0.0, 0.0), 2.0, 0.05, 0.25, 0.4)
    second = proximity_grid(rings, (2.0, -1.0), 2.0, 0.05, 0.25, 0.4)
    columns = round((second.x0 - first.x0) / 0.05)
    rows = round((second.y0 - first.y0) / 0.05)
    size = first.values.shape[0]
    inner = slice(15, -15)  # the rim of a square knows nothing of what is beyond it
    ours = first.values[max(rows, 0) : size + min(rows, 0), columns:][inner, inner]
    theirs = second.values[max(-rows, 0) : size - max(rows, 0), : size - columns][inner, inner]
    assert ours.max() > 0.5
    np.testing.assert_array_equal(ours, theirs)


@given(
    v=st.floats(-0.2, 0.5),
    index=st.integers(0, 6),
    time=st.floats(0.01, 0.3),
)
def test_actions_keep_limits_and_the_way_is_the_integral(v: float, index: int, time: float) -> None:
    target, rate = profile(v, index, 7, 0.5, -0.2, 0.5, 0.3)
    assert -0.2 <= target <= 0.5
    assert 0.0 <= rate <= 0.5
    times = np.linspace(0.0, time, 2001)
    speeds = np.array([velocity_after(v, target, rate, t) for t in times])
    assert np.abs(np.diff(speeds)).max() <= 0.5 * time / 2000 + 1e-12
    assert travel(v, target, rate, time) == pytest.approx(np.trapezoid(speeds, times), abs=1e-7)


def test_an_action_that_would_pass_standstill_ends_there() -> None:
    assert profile(0.1, 0, 3, 0.5, -0.2, 0.5, 0.3) == (0.0, 0.5)
    assert profile(0.15, 0, 3, 0.5, -0.2, 0.5, 0.3) == (0.0, 0.5)
    assert profile(-0.1, 2, 3, 0.5, -0.2, 0.5, 0.3) == (0.0, 0.5)
    # of two that would pass it, the weaker one ends there
    assert profile(0.2, 1, 5, 2.0, -1.7, 1.7, 0.3) == (0.0, 1.0)
    assert profile(0.2, 0, 5, 2.0, -1.7, 1.7, 0.3)[0] == pytest.approx(-0.4)
    assert profile(0.5, 0, 5, 2.0, -1.7, 1.7, 0.3) == (0.0, 2.0)
    assert profile(0.3, 1, 3, 0.5, -0.2, 0.5, 0.3) == (0.3, 0.0)


@given(v=st.floats(-0.2, 0.5), omega=st.floats(-1.745, 1.745), heading=st.floats(-3.0, 3.0))
@settings(deadline=None)
def test_the_braking_arc_is_where_obeyed_brakes_lead(
    v: float, omega: float, heading: float
) -> None:
    begin = np.array([1.0, -2.0, heading])
    span = stopping_span(DRIVE, v, omega)
    foreseen = arc(*with_direction(begin), v * span, omega * span)
    state = with_direction(begin)
    speed, rate = v, omega
    steps = 0
    while (speed != 0.0 or rate != 0.0) and steps < 100:
        decel, alpha = braking_rates(DRIVE, speed, rate)
        assert decel <= 0.5 + 1e-12
        assert alpha <= 2.0 + 1e-12
        a = -math.copysign(decel, speed)
        b = -math.copysign(alpha, rate)
        state = executed(DRIVE, state, speed, rate, a, b)
        speed, rate = speed + a * 0.05, rate + b * 0.05
        speed = 0.0 if abs(speed) < 1e-12 else speed
        rate = 0.0 if abs(rate) < 1e-12 else rate
        steps += 1
    assert speed == rate == 0.0
    np.testing.assert_allclose(state, foreseen, atol=1e-6)
    ideal = braking_arc(begin, v, omega, LIMITS)[-1]
    assert math.hypot(state[0] - ideal[0], state[1] - ideal[1]) < 3e-3
    assert steps <= stopping_duration(DRIVE, v, omega) / 0.05 + 1.0 + 1e-6


@given(
    x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0), heading=st.floats(-3.2, 3.2),
    bearing=st.floats(0.5, 3.1),
)  # fmt: skip
def test_the_region_is_the_same_for_kernels(
    x: float, y: float, heading: float, bearing: float
) -> None:
    region = ReachRegion(np.array([0.15, 0.02]), 0.72, bearing)
    pose, thing = np.array([x, y, heading]), np.array([0.1, -0.2])
    assert in_reach(keep_of(region, thing), 0.0, *with_direction(pose)) == region.contains(
        pose, thing
    )


def test_the_region_is_measured_from_the_arm() -> None:
    region = ReachRegion(np.array([0.15, 0.0]), 0.7, math.radians(150.0))
    assert region.contains(np.zeros(3), np.array([0.84, 0.0]))
    assert not region.contains(np.zeros(3), np.array([0.86, 0.0]))
    assert not region.contains(np.zeros(3), np.array([-0.3, 0.0]))  # behind the arm
    assert region.contains(np.array([0.0, 0.0, math.pi / 2]), np.array([0.6, 0.15]))
