"""Tiles answer what the plain cost-to-go answers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from motm_wbc.basenav.cost_tiles import cost_tiles, tiled_cost_to_go
from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

HALF = 3.0


def random_world(rng: np.random.Generator, count: int) -> World:
    """Convex and concave obstacles that may overlap, within a boundary or not."""
    solids = []
    for _ in range(count):
        corners = int(rng.integers(3, 9))
        angles = math.tau * (np.arange(corners) + rng.uniform(0.0, 0.9, corners)) / corners
        radii = rng.uniform(0.1, 0.6) * rng.uniform(0.4, 1.0, corners)
        points = np.column_stack([np.cos(angles), np.sin(angles)]) * radii[:, None]
        solids.append(points + rng.uniform(-HALF, HALF, 2))
    boundary = polygons.rectangle(2.0 * HALF + 1.0, 2.0 * HALF + 1.0)
    return World(solids, boundary if rng.random() < 0.5 else None)


def poses(rng: np.random.Generator, count: int) -> Array:
    place = rng.uniform(-HALF, HALF, (count, 2))
    return np.column_stack([place, rng.uniform(-4.0, 4.0, count)])


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(("inflation", "reverse"), [(0.3, 0.2), (0.0, 0.0)])
def test_tiles_answer_as_the_plain_cost_to_go(seed: int, inflation: float, reverse: float) -> None:
    rng = np.random.default_rng(seed)
    world = random_world(rng, int(rng.integers(0, 16)))
    planner = GlobalPlanner(world, 0.5, 1.745, inflation, reverse)
    field = planner.goal_field(poses(rng, 1)[0])
    tiles = cost_tiles(field, (0.3, -0.2), HALF - 0.5)  # some poses lie beyond
    for pose in poses(rng, 250):
        expected = cost_to_go(field, *pose)
        assert tiled_cost_to_go(tiles, *pose) == pytest.approx(expected, abs=1e-12)
        assert tiled_cost_to_go(tiles, *pose) == pytest.approx(expected, abs=1e-12)


def test_corners_in_a_line_and_poses_on_outlines() -> None:
    boxes = [polygons.place(polygons.rectangle(0.5, 0.5), np.array([x, y, 0.0]))
             for x in (-1.0, 0.0, 0.5) for y in (-1.0, 0.0, 1.0)]  # fmt: skip
    field = GlobalPlanner(World(boxes), 0.5, 1.745, 0.0, 0.2).goal_field((2.0, 0.0, 0.0))
    tiles = cost_tiles(field, (0.0, 0.0), 2.0)
    places = np.arange(-1.5, 1.51, 0.25)
    for x in places:
        for y in places:
            for heading in (0.0, math.pi / 2, -3.0):
                expected = cost_to_go(field, x, y, heading)
                assert tiled_cost_to_go(tiles, x, y, heading) == pytest.approx(expected, abs=1e-12)


def test_without_room_for_ways_it_answers_all_the_same() -> None:
    rng = np.random.default_rng(3)
    field = GlobalPlanner(random_world(rng, 12), 0.5, 1.745, 0.2, 0.2).goal_field((1.0, 1.0, 0.0))
    tiles = cost_tiles(field, (0.0, 0.0), 2.0)._replace(rings=np.empty(30, dtype=np.int64))
    for pose in poses(rng, 200):
        expected = cost_to_go(field, *pose)
        assert tiled_cost_to_go(tiles, *pose) == pytest.approx(expected, abs=1e-12)


def test_where_nothing_leads_to_the_goal_the_time_is_infinite() -> None:
    pen = [polygons.place(polygons.rectangle(3.0, 0.2), np.array([x, y, turn]))
           for x, y, turn in ((0, 1.4, 0), (0, -1.4, 0), (-1.4, 0, math.pi / 2),
                              (1.4, 0, math.pi / 2))]  # fmt: skip
    field = GlobalPlanner(World(pen), 0.5, 1.745, 0.1, 0.2).goal_field((0.0, 0.0, 0.0))
    tiles = cost_tiles(field, (0.0, 0.0), 3.0)
    assert math.isinf(tiled_cost_to_go(tiles, 2.5, 0.3, 0.0))
    assert math.isfinite(tiled_cost_to_go(tiles, 0.4, 0.3, 0.0))
