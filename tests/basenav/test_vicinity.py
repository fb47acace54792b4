"""The part of a world that matters to a path, against the whole of it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav.goal_field import cost_to_go, first_move
from motm_wbc.basenav.inflation import OUTER
from motm_wbc.basenav.obstacle import Disc, Obstacle
from motm_wbc.basenav.outlines import APART, HOLDS, MEETS, Ellipse, pack, relations
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.vicinity import rounded_up
from motm_wbc.basenav.visibility import push_out
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry.polygons import disc, rectangle

FIRST, SECOND = np.array([-2.0, 0.0]), np.array([2.0, 1.0])


def convex(rng, side):
    sides = int(rng.integers(3, 9))
    angles = np.sort(rng.uniform(0.0, math.tau, sides))
    points = rng.uniform(0.2, 0.8) * np.column_stack([np.cos(angles), np.sin(angles)])
    return points + rng.uniform(-0.5 * side, 0.5 * side, 2)


def scattered(seed, count, room):
    """Convex obstacles, one on `room` square metres; and the side of their square."""
    rng = np.random.default_rng(seed)
    side = math.sqrt(count * room)
    shapes = [convex(rng, side) for _ in range(2 * count)]
    return [points for points in shapes if Polygon(points).area > 1e-3][:count], side


def ring_of_posts(ellipse, away, count=24):
    """Small squares whose nearest corner lies `away` outside of an ellipse."""
    centre = 0.5 * np.array([ellipse[0] + ellipse[2], ellipse[1] + ellipse[3]])
    axis = np.array([ellipse[2] - ellipse[0], ellipse[3] - ellipse[1]])
    focal = 0.5 * np.hypot(*axis)
    long = 0.5 * ellipse.length
    short = math.sqrt(long**2 - focal**2)
    turn = math.atan2(axis[1], axis[0])
    c, s = math.cos(turn), math.sin(turn)
    posts = []
    for angle in np.arange(count) * math.tau / count:
        place = np.array([long * math.cos(angle), short * math.sin(angle)])
        normal = np.array([math.cos(angle) / long, math.sin(angle) / short])
        normal /= np.hypot(*normal)
        diamond = np.array([[0.0, 0.0], [0.05, 0.05], [0.1, 0.0], [0.05, -0.05]])
        out = diamond @ np.array([[normal[0], normal[1]], [-normal[1], normal[0]]])
        posts.append((place + away * normal + out) @ np.array([[c, s], [-s, c]]) + centre)
    return posts


@pytest.mark.parametrize("length", [4.2, 5.0, 9.0])
def test_posts_at_the_rim_of_an_ellipse_are_told_apart(length):
    ellipse = Ellipse(*FIRST, *SECOND, length)
    outside = pack([(post,) for post in ring_of_posts(ellipse, 1e-6)])
    inside = pack([(post,) for post in ring_of_posts(ellipse, -1e-6)])
    assert (relations(outside, ellipse) == APART).all()
    assert (relations(inside, ellipse) == MEETS).all()


def test_an_ellipse_may_lie_in_a_polygon_or_in_its_hole():
    ellipse = Ellipse(0.0, 0.0, 1.0, 0.0, 1.5)
    box, hole = rectangle(8.0, 8.0), rectangle(4.0, 4.0)[::-1]
    beside = hole + np.array([1.9, 0.0])
    found = relations(pack([(box,), (box, hole), (box, beside)]), ellipse)
    assert found.tolist() == [HOLDS, APART, MEETS]


coordinate = st.floats(-6.0, 6.0)


@given(coordinate, coordinate, coordinate, coordinate, st.floats(0.0, 20.0))
def test_a_rounded_ellipse_contains_the_one_asked_for(ax, ay, bx, by, length):
    asked = Ellipse(ax, ay, bx, by, length)
    rounded = rounded_up(asked)
    assert rounded.contains(asked)
    assert rounded.length <= 1.1 * length + 0.3
    angle = np.linspace(0.0, math.tau, 60)
    apart = math.dist((ax, ay), (bx, by))
    if length > apart:
        long, short = 0.5 * length, 0.5 * math.sqrt(length**2 - apart**2)
        turn = math.atan2(by - ay, bx - ax)
        rim = np.column_stack([long * np.cos(angle), short * np.sin(angle)])
        c, s = math.cos(turn), math.sin(turn)
        rim = rim @ np.array([[c, s], [-s, c]]) + 0.5 * np.array([ax + bx, ay + by])
        assert max(rounded.sum_to(x, y) for x, y in rim) <= rounded.length
        x0, y0, x1, y1 = asked.box
        assert rim.min(axis=0) == pytest.approx([x0, y0], abs=0.02 * length)
        assert rim.max(axis=0) == pytest.approx([x1, y1], abs=0.02 * length)
        assert (rim > np.array([x0, y0]) - 1e-9).all()
        assert (rim < np.array([x1, y1]) + 1e-9).all()


def ragged_ring(radius, corners):
    """A circle of many corners, up to 0.2 m off."""
    rng = np.random.default_rng(0)
    angle = np.linspace(0.0, math.tau, corners + 1)[:-1]
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return (radius + rng.uniform(-0.2, 0.2, corners))[:, None] * circle


def ordinary():
    obstacles, side = scattered(5, 60, 2.0)
    obstacles += [Disc((1.0, -3.0), 0.4), Obstacle(disc(2.0) + 3.0, (disc(1.5) + 3.0,))]
    return World(obstacles, boundary=rectangle(side, side))


def like_a_map():
    walls = Obstacle(disc(5.0), (ragged_ring(2.5, 300),))
    return World([walls, ragged_ring(1.2, 100), disc(0.3, 5) + np.array([2.0, 0.0])])


@pytest.mark.parametrize("world", [ordinary(), like_a_map()])
@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_what_is_near_blocks_the_same_in_the_ellipse_and_nowhere_more(world, radius):
    near = world.near(radius, FIRST, SECOND, 4.6)
    whole = world.inflated(radius)
    assert near.ellipse is not None
    assert len(near.walls.corners) < len(whole.walls.corners)
    rng = np.random.default_rng(0)
    point = np.empty(2)
    seen = {True: 0, False: 0}
    for x, y in rng.uniform(-6.0, 6.0, (3000, 2)):
        deep = push_out(whole.walls, x, y, point)
        here = push_out(near.walls, x, y, point)
        assert here <= deep + 1e-9
        if near.ellipse.sum_to(x, y) <= near.ellipse.length:
            assert (here > 0.0) == (deep > 0.0)
            seen[deep > 0.0] += 1
    assert min(seen.values()) > 20


@pytest.mark.parametrize("seed", range(8))
def test_paths_are_the_whole_worlds(seed):
    rng = np.random.default_rng(seed)
    obstacles, side = scattered(seed, 60, rng.uniform(0.8, 4.0))
    boundary = rectangle(side, side) if seed % 2 else None
    world = World(obstacles, boundary)
    nav = GlobalPlanner(world, 0.5, 1.745, inflation=0.2, v_reverse=0.2 * (seed % 3))
    parts = 0
    for _ in range(12):
        start, goal = rng.uniform(-0.5 * side, 0.5 * side, (2, 3))
        goal[2] = goal[2] if seed % 2 else math.nan
        path = nav.route(start, goal)
        time = cost_to_go(nav.goal_field(goal), *start)
        assert (path is None) == (time == math.inf)
        if path is not None:
            assert path.time == pytest.approx(time, abs=1e-9)
            parts += world.near(0.2, start, goal, path.length).ellipse is not None
    assert parts > 0


def test_a_path_past_a_post_just_outside_and_just_inside_of_its_ellipse():
    far = [rectangle(0.5, 0.5) + np.array([40.0 + k, 30.0]) for k in range(40)]
    wedge = np.array([[-0.05, -3.0], [0.05, -3.0], [0.0, 1.0]])  # its tip lies on the ellipse
    post = np.array([[0.0, 1.0], [0.05, 1.05], [0.0, 1.1], [-0.05, 1.05]])
    start, goal = np.array([-2.0, 0.0, math.nan]), np.array([2.0, 0.0, math.nan])
    through, around = 2.0 * math.hypot(2.0, 1.0), 2.0 * math.hypot(2.0, 1.1)
    for away, length in ((1e-6, through), (0.0, around), (-1e-6, around)):
        world = World([wedge, post + np.array([0.0, away]), *far])
        path = GlobalPlanner(world, 1.0, 2.0).route(start, goal)
        assert world.near(0.0, start, goal, path.length).ellipse is not None
        assert path.length == pytest.approx(length, abs=3e-6)


@pytest.mark.parametrize("seed", range(6))
def test_a_field_near_a_pose_is_right_for_those_about_it(seed):
    rng = np.random.default_rng(seed)
    obstacles, side = scattered(seed + 50, 80, 2.0)
    nav = GlobalPlanner(World(obstacles), 0.5, 1e6, inflation=0.25)  # time tells the length
    poses = rng.uniform(-0.4 * side, 0.4 * side, (40, 3))
    walls, point = nav.inflated.walls, np.empty(2)
    goal, near, *_ = [pose for pose in poses if push_out(walls, *pose[:2], point) == 0.0]
    reach = 0.6
    field, whole = nav.goal_field(goal, near, reach), nav.goal_field(goal)
    path = nav.route(near, goal)
    assert cost_to_go(field, *near) == pytest.approx(cost_to_go(whole, *near), abs=1e-9)
    checked = 0
    for offset in rng.uniform(-1.0, 1.0, (40, 3)):
        pose = near + offset * np.array([0.7 * reach, 0.7 * reach, 3.0])
        here, there = cost_to_go(field, *pose), cost_to_go(whole, *pose)
        free = push_out(field.walls, *pose[:2], point) == 0.0
        if free:
            assert here <= there + 1e-9
        if free and here * 0.5 <= path.length + reach:
            assert here == pytest.approx(there, abs=1e-9)
            checked += 1
    assert checked > 5


def corridor(length):
    """Behind a long wall a corridor that is closed at its far end; and posts far away."""
    walls = [(-1.1, 0.0, length, 0.1), (-1.1, 1.0, length, 1.1), (-1.1, 0.0, -1.0, 1.1)]
    walls.append((length - 0.1, 0.0, length, 1.1))
    boxes = [np.array([[x, y], [u, y], [u, v], [x, v]]) for x, y, u, v in walls]
    return World([*boxes, *(rectangle(0.5, 0.5) + np.array([2.0 * k, 30.0]) for k in range(40))])


def test_a_pose_in_a_wall_is_not_pushed_into_a_corridor_that_is_closed_out_of_sight():
    nav = GlobalPlanner(corridor(14.0), 0.5, 1.745, inflation=0.3)
    goal, near, reach = np.array([4.0, -1.0, 0.0]), np.array([0.0, -0.6, 0.0]), 0.8
    field, whole = nav.goal_field(goal, near, reach), nav.goal_field(goal)
    assert field.ellipse.box[2] < 13.0
    pose = (0.3, 0.08, 0.0)
    place = np.empty(2)
    push_out(field.walls, *pose[:2], place)
    assert place[1] > 0.3  # the corridor is nearer
    deceived = first_move(field, *place, 0.0)[0]
    assert deceived > 1.5 * cost_to_go(whole, *pose)
    assert cost_to_go(field, *pose) == pytest.approx(cost_to_go(whole, *pose), abs=1e-9)


def test_where_there_is_no_path_from_a_pose_there_may_be_one_from_those_about_it():
    nav = GlobalPlanner(corridor(14.0), 0.5, 1.745, inflation=0.3)
    goal, near = np.array([4.0, -1.0, 0.0]), np.array([0.0, 0.55, 0.0])
    assert nav.route(near, goal) is None
    field, whole = nav.goal_field(goal, near, 1.5), nav.goal_field(goal)
    assert math.isinf(cost_to_go(whole, *near))
    for pose in ((0.2, -0.4, 0.0), (1.0, -0.5, 2.0), (0.3, 0.02, 1.0)):
        assert cost_to_go(field, *pose) == pytest.approx(cost_to_go(whole, *pose), abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_times_near_a_pose_are_never_too_high(seed):
    rng = np.random.default_rng(seed)
    obstacles, side = scattered(seed + 80, 150, 0.9)  # crowded: most poses are pushed out
    nav = GlobalPlanner(World(obstacles), 0.5, 1.745, inflation=0.2, v_reverse=0.2 * (seed % 2))
    blocked = {True: 0, False: 0}
    exact = 0
    for _ in range(4):
        goal, near = rng.uniform(-0.3 * side, 0.3 * side, (2, 3))
        field, whole = nav.goal_field(goal, near, 0.6), nav.goal_field(goal)
        for offset in rng.uniform(-1.0, 1.0, (30, 3)):
            pose = near + offset * np.array([0.6, 0.6, 3.0])
            here, there = cost_to_go(field, *pose), cost_to_go(whole, *pose)
            assert here <= there + 1e-9
            blocked[push_out(whole.walls, *pose[:2], np.empty(2)) > 0.0] += 1
            exact += abs(here - there) < 1e-9 or math.isinf(there)
    assert min(blocked.values()) > 5
    assert exact > 60


def test_a_base_that_is_faster_in_reverse_goes_the_other_way_round():
    obstacles, side = scattered(2, 20, 1.0)
    rng = np.random.default_rng(0)
    ahead = GlobalPlanner(World(obstacles), 1.0, 1.745, inflation=0.1, v_reverse=0.3)
    back = GlobalPlanner(World(obstacles), 0.3, 1.745, inflation=0.1, v_reverse=1.0)
    walls, point = ahead.inflated.walls, np.empty(2)
    for start, goal in rng.uniform(-side, side, (40, 2, 2)):
        if push_out(walls, *start, point) == push_out(walls, *goal, point) == 0.0:
            one = ahead.route(np.array([*start, 0.3]), np.array([*goal, 1.0]))
            other = back.route(np.array([*start, 0.3 + math.pi]), np.array([*goal, 1.0 + math.pi]))
            assert (one is None) == (other is None)
            if one is not None:
                assert one.time == pytest.approx(other.time, abs=1e-9)


def test_answers_do_not_depend_on_what_was_asked_before():
    obstacles, side = scattered(3, 80, 3.0)
    rng = np.random.default_rng(1)
    used = GlobalPlanner(World(obstacles), 0.5, 1.745, inflation=0.2)
    for start, goal in rng.uniform(-0.5 * side, 0.5 * side, (15, 2, 3)):
        fresh = GlobalPlanner(World(obstacles), 0.5, 1.745, inflation=0.2)
        one, other = used.route(start, goal), fresh.route(start, goal)
        assert (one is None) == (other is None)
        if one is not None:
            assert one.points.tobytes() == other.points.tobytes()
            assert one.time == other.time


def test_near_places_share_one_part_of_the_world():
    world = World(scattered(0, 100, 3.0)[0])
    kept = world.near(0.3, FIRST, SECOND, 6.0)
    assert world.near(0.3, FIRST + 0.001, SECOND, 6.0) is kept
    assert kept.covers(FIRST + 0.001, SECOND, 6.0)
    assert kept.covers(SECOND, FIRST, 6.0)
    assert not kept.covers(FIRST + 5.0, SECOND, 6.0)
    assert world.near(0.3, FIRST + 1.0, SECOND, 6.0) is not kept
    assert world.near(0.3, FIRST, SECOND, 500.0) is world.inflated(0.3)
    assert world.near(0.3, FIRST, SECOND, math.inf) is world.inflated(0.3)
    assert world.inflated(0.3).covers(FIRST, SECOND, 1e9)
    with pytest.raises(InputError, match="inflation"):
        world.near(-1.0, FIRST, SECOND, 6.0)


def test_where_nothing_has_moved_nothing_is_made_anew():
    obstacles, _ = scattered(0, 100, 3.0)
    places = np.array([points.mean(axis=0) for points in obstacles])
    apart = np.hypot(*(places - FIRST).T) + np.hypot(*(places - SECOND).T)
    far = int(apart.argmax())
    towards = Ellipse(*FIRST, *SECOND, 6.0)
    moving = [
        Obstacle(points, (), 0.5 * (FIRST - places[far]) if k == far else (0.0, 0.0))
        for k, points in enumerate(obstacles)
    ]
    world = World(moving)
    kept = world.near(0.3, FIRST, SECOND, 6.0)
    assert towards.sum_to(*places[far]) > 6.0
    soon, later, gone = world.after(0.01), world.after(2.0), world.after(2.0).after(2.0)
    assert soon.near(0.3, FIRST, SECOND, 6.0) is kept
    arrived = later.near(0.3, FIRST, SECOND, 6.0)
    assert arrived is not kept
    assert arrived.members[far]
    assert not kept.members[far]
    assert not gone.near(0.3, FIRST, SECOND, 6.0).members[far]


@pytest.mark.parametrize("seed", range(4))
def test_a_moved_world_is_the_same_as_one_made_anew(seed):
    rng = np.random.default_rng(seed)
    obstacles, side = scattered(seed, 50, 3.0)
    obstacles = [Obstacle(points, (), rng.uniform(-0.5, 0.5, 2)) for points in obstacles]
    frame = rectangle(3.0, 2.0)
    obstacles += [Obstacle(frame, (0.6 * frame,), (0.3, 0.1)), Disc((2.0, 2.0), 0.4, (-0.2, 0.0))]
    boundary = rectangle(side + 4.0, side + 4.0) if seed % 2 else None
    world = World(obstacles, boundary)
    world.inflated(0.2)
    ways = rng.uniform(-0.3, 0.3, (len(obstacles), 3))
    moved = world.transformed(ways).after(1.5).transformed(0.5 * ways)
    anew = World(
        [Obstacle(solid.outline, solid.holes, solid.velocity) for solid in moved.solids], boundary
    )
    before, after = (GlobalPlanner(w, 0.5, 1.745, inflation=0.2) for w in (moved, anew))
    for start, goal in rng.uniform(-0.5 * side, 0.5 * side, (12, 2, 3)):
        one, other = before.route(start, goal), after.route(start, goal)
        assert (one is None) == (other is None)
        if one is not None:
            assert one.time == pytest.approx(other.time, abs=1e-9)


def test_a_planner_takes_another_world():
    obstacles, _ = scattered(1, 60, 6.0)
    nav = GlobalPlanner(World(obstacles), 0.5, 1.745)
    start, goal = np.array([0.0, -12.0, math.nan]), np.array([0.0, 12.0, math.nan])
    before = nav.route(start, goal)
    turned = World([*obstacles, rectangle(12.0, 0.2)])
    nav.update(turned)
    assert nav.route(start, goal).time > before.time + 1.0
    nav.update(turned.with_solids(turned.solids[:-1]))
    assert nav.route(start, goal).time == pytest.approx(before.time, abs=1e-9)


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_of_a_map_of_many_corners_only_what_is_near_is_used(radius):
    rng = np.random.default_rng(0)
    ragged = ragged_ring(8.0, 300)
    inner = [disc(0.4, 7) + rng.uniform(-5.0, 5.0, 2) for _ in range(12)]
    for world in (World([Obstacle(disc(12.0), (ragged,)), *inner]), World(inner, ragged)):
        nav = GlobalPlanner(world, 0.5, 1.745, inflation=radius)
        for turn in (0.0, 1.0, 2.0):
            start = np.array([7.6 * math.cos(turn), 7.6 * math.sin(turn), 0.0])
            goal = np.array([7.6 * math.cos(turn + 0.6), 7.6 * math.sin(turn + 0.6), 2.0])
            path = nav.route(start, goal)
            part = world.near(radius, start, goal, path.length)
            assert part.ellipse is not None
            assert part.walls.corners.shape[0] < 200
            time = cost_to_go(nav.goal_field(goal), *start)
            assert path.time == pytest.approx(time, abs=1e-9)


def test_inflated_outlines_reach_no_further_than_said():
    for points in (rectangle(1.0, 0.5), disc(0.5, 5), np.array([[0, 0], [3, 0], [0.1, 0.2]])):
        grown = World([points]).inflated(0.3).region
        assert grown.hausdorff_distance(Polygon(points)) <= OUTER * 0.3 + 1e-9


def test_a_pushed_out_start_whose_nearest_free_point_is_far_is_still_right():
    slab = rectangle(6.0, 6.0)  # inflated, it is 3.5 deep at its centre
    far = [disc(0.5) + np.array([20.0 + 2 * k, 0.3 * k]) for k in range(20)]
    nav = GlobalPlanner(World([slab, *far]), 0.5, 1.745, inflation=0.5)
    start, goal = np.array([0.1, 0.3, 0.0]), np.array([0.2, -0.1, 1.0])
    path = nav.route(start, goal)
    assert path.start_push == pytest.approx(3.2)
    assert path.goal_push == pytest.approx(3.3)
    assert path.time == pytest.approx(cost_to_go(nav.goal_field(goal), *start), abs=1e-9)
    with pytest.raises(NoPath, match="start"):
        nav.plan(start, goal)
