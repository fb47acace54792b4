import numpy as np
import pytest

from motm_wbc.geometry import se2
from motm_wbc.kinematics import Part
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import HeldObject, WholeBodyParameters, shapes_from_scene
from motm_wbc.qp.held import box_segments
from motm_wbc.qp.nearby import Neighbourhood
from motm_wbc.qp.rows import RowBuilder
from motm_wbc.scene.scenario import load_scenario

PARAMETERS = WholeBodyParameters(collision_rows=60)
STAND = np.zeros(2)


def finder(model, bodies, pose, target=None, held=None, parameters=PARAMETERS):
    neighbourhood = Neighbourhood(model, parameters)
    neighbourhood.update(bodies, pose, target, held)
    return neighbourhood, RowBuilder(model, neighbourhood, 1 / 120, parameters)


def used(rows):
    return np.flatnonzero(np.isfinite(rows.bound))


def distances(neighbourhood, configuration):
    near = neighbourhood.find(configuration)
    return {
        (int(i), int(j)): float(d)
        for i, j, d in zip(near.first, near.second, near.distance, strict=True)
    }


def scene(box):
    return [
        box("table", 0.75, 0.1, (0.3, 0.4, 0.4), role=SolidRole.SUPPORT),
        box("post", 0.4, 0.35, (0.1, 0.1, 1.0)),
        box("floating", 0.6, -0.3, (0.2, 0.2, 0.1), bottom=0.5, role=SolidRole.OBJECT),
    ]


def test_each_row_is_the_rate_at_which_its_pair_comes_nearer(frankie, box):
    """Against finite differences of the distances, base inputs included."""
    rng = np.random.default_rng(0)
    checked, step = 0, 1e-6
    for _ in range(12):
        pose = np.array([0.05, -0.05, 0.2]) * rng.normal(size=3)
        q = frankie.home + rng.uniform(-0.3, 0.3, 7)
        neighbourhood, builder = finder(frankie, scene(box), pose)
        rows = builder.build(frankie.configuration(pose, q), STAND)
        before = distances(neighbourhood, frankie.configuration(pose, q))
        for column in range(9):
            x = np.zeros(9)
            x[column] = step
            moved = se2.integrate_twist(pose, x[0], 0.0, x[1], 1.0)
            neighbourhood.update(scene(box), moved, None, None)
            after = distances(neighbourhood, frankie.configuration(moved, q + x[2:]))
            for slot in used(rows):
                pair = int(rows.first[slot]), int(rows.second[slot])
                rate = -(after[pair] - before[pair]) / step
                assert rows.A[slot, column] == pytest.approx(rate, abs=2e-5)
                checked += 1
        neighbourhood.update(scene(box), pose, None, None)
    assert checked > 1000


def test_a_held_box_is_part_of_the_hand(frankie, box):
    pose, q = np.zeros(3), frankie.home
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 0.05]
    configuration = frankie.configuration(pose, q)
    under = configuration.T_world_tool[:3, 3] - [0, 0, 0.05 + 0.03 + 0.03]
    table = box("table", under[0] + 0.15, under[1], (0.4, 0.4, under[2]), role=SolidRole.SUPPORT)
    for allowed, expected in ((False, True), (True, False)):
        held = HeldObject("cube", np.array([0.05, 0.05, 0.06]), T, contact_allowed=allowed)
        neighbourhood, builder = finder(frankie, [table], pose, held=held)
        rows = builder.build(configuration, STAND)
        names = [builder.name((int(rows.first[s]), int(rows.second[s]))) for s in used(rows)]
        assert ("cube - table" in names) is expected
        if expected:
            assert names.count("cube - table") == PARAMETERS.held_rows
            assert rows.clearance == pytest.approx(0.03, abs=1e-9)
            assert builder.name(rows.closest) == "cube - table"
    # its row is that of a point of the tool
    held = HeldObject("cube", np.array([0.05, 0.05, 0.06]), T)
    neighbourhood, builder = finder(frankie, [table], pose, held=held)
    rows = builder.build(configuration, STAND)
    down = -configuration.J_tool[2]
    slots = [s for s in used(rows) if neighbourhood.segments.names[rows.first[s]] == "cube"]
    table_slots = [
        s for s in slots if builder.name((rows.first[s], rows.second[s]))[-5:] == "table"
    ]
    assert max(np.abs(rows.A[s][2:] - down[2:]).max() for s in table_slots) < 0.06


def test_fingers_may_touch_their_target_and_nothing_else(frankie, box):
    pose, q = np.zeros(3), frankie.home
    tool = frankie.configuration(pose, q).T_world_tool[:3, 3]
    cube = box("cube", tool[0], tool[1], (0.05, 0.05, 0.05), tool[2], role=SolidRole.OBJECT)
    for target, count in (("cube", 0), ("other", 2), (None, 2)):
        neighbourhood, _ = finder(frankie, [cube], pose, target=target)
        near = neighbourhood.find(frankie.configuration(pose, q))
        fingers = [
            i
            for i, j in zip(near.first, near.second, strict=True)
            if neighbourhood.segments.parts[i] is Part.FINGER and j == 1
        ]
        assert len(fingers) == count


def test_the_base_drops_out_of_pairs_with_itself(frankie, box):
    q = frankie.home + np.array([0, 0.9, 0, -0.2, 0, 0.3, 0])
    neighbourhood, builder = finder(frankie, [], np.zeros(3))
    rows = builder.build(frankie.configuration(np.zeros(3), q), np.array([0.5, 1.0]))
    slots = used(rows)
    assert len(slots) > 3
    np.testing.assert_allclose(rows.A[slots, :2], 0.0, atol=1e-12)
    assert np.abs(rows.A[slots, 2:]).max() > 0.1
    assert (neighbourhood.find(frankie.configuration(np.zeros(3), q)).second == 0).any()


def test_a_moving_body_shifts_the_bound_by_its_approach(frankie, box):
    pose, q = np.zeros(3), frankie.home
    configuration = frankie.configuration(pose, q)
    x, y = configuration.T_world_tool[:2, 3]
    bounds = {}
    for velocity in ((0, 0, 0), (-0.3, 0, 0), (0, 0, 1.0)):
        wall = box("wall", x + 0.25, y + 0.3, (0.1, 1.0, 2.0), velocity=velocity)
        neighbourhood, builder = finder(frankie, [wall], pose)
        rows = builder.build(configuration, STAND)
        slot = next(
            s for s in used(rows) if builder.name((rows.first[s], rows.second[s])) == "hand - wall"
        )
        bounds[velocity] = rows.bound[slot]
    assert bounds[(-0.3, 0, 0)] == pytest.approx(bounds[(0, 0, 0)] - 0.3)
    # turning about its own centre, which is further left than the hand: there it goes along +x
    near = neighbourhood.find(configuration)
    hand = next(
        k
        for k in range(len(near))
        if builder.name((near.first[k], near.second[k])) == "hand - wall"
    )
    lever = y + 0.3 - near.point[hand, 1]
    assert lever > 0.15
    assert bounds[(0, 0, 1.0)] == pytest.approx(bounds[(0, 0, 0)] + lever)


def test_pairs_keep_their_slots_while_others_come_and_go(frankie, box):
    parameters = WholeBodyParameters(collision_rows=6)
    bodies, q = scene(box), frankie.home
    neighbourhood, builder = finder(frankie, bodies, np.zeros(3), parameters=parameters)
    seen, changes = {}, 0
    for x in np.linspace(0.0, 0.15, 30):
        pose = np.array([x, 0.0, 0.0])
        neighbourhood.update(bodies, pose, None, None)
        rows = builder.build(frankie.configuration(pose, q), STAND)
        now = {(rows.first[s], rows.second[s]): s for s in used(rows)}
        assert len(now) == 6
        for pair in now.keys() & seen.keys():
            assert now[pair] == seen[pair]
        changes += now.keys() != seen.keys()
        seen = now
    assert changes > 1


def test_the_rows_are_those_of_the_pairs_that_may_approach_least(frankie, box):
    few = WholeBodyParameters(collision_rows=4)
    configuration = frankie.configuration(np.zeros(3), frankie.home)
    bodies = [box("shelf", 0.6, 0.0, (0.3, 0.3, 0.05), bottom=0.9)]  # out of the base's way
    _, every = finder(frankie, bodies, np.zeros(3))
    _, some = finder(frankie, bodies, np.zeros(3), parameters=few)
    all_bounds = np.sort(every.build(configuration, STAND).bound)
    assert np.isfinite(all_bounds).sum() > 6
    np.testing.assert_allclose(np.sort(some.build(configuration, STAND).bound), all_bounds[:4])


def test_what_stands_on_the_base_lets_it_drive_as_fast_as_it_can_stop(frankie, box):
    configuration = frankie.configuration(np.zeros(3), frankie.home)
    wall = box("wall", 0.5, 0.0, (0.1, 3.0, 1.0))
    for speed in (0.1, 0.5):
        neighbourhood, builder = finder(frankie, [wall], np.zeros(3))
        rows = builder.build(configuration, np.array([speed, 0.0]))
        names = [
            builder.name((int(i), int(j))) for i, j in zip(rows.first, rows.second, strict=True)
        ]
        slot = names.index("link0 - wall")
        room = distances(neighbourhood, configuration)[rows.first[slot], rows.second[slot]] - 0.05
        assert 0.02 < room < 0.3
        # braking at 0.5 m/s^2, all but one step and the share kept back
        assert rows.bound[slot] == pytest.approx(np.sqrt(2 * 0.49 * room), abs=0.49 / 120)
        np.testing.assert_allclose(rows.A[slot, 2:], 0.0, atol=1e-12)


def test_unused_slots_are_infinite_and_zero(frankie):
    _, builder = finder(frankie, [], np.zeros(3))
    q = np.array([0.0, 0.0, 0.0, -0.5, 0.0, 2.0, 0.0])
    rows = builder.build(frankie.configuration(np.zeros(3), q), STAND)
    idle = np.isinf(rows.bound)
    assert idle.sum() > 30 and (rows.A[idle] == 0.0).all() and (rows.bound[idle] > 0).all()


def test_held_boxes_are_covered_by_their_segments():
    rng = np.random.default_rng(1)
    size = np.array([0.06, 0.05, 0.04])
    ends, radius = box_segments(size)
    assert len(ends) == 13 and ends.min(axis=(0, 1)) == pytest.approx(-size / 2)
    # a point on the surface is never further from a segment than a quarter of the smallest side
    points = rng.uniform(-0.5, 0.5, (500, 3)) * size
    face = rng.integers(0, 3, 500)
    points[np.arange(500), face] = 0.5 * size[face] * rng.choice([-1, 1], 500)
    along = ends[:, 1] - ends[:, 0]
    t = np.einsum("psi,si->ps", points[:, None] - ends[:, 0], along)
    t = np.clip(t / np.maximum(np.einsum("si,si->s", along, along), 1e-12), 0, 1)
    away = np.linalg.norm(points[:, None] - ends[:, 0] - t[:, :, None] * along, axis=2) - radius
    assert away.min(axis=1).max() < 0.011
    assert away.min() > -0.02 - 1e-9  # and none of them sticks out
    corner = np.abs(ends).max(axis=1) + radius[:, None]
    assert (corner[12] <= size / 2 + 1e-12).all()


def test_near_pairs_are_all_pairs_within_reach(frankie):
    """The rough distance loses none: against the same search without it."""
    bodies = shapes_from_scene(load_scenario("obstructed_turn"))
    pose = np.array([-0.5, -0.1, 0.1])
    neighbourhood, _ = finder(frankie, bodies, pose)
    configuration = frankie.configuration(pose, frankie.home)
    near = neighbourhood.find(configuration)
    neighbourhood.segments.ball[:] += 5.0
    everything = neighbourhood.find(configuration)
    assert len(near) > 5
    assert set(zip(near.first, near.second, strict=True)) == set(
        zip(everything.first, everything.second, strict=True)
    )
