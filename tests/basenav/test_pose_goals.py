"""Random pose goals: floors and brute force as they should be, and a sample of the drives."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import log
from benchmarks.navigating.drives import MOST_MOVERS, moving_drives, still_drives, the_base
from benchmarks.navigating.lattice import CELL, HEADINGS, Lattice
from benchmarks.navigating.movers import FASTEST, with_movers
from benchmarks.navigating.moves import make_moves
from benchmarks.navigating.outcome import Outcome, table
from benchmarks.navigating.tasks import ANGLE, DISTANCE, draw_task
from benchmarks.navigating.worlds import DOOR_ROOM, KINDS, MOST, make_floor
from motm_wbc.basenav import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.angles import wrap

BOX = polygons.rectangle(0.68, 0.47)
RADIUS = float(np.hypot(0.34, 0.235))


def room(x, y, *obstacles):
    return World(obstacles, np.array([(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]))


def blocked(world):
    solid = shapely.union_all([shapely.Polygon(s.outline, s.holes) for s in world.solids])
    outside = shapely.box(-50, -50, 50, 50).difference(shapely.Polygon(world.boundary))
    return shapely.union(solid, outside)


# --- motions ---


@pytest.fixture(scope="module")
def moves():
    return make_moves(CELL, HEADINGS, 0.02, RADIUS)


def test_motions_join_nodes_exactly(moves):
    for first in range(HEADINGS):
        for move in range(moves.starts[first], moves.starts[first + 1]):
            between = moves.between[slice(*moves.spans[move])]
            turned = np.arctan2(between[:, 3], between[:, 2])
            column, row, turn = moves.shifts[move]
            assert np.allclose(between[0, :2], 0.0, atol=1e-12)
            assert np.allclose(between[-1, :2], [CELL * column, CELL * row], atol=1e-9)
            assert abs(wrap(turned[0] - math.tau * first / HEADINGS)) < 1e-9
            assert abs(wrap(turned[-1] - math.tau * (first + turn) / HEADINGS)) < 1e-9


def test_motions_do_not_slip_and_are_closely_spaced(moves):
    for begin, end in moves.spans:
        between = moves.between[begin:end]
        steps = np.diff(between[:, :2], axis=0)
        headings = np.unwrap(np.arctan2(between[:, 3], between[:, 2]))
        turns = np.diff(headings)
        middle = headings[:-1] + 0.5 * turns  # the direction of an arc's chord
        across = steps[:, 1] * np.cos(middle) - steps[:, 0] * np.sin(middle)
        assert np.abs(across).max() < 1e-9
        moved = np.hypot(steps[:, 0], steps[:, 1]) + RADIUS * np.abs(turns)
        assert moved.max() <= 0.0201


def test_every_motion_can_be_driven_back(moves):
    headings = np.repeat(np.arange(HEADINGS), np.diff(moves.starts))
    rows = {(h, *shift) for h, shift in zip(headings.tolist(), moves.shifts.tolist(), strict=True)}
    for heading, column, row, turn in rows:
        assert ((heading + turn) % HEADINGS, -column, -row, -turn) in rows


# --- lattice ---


@pytest.fixture(scope="module")
def furnished():
    star = np.array([(2.0, 1.5), (2.2, 2.4), (3.1, 2.5), (2.1, 2.7), (1.4, 3.0), (1.7, 2.2)])
    world = room(4.0, 4.0, star, polygons.rectangle(0.5, 0.3) + [0.9, 0.8])
    return world, Lattice(world, BOX)


@given(seed=st.integers(0, 10_000))
def test_free_poses_are_free(furnished, seed):
    rng = np.random.default_rng(seed)
    world, lattice = furnished
    solid = blocked(world)
    for pose in np.column_stack([rng.uniform(-0.2, 4.2, (200, 2)), rng.uniform(-7.0, 7.0, 200)]):
        away = shapely.distance(shapely.Polygon(polygons.place(BOX, pose)), solid)
        if lattice.is_free(pose):
            assert away >= 0.03 - 1e-9
        else:  # corners of the grown rectangle reach out farther than its sides
            assert away <= 0.03 * math.sqrt(2.0) + 1e-9


def test_ways_are_free_with_the_margin(furnished):
    world, lattice = furnished
    solid, rng = blocked(world), np.random.default_rng(1)
    label = int(np.bincount(lattice.labels[lattice.labels > 0]).argmax())
    nodes = [tuple(node) for node in np.argwhere(lattice.labels == label)]
    for _ in range(10):
        ends = [nodes[k] for k in rng.integers(len(nodes), size=2)]
        way = lattice.way(*ends)
        assert np.allclose(way[0], lattice.pose(ends[0]), atol=1e-9)
        assert np.allclose(way[-1][:2], lattice.pose(ends[1])[:2], atol=1e-9)
        shapes = shapely.polygons([polygons.place(BOX, pose) for pose in way])
        swept = shapely.convex_hull(
            shapely.multipolygons([list(pair) for pair in itertools.pairwise(shapes)])
        )
        assert shapely.distance(swept, solid).min() >= 0.018
        steps = np.hypot(*np.diff(way[:, :2], axis=0).T)
        assert steps.max() <= 0.021


@pytest.mark.parametrize("wide", [0.47, 0.50, 0.53, 0.57, 0.67])
def test_a_door_is_passed_if_it_is_wide_enough(wide):
    low, high = 1.5 - 0.5 * wide, 1.5 + 0.5 * wide
    wall = [np.array([(2.0, a), (2.1, a), (2.1, b), (2.0, b)]) for a, b in ((-1, low), (high, 4))]
    lattice = Lattice(room(4.0, 3.0, *wall), BOX)
    there = lattice.label(np.array([1.0, 1.5, 0.0])) == lattice.label(np.array([3.1, 1.5, 0.0]))
    assert there == (wide >= 0.57)  # 3 cm on each side, and 2 cm for the cells


def test_a_base_can_not_turn_in_a_corridor_narrower_than_its_diagonal():
    for wide, turns in ((0.75, False), (1.0, True)):
        lattice = Lattice(room(3.0, wide), BOX)
        ends = [lattice.label(np.array([1.5, 0.5 * wide, turn])) for turn in (0.0, math.pi)]
        assert min(ends) > 0
        assert (ends[0] == ends[1]) is turns


# --- floors and tasks ---


@pytest.mark.parametrize("seed", range(14))
def test_floors_are_as_described(seed):
    floor = make_floor(seed, 0.47)
    assert floor.kind == list(KINDS)[seed % len(KINDS)]
    assert 1 <= len({solid.source for solid in floor.world.solids}) <= MOST
    size = np.ptp(floor.world.boundary, axis=0)
    assert (size >= 8.0).all() and (size <= 12.0).all()
    again = make_floor(seed, 0.47)
    assert all(
        np.array_equal(a.outline, b.outline)
        for a, b in zip(floor.world.solids, again.world.solids, strict=True)
    )


def test_doors_are_as_wide_as_said():
    gaps = []
    for seed in range(3, 70, len(KINDS)):
        walls = [
            shapely.Polygon(solid.outline)
            for solid in make_floor(seed, 0.47).world.solids
            if len(solid.outline) == 4 and solid.source > 0
        ]
        gaps += [shapely.distance(a, b) for a, b in itertools.pairwise(walls)]
    doors = [gap for gap in gaps if gap < 1.0]
    assert len(doors) >= 10
    assert max(abs(gap - 0.47 - DOOR_ROOM) for gap in doors) < 1e-9


@pytest.mark.parametrize("seed", [0, 4, 5])
def test_goals_can_be_reached(seed):
    floor = make_floor(seed, 0.47)
    lattice, solid = Lattice(floor.world, BOX), blocked(floor.world)
    for index in range(6):
        task = draw_task(floor, lattice, BOX, index, nose=index == 0)
        assert task is not None
        label = lattice.label(task.start)
        assert label > 0
        for goal in task.goals:
            away = shapely.distance(shapely.Polygon(polygons.place(BOX, goal.pose)), solid)
            assert away >= 0.03 - 1e-9
            node = lattice.node_within(goal.pose, DISTANCE, ANGLE, label)
            there = lattice.pose(node)
            assert lattice.label(there) == label
            assert math.dist(there[:2], goal.pose[:2]) <= DISTANCE
            assert abs(wrap(there[2] - goal.pose[2])) <= ANGLE
        if index == 0:
            ahead = task.goals[0].pose[:2] + 0.45 * np.array(
                [math.cos(task.goals[0].pose[2]), math.sin(task.goals[0].pose[2])]
            )
            assert any(
                shapely.Polygon(table_).contains(shapely.Point(ahead)) for table_ in floor.tables
            )


def test_what_moves_does_not_start_at_the_robot():
    world = room(9.0, 9.0)
    points = np.array([(2.0, 2.0), (7.0, 3.0), (7.0, 7.0)])
    for seed in range(40):
        moving = with_movers(world, seed, 1 + seed % MOST_MOVERS, points, 20.0).solids
        assert len(moving) == 1 + seed % MOST_MOVERS
        for solid in moving:
            assert solid.moves
            assert np.hypot(*solid.velocity) <= FASTEST
            assert np.hypot(*(solid.outline - points[0]).T).min() >= 1.5 - 0.31
            assert np.ptp(solid.outline, axis=0).max() <= 0.61


def test_what_moves_keeps_clear_of_what_stands():
    floor = make_floor(4, 0.47)
    points = np.array([(2.0, 2.0), (6.0, 6.0)])
    counts = []
    for seed in range(10):
        world = with_movers(floor.world, seed, 4, points, 20.0)
        counts.append(sum(solid.moves for solid in world.solids))
        still = shapely.union_all([shapely.Polygon(s.outline) for s in world.solids if not s.moves])
        inside = shapely.intersection(still, shapely.Polygon(floor.world.boundary))
        for time in np.arange(0.0, 60.0, 0.7):
            for solid in world.after(float(time)).solids:
                assert not solid.moves or not inside.intersects(shapely.Polygon(solid.outline))
    assert np.mean(counts) >= 3.0


# --- drives ---


def check(outcomes):
    """What must hold of all drives, whatever is reached."""
    text = table(outcomes)
    assert sum(outcome.collisions - outcome.excused for outcome in outcomes) == 0, text
    assert max(outcome.excess for outcome in outcomes) == 0.0, text
    return text


def test_a_few_goals():
    outcomes = still_drives(1, 2, "staa")  # one obstacle: quick
    text = check(outcomes)
    assert [outcome.leg for outcome in outcomes] == ["nose", "leave", "through"]
    assert all(outcome.reached for outcome in outcomes), text
    assert all(outcome.ratio < 1.4 for outcome in outcomes), text


@pytest.mark.slow
def test_goals_on_floors_of_all_kinds():
    outcomes = [out for seed in range(2 * len(KINDS)) for out in still_drives(seed, 3, "staa")]
    text = check(outcomes)
    assert all(outcome.reached for outcome in outcomes), text
    ratios = [outcome.ratio for outcome in outcomes]
    assert np.median(ratios) <= 1.10 and np.quantile(ratios, 0.95) <= 1.4, text


@pytest.mark.slow
def test_goals_among_what_moves():
    outcomes = [out for seed in range(20) for out in moving_drives(seed, "staa")]
    text = check(outcomes)
    assert sum(outcome.reached for outcome in outcomes) >= 0.95 * len(outcomes), text


def test_the_log_gives_outcomes_back(tmp_path):
    outcome = Outcome(
        scene=3, kind="doors", index=1, leg="stop", movers=0, start=(1.0, 2.0, 0.5),
        goal=(2.0, 2.0, 0.0), reached=False, reason="stuck at (1, 2)", time=30.0, bound=10.0,
        alone=0.0, inflation=0.29, collisions=0, excused=0, clearance=0.02, excess=0.0,
        blocked=1, guards=0, steps=600, step_ms=2.0, step_p99_ms=9.0,
    )  # fmt: skip
    log.append(tmp_path / "log.jsonl", [outcome])
    assert log.read(tmp_path / "log.jsonl", Outcome) == [outcome]
    assert "stuck" in table([outcome])
    assert the_base().width == pytest.approx(0.47)
