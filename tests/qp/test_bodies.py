import numpy as np
import pytest

from motm_wbc.geometry import polygons
from motm_wbc.geometry.closest import segment_prism
from motm_wbc.interfaces import MovingBody
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import moved_bodies, shapes_from_scene
from motm_wbc.qp.bodies import body_from_solid
from motm_wbc.qp.shapes import BASE, SceneShapes
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
    shapes.update([body], np.zeros(3))
    parts = np.flatnonzero(shapes.owner == 0)

    def distance(x, y):
        a = np.tile([x, y, 0.5], (len(parts), 1))
        return segment_prism(a, a, shapes.prisms.take(parts)).distance.min()

    # turned by 90 degrees, the L opens to the upper left of (2, 1)
    assert distance(1.5, 1.5) == pytest.approx(0.3)
    assert distance(1.9, 1.9) < 0.0
    assert distance(2.3, 1.5) == pytest.approx(0.3)


def test_places_follow_bodies_and_base_without_a_rebuild(box):
    shapes = SceneShapes(FOOTPRINT, 0.3)
    first = box("a", 1.0, 0.0, (0.2, 0.2, 0.5))
    assert shapes.update([first], np.zeros(3)) is True
    assert shapes.update([first], np.array([0.0, 1.0, np.pi / 2])) is False
    assert shapes.owner.tolist() == [BASE, 0]
    np.testing.assert_allclose(
        np.sort(shapes.prisms.edges[0, :, 1]), [0.7, 0.7, 1.3, 1.3]
    )  # the base, turned
    from dataclasses import replace

    moved = replace(first, pose=np.array([3.0, 0.0, 0.0]))
    assert shapes.update([moved], np.zeros(3)) is False
    assert shapes.prisms.edges[1, :, 0].max() == pytest.approx(3.1)
    assert shapes.update([moved, box("b", 5, 5, (1, 1, 1))], np.zeros(3)) is True


def test_rough_distances_are_never_too_large(box):
    rng = np.random.default_rng(0)
    bodies = [box(f"b{i}", *rng.uniform(-2, 2, 2), rng.uniform(0.1, 1, 3)) for i in range(6)]
    shapes = SceneShapes(FOOTPRINT, 0.3)
    shapes.update(bodies, np.array([0.3, 0.2, 0.7]))
    centres, radii = rng.uniform(-2, 2, (40, 3)), np.zeros(40)
    rough = shapes.gaps(centres, radii)
    for k in range(len(shapes.owner)):
        solid = shapes.prisms.take(np.full(40, k))
        exact = segment_prism(centres, centres, solid).distance
        assert (rough[:, k] <= np.maximum(exact, 0.0) + 1e-12).all()
        assert (rough[:, k] > 0.0).any()


def test_a_place_that_is_no_number_shows(box):
    shapes = SceneShapes(FOOTPRINT, 0.3)
    shapes.update([box("a", 1.0, 0.0, (1, 1, 1))], np.zeros(3))
    assert shapes.finite
    shapes.update([box("a", np.nan, 0.0, (1, 1, 1))], np.zeros(3))
    assert not shapes.finite
