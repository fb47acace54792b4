"""What touches meets exactly, so that no crack is left between obstacles that touch."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav import union
from motm_wbc.basenav.noding import Rings, near_misses, noded
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.union import united
from motm_wbc.basenav.walls import TOUCH, X, Y
from motm_wbc.basenav.world import World
from motm_wbc.errors import NoPath
from motm_wbc.geometry import se2
from motm_wbc.geometry.polygons import rectangle

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def rings_of(*outlines):
    closed = [np.vstack([points, points[:1]]) for points in map(np.asarray, outlines)]
    number = np.repeat(np.arange(len(closed)), [len(points) for points in closed])
    return Rings(np.vstack(closed), number)


def brute_force_misses(rings, apart):
    """Corners that shapely finds near an edge, but that are not one of its ends."""
    points, ring = rings
    found = set()
    for a in range(len(points) - 1):
        if ring[a] != ring[a + 1]:
            continue
        edge = shapely.LineString(points[a : a + 2])
        for corner, place in enumerate(points):
            ends = (place == points[a : a + 2]).all(axis=1).any()
            if not ends and edge.distance(shapely.Point(place)) <= apart:
                found.add((a, corner))
    return found


@given(st.integers(0, 10**6), st.sampled_from([1e-9, 0.0523, 0.313]))
def test_near_misses_are_those_of_brute_force(seed, apart):
    rng = np.random.default_rng(seed)
    outlines = [np.round(rng.uniform(0.0, 3.0, (5, 2)), seed % 3) for _ in range(4)]
    outlines = [points for points in outlines if len(np.unique(points, axis=0)) == 5]
    if outlines:
        rings = rings_of(*outlines)
        found = {tuple(pair) for pair in near_misses(rings, apart).tolist()}
        assert found == brute_force_misses(rings, apart)


@given(st.integers(0, 10**6))
def test_noded_rings_have_no_near_misses_and_have_moved_little(seed):
    rng = np.random.default_rng(seed)
    pose = np.array([*rng.uniform(-5.0, 5.0, 2), rng.uniform(0.0, math.tau)])
    tiles = [SQUARE * rng.uniform(0.5, 1.5, 2) + place for place in rng.integers(0, 3, (6, 2))]
    tiles = [se2.transform_points(pose, points) for points in tiles]
    before = rings_of(*(points + rng.uniform(-2e-10, 2e-10, points.shape) for points in tiles))
    after = noded(before, TOUCH)
    assert len(near_misses(after, TOUCH)) == 0
    gap = np.hypot(*(after.points[:, None] - before.points[None]).transpose(2, 0, 1)).min(axis=1)
    assert gap.max() < 5.0 * TOUCH


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
    return walls, pose[:2].copy(), se2.transform_points(pose, np.array([[3.0, 3.5]]))[0]


def is_open(world, inside, outside):
    planner = GlobalPlanner(world, 0.5, 1.745)
    ways = []
    for start, goal in ((inside, outside), (outside, inside)):
        try:
            planner.plan((*start, None), (*goal, None))
        except NoPath:
            ways.append(False)
        else:
            ways.append(True)
    assert ways[0] == ways[1]
    return ways[0]


@pytest.mark.parametrize("offset", [0.0, 3.0, 3000.0])
def test_a_closed_chamber_is_closed_wherever_it_is_and_moves(offset):
    rng = np.random.default_rng(0)
    posts = [rectangle(0.5, 0.5) + np.array([30.0 + 2.0 * k, 20.0]) for k in range(40)]
    parts = 0
    for _ in range(60):
        walls, inside, outside = chamber(rng, offset)
        alone, among = World(walls), World([*walls, *(post + inside for post in posts)])
        way = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(0.0, math.tau)])
        moved = among.transformed(np.tile(way, (44, 1)))
        places = np.array([inside, outside])
        parts += among.near(0.0, inside, outside, 6.0).ellipse is not None
        assert not is_open(alone, inside, outside)
        assert not is_open(among, inside, outside)
        assert not is_open(moved, *se2.transform_points(way, places))
        assert is_open(World(walls[1:]), inside, outside)
    assert parts == 60


def test_a_polygon_that_geos_loses_is_noticed(monkeypatch):
    """Seen of GEOS 3.14: of four walls about a room, the union had two."""
    parts = [Polygon(SQUARE), Polygon(SQUARE + 0.5), Polygon(SQUARE + 1.0)]
    whole = shapely.union_all(parts)
    plain = shapely.union_all
    asked = []

    def forgetful(shapes, grid_size=None):
        asked.append(grid_size)
        return plain(shapes[:-1] if grid_size is None else shapes, grid_size=grid_size)

    monkeypatch.setattr(union.shapely, "union_all", forgetful)
    (found,) = united(parts)
    assert len(asked) == 2
    assert found.symmetric_difference(whole).area < 1e-9


def test_what_is_cut_out_is_gone_even_if_geos_leaves_it(monkeypatch):
    plain = shapely.difference

    def careless(whole, taken, grid_size=None):
        return whole if grid_size is None else plain(whole, taken, grid_size=grid_size)

    monkeypatch.setattr(union.shapely, "difference", careless)
    (left,) = united([Polygon(4.0 * SQUARE)], [Polygon(SQUARE + 1.0)])
    assert left.area == pytest.approx(15.0, abs=1e-9)


@pytest.mark.parametrize("gap", [0.0, 1e-13, 1e-11, 9e-10])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_slits_thinner_than_what_touches_are_closed(gap, angle):
    pose = np.array([1.0, 2.0, angle])
    blocks = [SQUARE * 2.0, SQUARE + [2.0 + gap, 0.5], SQUARE * 2.0 + [0.5, 2.0 + gap]]
    (part,) = united([Polygon(se2.transform_points(pose, block)) for block in blocks])
    assert len(part.interiors) == 0
    assert part.area == pytest.approx(9.0, abs=1e-8)


def test_gaps_wider_than_what_touches_are_open():
    assert len(united([Polygon(SQUARE), Polygon(SQUARE + [1.0 + 3e-9, 0.5])])) == 2


def test_rooms_joined_by_a_slit_are_two():
    """The same of free space: what is cut out of a floor meets up to rounding."""
    pose = np.array([0.3, 0.2, 0.7])
    floor = se2.transform_points(pose, 4.0 * SQUARE)
    bars = [np.array([[0, 1], [2.5, 1], [2.5, 1.2], [0, 1.2]])]
    bars.append(np.array([[2.5 + 3e-10, 0.8], [4, 0.8], [4, 1.5], [2.5 + 3e-10, 1.5]]))
    world = World([se2.transform_points(pose, bar) for bar in bars], floor)
    below, above = se2.transform_points(pose, np.array([[1.0, 0.5], [1.0, 3.0]]))
    assert not is_open(world, below, above)


@pytest.mark.parametrize("width", [1e-13, 1e-11, 5e-10])
def test_slivers_of_free_space_are_filled(width):
    """What is pushed out to one would never get out of it."""
    sliver = np.array([[0.5, 0.5], [0.9, 0.5], [0.5, 0.5 + width]])
    for block in (Polygon(SQUARE, [sliver]), Polygon(SQUARE, [sliver[:, ::-1]])):
        for parts in ([block], [block, Polygon(SQUARE + [0.3, 0.95])]):
            assert all(len(part.interiors) == 0 for part in united(parts))
    assert len(united([Polygon(SQUARE, [sliver + [[0, 0], [0, 0], [0, 1e-3]]])])[0].interiors) == 1


@pytest.mark.parametrize("inflation", [1e-13, 1e-11, 1e-9, 2e-9, 1e-8, 1e-6])
def test_no_inflation_is_so_small_that_an_obstacle_is_gone(inflation):
    corners = World([SQUARE]).inflated(inflation).walls.corners
    assert len(corners) >= 4
    assert corners[:, [X, Y]].min() == pytest.approx(0.0, abs=2.0 * inflation + 1e-9)
    assert corners[:, [X, Y]].max() == pytest.approx(1.0, abs=2.0 * inflation + 1e-9)


def test_far_from_the_origin_more_counts_as_touching():
    away = np.array([3e6, -2e6])
    blocks = [2.0 * SQUARE + away, SQUARE + [2.0, 0.5] + away]
    turned = np.array([0.0, 0.0, 1.0])
    for blocks_at in (blocks, [se2.transform_points(turned, block) for block in blocks]):
        (part,) = united([Polygon(block) for block in blocks_at])
        assert part.area == pytest.approx(5.0, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
@pytest.mark.parametrize("floor", [None, 8.0 * SQUARE - 4.0])
def test_a_place_where_two_touch_is_reached_from_either_side(angle, floor):
    """A chain of squares that touch at corners, from one side of the floor to the other."""
    pose = np.array([0.0, 0.0, angle])
    chain = [SQUARE * 2.0 + [x, -1.0 + 2.0 * (k % 2)] for k, x in enumerate((-5, -3, -1, 1, 3))]
    chain = [se2.transform_points(pose, block - [0.0, 1.0]) for block in chain]
    world = World(chain, None if floor is None else se2.transform_points(pose, floor))
    planner = GlobalPlanner(world, 0.5, 1.745)
    touch, above, below, left, right = se2.transform_points(
        pose, np.array([[-1.0, 0.0], [-2.0, 2.6], [-0.2, -2.6], [-3.5, 2.0], [3.9, 2.9]])
    )
    for place in (above, below):
        path = planner.plan((*place, None), (*touch, None))
        assert path.goal_push == 0.0
        assert path.length < 6.0
        assert is_open(world, place, touch)
    assert is_open(world, left, right)
    assert is_open(world, above, below) == (floor is None)


def test_corners_that_share_a_place_have_blocked_sectors_apart():
    pose = np.array([0.2, 0.1, 0.4])
    chequers = [SQUARE + [i, j] for i in range(4) for j in range(4) if (i + j) % 2 == 0]
    floor = se2.transform_points(pose, 6.0 * SQUARE - 1.0)
    for boundary in (None, floor):
        world = World([se2.transform_points(pose, block) for block in chequers], boundary)
        walls = world.inflated(0.0).walls
        twins = walls.links[:, 2] != np.arange(len(walls.links))
        assert twins.sum() == 18
        assert walls.corners[twins, 6] == pytest.approx(0.5 * math.pi)
