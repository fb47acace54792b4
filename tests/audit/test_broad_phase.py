"""The broad phase may skip only what surely doesn't touch."""

from itertools import pairwise

import fcl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.audit import Audit, Episode
from motm_wbc.audit.episodes import EpisodeLog
from motm_wbc.audit.rules import checked_pairs
from motm_wbc.audit.shapes import Sphere, polyhedron, solid_corners, solid_geometries
from motm_wbc.kinematics.description import Part
from motm_wbc.scene.scenario import upright_pose
from motm_wbc.scene.solids import Object, Obstacle

WEDGE = ((0.0, 0.0), (0.12, 0.0), (0.12, 0.05), (0.05, 0.05), (0.05, 0.1), (0.0, 0.1))


@pytest.fixture(scope="module")
def lopsided(scenario):
    """A scene whose object and one obstacle have their origins at a corner."""
    thing = Object(name="cube", shape="prism", outline=WEDGE, height=0.06, on="table")
    far = tuple((10 * x, 10 * y) for x, y in WEDGE)
    wall = Obstacle(
        name="wall", shape="prism", outline=far, height=0.9, position=(0.5, 0.4), yaw=0.7
    )
    return scenario.model_copy(update={"objects": (thing,), "obstacles": (wall,)})


@pytest.fixture(scope="module")
def audit(model, lopsided):
    return Audit(model, lopsided)


def brute_force(audit, truth, scenario):
    """All pairs in contact, without any broad phase."""
    at = audit._model.configuration(truth.base_pose, truth.q, truth.gripper_width)
    solids = (*scenario.supports, *scenario.obstacles, *scenario.objects)
    shapes = {solid.name: solid_geometries(solid) for solid in solids}
    robot, scene = audit._robot, audit._scene
    mask = checked_pairs(robot, scene, None)
    found = set()
    for i, body in enumerate(robot.bodies):
        for j, solid in enumerate(scene.bodies):
            where = fcl.Transform(solid.pose[:3, :3], solid.pose[:3, 3])
            for geometry in shapes[solid.name]:
                piece = fcl.CollisionObject(geometry, where)
                hit = fcl.collide(
                    body.grown(at), piece, fcl.CollisionRequest(), fcl.CollisionResult()
                )
                if mask[i, j] and hit:
                    found.add((body.name, solid.name))
    return found


def random_truth(rng, model, world):
    """The robot anywhere near the scene in any posture, the object anywhere."""
    place = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(0.1, 0.9)])
    return world.at(
        base_pose=rng.uniform(-1.3, 1.3, 3),
        q=rng.uniform(model.q_lower, model.q_upper),
        objects={"cube": upright_pose(place, rng.uniform(-3.0, 3.0))},
    )


def test_every_contact_is_found(audit, model, lopsided, make_world):
    rng = np.random.default_rng(7)
    found = 0
    for _ in range(150):
        audit._log = EpisodeLog(0.0)
        truth = random_truth(rng, model, make_world(lopsided))
        audit.observe(truth)
        solids = {body.name for body in audit._scene.bodies}
        seen = {(e.first, e.second) for e in audit.result().episodes if e.second in solids}
        expected = brute_force(audit, truth, lopsided)
        assert seen == expected
        found += len(expected)
    assert found > 150


def test_bounds_contain_what_they_bound(audit, model, lopsided, make_world):
    rng = np.random.default_rng(8)
    for _ in range(30):
        audit.observe(random_truth(rng, model, make_world(lopsided)))
        for i, body in enumerate(audit._scene.bodies):
            corners = body.corners @ body.pose[:3, :3].T + body.pose[:3, 3]
            assert (corners >= audit._scene.lower[i] - 1e-9).all()
            assert (corners <= audit._scene.upper[i] + 1e-9).all()


def test_shapes_contain_the_meshes(audit):
    """Each corner of each piece lies in its own grown shape, and in its sphere."""
    for body in audit._robot.bodies:
        away = np.linalg.norm(body.corners - body.sphere.centre, axis=1)
        assert away.max() <= body.sphere.radius + 1e-12
        grown = fcl.CollisionObject(polyhedron(body.corners, 0.001), fcl.Transform())
        for corner in body.corners:
            point = fcl.CollisionObject(fcl.Sphere(1e-4), fcl.Transform(corner))
            assert fcl.collide(grown, point, fcl.CollisionRequest(), fcl.CollisionResult())


@given(gap=st.floats(0.0, 0.004))
def test_the_skin_is_as_thick_as_said(gap):
    corners = np.array(np.meshgrid([-0.1, 0.1], [-0.1, 0.1], [-0.1, 0.1])).T.reshape(-1, 3)
    body = fcl.CollisionObject(polyhedron(corners, 0.002), fcl.Transform())
    wall = fcl.CollisionObject(
        fcl.Box(0.2, 0.2, 0.2), fcl.Transform(np.array([0.2 + gap, 0.03, 0.01]))
    )
    hit = fcl.collide(body, wall, fcl.CollisionRequest(), fcl.CollisionResult()) > 0
    if abs(gap - 0.002) > 1e-6:
        assert hit == (gap < 0.002)


def test_a_concave_prism_has_room_in_its_notch():
    thing = Object(name="wedge", shape="prism", outline=WEDGE, height=0.06, on="table")
    pieces = [fcl.CollisionObject(g, fcl.Transform()) for g in solid_geometries(thing)]
    assert len(pieces) == 2

    def hit(x, y):
        ball = fcl.CollisionObject(fcl.Sphere(0.01), fcl.Transform(np.array([x, y, 0.0])))
        request = fcl.CollisionRequest()
        return any(fcl.collide(p, ball, request, fcl.CollisionResult()) for p in pieces)

    assert not hit(0.08, 0.08)
    assert hit(0.08, 0.04)
    assert hit(0.03, 0.09)
    assert Sphere.about(solid_corners(thing)).radius < 0.09


def test_only_what_may_touch_is_left_out(audit):
    names = [body.name for body in audit._scene.bodies]
    cube = names.index("cube")
    for held in (None, "cube"):
        mask = checked_pairs(audit._robot, audit._scene, held)
        for i, body in enumerate(audit._robot.bodies):
            others = [j for j in range(len(names)) if j != cube]
            assert mask[i, others].all()
            if body.part is Part.FINGER:
                assert not mask[i, cube]
            if body.part is None:
                assert mask[i, cube]
            if body.part is Part.HAND:
                assert mask[i, cube] == (held is None)
        assert mask[-1].any() == (held is not None)
        assert not mask[-1, cube]


def test_neighbours_are_not_checked_against_each_other(audit):
    bodies = audit._robot.bodies
    pairs = {(bodies[i].name, bodies[j].name) for i, j in audit._robot.self_pairs}
    for first, second in pairwise([f"panda_link{k}" for k in range(8)]):
        assert (first, second) not in pairs
    assert ("base_link", "panda_hand") in pairs
    assert ("base_link", "panda_link0") not in pairs
    assert ("base_link", "panda_link1") not in pairs
    assert ("panda_link0", "panda_hand") in pairs


def test_episodes_end_after_a_gap():
    log = EpisodeLog(0.1)
    for time, depth in ((0.0, 0.001), (0.05, 0.004), (0.14, 0.002), (0.3, 0.003)):
        log.touch("a", "b", time, depth)
    log.touch("a", "c", 0.31, 0.0)
    assert log.episodes() == (
        Episode("a", "b", 0.0, 0.14, 0.004),
        Episode("a", "b", 0.3, 0.3, 0.003),
        Episode("a", "c", 0.31, 0.31, 0.0),
    )
