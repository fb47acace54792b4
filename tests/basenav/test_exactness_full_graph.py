"""The planner against the brute-force reference; and that reference against what is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import MultiPolygon, Polygon, box

from benchmarks import exactness
from benchmarks.exact.maps import KINDS
from benchmarks.exact.reference import Reference, Speeds
from benchmarks.exact.sight import FreeSpace
from benchmarks.exact.straight import make_room, our_lengths
from benchmarks.exactness import compare, table

SPEEDS = Speeds(0.5, 0.0, 2.0)
SEEDS = range(1000, 1004)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("kind", KINDS)
def test_times_and_reachability_are_those_of_the_full_graph(kind, seed):
    assert max(compare(kind, seed, queries=4).errors) <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_same_on_many_maps(kind):
    found = [compare(kind, seed, queries=6) for seed in range(2000, 2050)]
    assert max(max(one.errors) for one in found) <= 1e-9, table(found)


@pytest.mark.parametrize("seed", range(10))
def test_lengths_are_the_shortest_if_turning_is_for_nothing(seed):
    room = make_room(np.random.default_rng(seed), queries=5)
    blocked = MultiPolygon([Polygon(points) for points in room.obstacles])
    space = FreeSpace(MultiPolygon([box(-5, -5, 5, 5).difference(blocked)]), bounded=True)
    reference = Reference(space)
    quick = Speeds(1.0, 0.0, 1e12)
    expected = [reference.time((*p, None), (*q, None), quick) for p, q in room.queries]
    assert our_lengths(room) == pytest.approx(expected, abs=1e-6)


@pytest.fixture(scope="module")
def square():
    return Reference(FreeSpace(MultiPolygon([box(0, 0, 1, 1)]), bounded=False))


def test_the_reference_counts_length_and_turns(square):
    straight = square.time((-1, 2, 0.0), (2, 2, math.pi / 2), SPEEDS)
    assert straight == pytest.approx(3 / 0.5 + math.pi / 2 / 2)
    round_corners = square.time((-1, 0.5, None), (2, 0.5, None), SPEEDS)
    angle = math.atan2(0.5, 1.0)
    expected = (2 * math.hypot(1, 0.5) + 1) / 0.5 + 2 * angle / 2
    assert round_corners == pytest.approx(expected)


def test_the_reference_reverses_in_one_gear(square):
    speeds = Speeds(0.5, 0.25, 2.0)
    start, goal = (-1, 2, 0.0), (-2, 2, 0.0)
    assert square.time(start, goal, speeds) == pytest.approx(min(4.0, 2.0 + math.pi))
    assert square.time(start, goal, SPEEDS) == pytest.approx(2.0 + math.pi)


def test_the_reference_turns_in_place(square):
    assert square.time((2, 2, 0.0), (2, 2, 3.0), SPEEDS) == pytest.approx(1.5)
    assert square.time((2, 2, None), (2, 2, 3.0), SPEEDS) == 0.0


@pytest.mark.parametrize(
    ("gap", "length"),
    [(0.0, 2.0 + math.sqrt(2.0)), (1e-6, math.sqrt(2.0))],  # round one of them, or between
)
def test_the_reference_goes_through_gaps_only(gap, length):
    squares = MultiPolygon([box(0, 0, 1, 1), box(1 + gap, 1 + gap, 2, 2)])
    reference = Reference(FreeSpace(squares, bounded=False))
    start, goal = (0.5, 1.5 + gap, None), (1.5 + gap, 0.5, None)
    assert reference.time(start, goal, Speeds(1.0, 0.0, 1e12)) == pytest.approx(length, abs=1e-5)


def test_the_reference_finds_no_way_out_of_a_ring():
    ring = box(-2, -2, 2, 2).difference(box(-1, -1, 1, 1))
    reference = Reference(FreeSpace(MultiPolygon([ring]), bounded=False))
    assert reference.time((0, 0, None), (3, 3, None), SPEEDS) == math.inf
    assert reference.time((0, 0, None), (0.5, 0.5, None), SPEEDS) < 2.0


def test_a_planner_that_is_wrong_is_found_out(monkeypatch):
    """A planted fault: the planner turns at another rate than it says."""
    real = exactness.GlobalPlanner

    def wrong(world, v, omega, inflation, reverse):
        return real(world, v, omega * (1.0 + 1e-6), inflation, reverse)

    monkeypatch.setattr(exactness, "GlobalPlanner", wrong)
    assert max(compare("convex", 1000, queries=6).errors) > 1e-9


def test_the_table_names_differences():
    good = compare("convex", 1000, 2)
    bad = replace(good, kind="holes", errors=(math.inf, 0.0))
    lines = table([good, bad]).splitlines()
    assert lines[1].endswith("same")
    assert lines[2].endswith("1 !")
