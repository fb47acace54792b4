"""Between obstacles that touch there is no passage, however they are turned."""

import math

import numpy as np
import pytest

from motm_wbc.basenav import GlobalPlanner, Obstacle, World
from motm_wbc.errors import NoPath
from motm_wbc.geometry import se2


def chamber(rng, offset):
    """Four walls about a room, each with its end against the next one's flank, turned."""
    half, thick = rng.uniform(0.5, 1.5), rng.uniform(0.1, 0.3)
    start = -half - thick - 0.2
    wall = np.array([[start, -half - thick], [half, -half - thick], [half, -half], [start, -half]])
    pose = np.array([*rng.uniform(-offset, offset, 2), rng.uniform(0.0, math.tau)])
    quarters = (np.array([0.0, 0.0, 0.5 * math.pi * k]) for k in range(4))
    walls = [
        se2.transform_points(pose, se2.transform_points(quarter, wall)) for quarter in quarters
    ]
    inside = se2.transform_points(pose, rng.uniform(-0.4, 0.4, (1, 2)))[0]
    outside = se2.transform_points(pose, rng.uniform(3.0, 4.0, (1, 2)))[0]
    return walls, inside, outside


@pytest.mark.parametrize("offset", [0.0, 3.0, 900.0])
def test_a_closed_chamber_is_closed(offset):
    rng = np.random.default_rng(0)
    for _ in range(150):
        walls, inside, outside = chamber(rng, offset)
        planner = GlobalPlanner(World(walls), 0.5, 1.745)
        for start, goal in ((inside, outside), (outside, inside)):
            with pytest.raises(NoPath):
                planner.plan((*start, None), (*goal, None))


def test_a_chamber_with_a_door_is_open():
    """Without this, a planner that finds nothing would pass."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        walls, inside, outside = chamber(rng, 3.0)
        planner = GlobalPlanner(World(walls[:3]), 0.5, 1.745)
        assert planner.plan((*inside, None), (*outside, None)).length > 2.0


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0])
def test_discs_of_free_space_that_touch_at_a_corner_are_apart(angle):
    """Two holes in a plate that meet in one point: no way from one to the other."""
    pose = np.array([0.4, -0.7, angle])
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    plate = se2.transform_points(pose, 6.0 * (square - 0.5))
    holes = tuple(se2.transform_points(pose, points) for points in (square, square - 1.0))
    planner = GlobalPlanner(World([Obstacle(plate, holes)]), 0.5, 1.745)
    first, second = se2.transform_points(pose, np.array([[0.5, 0.5], [-0.5, -0.5]]))
    with pytest.raises(NoPath):
        planner.plan((*first, None), (*second, None))
    assert planner.plan((*first, None), (*(first + 0.1), None)).length == pytest.approx(
        0.1 * math.sqrt(2.0)
    )
