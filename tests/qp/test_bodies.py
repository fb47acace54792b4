from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.geometry import polygons
from motm_wbc.geometry.distance import segment_prism
from motm_wbc.interfaces import MovingBody
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import moved_bodies, shapes_from_scene
from motm_wbc.qp.bodies import body_from_solid
from motm_wbc.qp.shapes import BASE, SceneShapes, place_solids
from motm_wbc.scene.scenario import load_scenario, upright_pose
from motm_wbc.scene.solids import Obstacle

FOOTPRINT = polygons.rectangle(0.6, 0.4)


def test_a_scenario_becomes_named_bodies_with_roles_and_heights():
    bodies = {body.name: body for body in shapes_from_scene(load_scenario("line"))}
    assert bodies["table"].radius == 0.2 and bodies["table"].outlines == ()
    assert bodies["table"].role is SolidRole.SUPPORT and bodies["table"].top == 0.6
    cube = bodies["cube"]
    assert (cube.role, cube.bottom, cube.top) == (SolidRole.OBJECT, 0.6, pytest.approx(0.65))
    assert len(cube.outlines) == 1


def test_bodies_that_did_not_move_stay_the_same_instances():
    bodies = shapes_from_scene(load_scenario("line"))
    T = upright_pose(np.array([0.1, 0.0, 0.7]), 0.5)
    moving = {"tray": MovingBody(np.array([1.0, 2.0, 0.3]), np.array([0.1, 0.0, 0.2]))}
    after = {body.name: body for body in moved_bodies(bodies, {"cube": T}, moving)}
    before = {body.name: body for body in bodies}
    assert after["table"] is before["table"]
    np.testing.assert_allclose(after["cube"].pose, [0.1, 0.0, 0.5])
    assert after["cube"].bottom == pytest.approx(0.675)
    assert after["cube"].outlines is before["cube"].outlines
    np.testing.assert_allclose(after["tray"].velocity, [0.1, 0.0, 0.2])
    again = moved_bodies(tuple(after.values()), {"cube": T}, {})
    assert {body.name: body for body in again}["cube"] is after["cube"]
    assert "cube" not in [body.name for body in moved_bodies(bodies, {}, {}, without="cube")]


def test_a_tilted_object_takes_its_height():
    bodies = shapes_from_scene(load_scenario("line"))
    c = np.sqrt(0.5)
    T = np.array([[1, 0, 0, 0], [0, c, -c, 0], [0, c, c, 0.7], [0, 0, 0, 1.0]])
    cube = moved_bodies(bodies, {"cube": T}, {})[-1]
    assert cube.top - cube.bottom == pytest.approx(0.05 * np.sqrt(2.0))


def test_concave_prisms_become_convex_parts_at_the_right_place():
    ell = Obstacle(
        name="ell",
        shape="prism",
        outline=((0, 0), (1, 0), (1, 0.2), (0.2, 0.2), (0.2, 1), (0, 1)),
        height=1.0,
        position=(2.0, 1.0),
        yaw=np.pi / 2,
    )
    body = body_from_solid(ell, SolidRole.OBSTACLE)
    assert len(body.outlines) >= 2
    shapes = SceneShapes(FOOTPRINT, 0.3)
    shapes.update([body])
    parts = np.flatnonzero(shapes.owner == 0)

    def distance(x, y):
        point = np.array([x, y, 0.5])
        return min(distance_to_part(shapes.arrays, part, point) for part in parts)

    # turned by 90 degrees, the L opens to the upper left of (2, 1)
    assert distance(1.5, 1.5) == pytest.approx(0.3)
    assert distance(1.9, 1.9) < 0.0
    assert distance(2.3, 1.5) == pytest.approx(0.3)


def distance_to_part(arrays, part, point):
    out = np.empty(7)
    edges = arrays.edges[arrays.first_edge[part] : arrays.first_edge[part + 1]]
    segment_prism(point, point, edges, *arrays.faces[part], out)
    return out[0]


def place_base(arrays, pose):
    arrays.poses[0] = pose
    place_solids(arrays, 0, 1)


def test_places_follow_bodies_and_base_without_a_rebuild(box):
    shapes = SceneShapes(FOOTPRINT, 0.3)
    first = box("a", 1.0, 0.0, (0.2, 0.2, 0.5))
    assert shapes.update([first]) is True
    assert shapes.update([first]) is False
    assert shapes.owner.tolist() == [BASE, 0]
    place_base(shapes.arrays, [0.0, 1.0, np.pi / 2])
    np.testing.assert_allclose(
        np.sort(shapes.arrays.edges[:4, 1]), [0.7, 0.7, 1.3, 1.3]
    )  # the base, turned
    moved = replace(first, pose=np.array([3.0, 0.0, 0.0]))
    assert shapes.update([moved]) is False
    assert shapes.arrays.edges[4:8, 0].max() == pytest.approx(3.1)
    assert shapes.update([moved, box("b", 5, 5, (1, 1, 1))]) is True


def test_boxes_about_solids_hold_them(box):
    rng = np.random.default_rng(0)
    bodies = [box(f"b{i}", *rng.uniform(-2, 2, 2), rng.uniform(0.1, 1, 3)) for i in range(6)]
    bodies = [replace(body, pose=body.pose + [0, 0, rng.uniform(-3, 3)]) for body in bodies]
    bodies.append(replace(bodies[0], name="pole", outlines=(), radius=0.3))
    shapes = SceneShapes(FOOTPRINT, 0.3)
    shapes.update(bodies)
    arrays = shapes.arrays
    place_base(arrays, [0.3, 0.2, 0.7])
    for part, owner in enumerate(shapes.owner):
        if owner == len(bodies) - 1:
            reach = np.array([0.3, 0.3])
            np.testing.assert_allclose(arrays.box_low[part, :2], bodies[0].pose[:2] - reach)
            np.testing.assert_allclose(arrays.box_high[part, :2], bodies[0].pose[:2] + reach)
            continue
        corners = arrays.edges[arrays.first_edge[part] : arrays.first_edge[part + 1], :2]
        np.testing.assert_array_equal(arrays.box_low[part, :2], corners.min(axis=0))
        np.testing.assert_array_equal(arrays.box_high[part, :2], corners.max(axis=0))
        assert (arrays.box_low[part, 2], arrays.box_high[part, 2]) == tuple(arrays.faces[part])


def test_a_place_that_is_no_number_shows(box):
    shapes = SceneShapes(FOOTPRINT, 0.3)
    shapes.update([box("a", 1.0, 0.0, (1, 1, 1))])
    assert shapes.finite
    shapes.update([box("a", np.nan, 0.0, (1, 1, 1))])
    assert not shapes.finite
