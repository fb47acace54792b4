"""Rooms of the free space, against paths."""

import math

import numpy as np
import pytest

from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.rooms import may_be_joined
from motm_wbc.basenav.visibility import push_out
from motm_wbc.basenav.world import World
from motm_wbc.geometry.polygons import rectangle


def thin(rng, side):
    """A long thin obstacle; many of them close off rooms."""
    bar = rectangle(rng.uniform(2.0, 6.0), 0.2)
    turn = rng.choice([0.0, 0.5 * math.pi, rng.uniform(0.0, math.pi)])
    c, s = math.cos(turn), math.sin(turn)
    return bar @ np.array([[c, s], [-s, c]]) + rng.uniform(-0.5 * side, 0.5 * side, 2)


def test_places_are_joined_if_and_only_if_a_path_leads_there():
    found = {True: 0, False: 0}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        boundary = rectangle(12.0, 12.0) if seed % 2 else None
        world = World([thin(rng, 12.0) for _ in range(22)], boundary)
        nav = GlobalPlanner(world, 0.5, 1.745, inflation=0.1)
        walls = nav.inflated.walls
        for start, goal in rng.uniform(-5.5, 5.5, (12, 2, 2)):
            reached = nav.route(np.array([*start, 0.0]), np.array([*goal, 0.0])) is not None
            joined = may_be_joined(walls, start, goal)
            assert joined or not reached
            if push_out(walls, *start, np.empty(2)) == 0.0:
                assert joined == reached
                found[joined] += 1
    assert min(found.values()) > 15


@pytest.mark.parametrize("order", [1, -1])
def test_a_room_in_a_room(order):
    bars = [
        bar
        for size in (8.0, 2.0)
        for bar in (
            *(rectangle(size + 0.2, 0.2) + np.array([0.0, 0.5 * y * size]) for y in (-1, 1)),
            *(rectangle(0.2, size + 0.2) + np.array([0.5 * x * size, 0.0]) for x in (-1, 1)),
        )
    ]
    walls = World(bars[::order]).inflated(0.0).walls
    places = {"inner": (0.0, 0.0), "outer": (2.0, 0.5), "outside": (6.0, 0.0)}
    for name, here in places.items():
        for other, there in places.items():
            assert may_be_joined(walls, np.array(here), np.array(there)) == (name == other)
    assert may_be_joined(walls, np.array([-2.0, 2.0]), np.array([2.0, -2.0]))


def test_a_goal_that_is_pushed_out_lies_in_the_room_that_it_is_pushed_to():
    yard = [rectangle(6.0, 1.0) + np.array([0.0, y]) for y in (-3.0, 3.0)]
    yard += [rectangle(1.0, 6.0) + np.array([x, 0.0]) for x in (-3.0, 3.0)]
    walls = World(yard).inflated(0.0).walls
    start = np.array([9.0, 0.0])
    assert may_be_joined(walls, start, np.array([3.4, 0.0]))
    assert not may_be_joined(walls, start, np.array([2.6, 0.0]))
    assert may_be_joined(walls, np.array([2.6, 0.0]), start)  # out of it by any outline


@pytest.mark.parametrize("corner", [(1.0, 1.0), (0.5, 0.0)])
def test_on_an_outline_nothing_is_claimed(corner):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    walls = World([square, square + 1.0]).inflated(0.0).walls
    assert may_be_joined(walls, np.array([5.0, 0.0]), np.array(corner))
