import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.scene.scenario import load_scenario, upright_pose
from motm_wbc.scene.solids import Object
from motm_wbc.simulation.bodies import ObjectShape
from motm_wbc.simulation.fingers import push_out
from motm_wbc.simulation.loose import Ground, LooseBody

DT = 1.0 / 240.0
CUBE = ObjectShape.of(Object(name="cube", shape="box", size=(0.05, 0.05, 0.05), on="table"))


def thrown(position, velocity, friction=0.5):
    body = LooseBody(CUBE, friction, np.eye(4))
    body.throw(upright_pose(np.array(position), 0.3), np.array(velocity, dtype=float))
    return body


def settle(body):
    ground = Ground(load_scenario("line"))
    for step in range(2000):
        body.advance(ground, 9.81, DT)
        if not body.moving:
            return (step + 1) * DT
    raise AssertionError("never at rest")


def test_falls_onto_the_table_as_long_as_gravity_says():
    body = thrown([0.0, 0.0, 0.825], [0, 0, 0])
    assert settle(body) == pytest.approx((2 * 0.2 / 9.81) ** 0.5, abs=2 * DT)
    np.testing.assert_allclose(body.pose, upright_pose(np.array([0, 0, 0.625]), 0.3), atol=1e-12)


@pytest.mark.parametrize("speed", [0.05, 0.15, 0.5])
def test_slides_to_rest_by_coulomb_friction(speed):
    body = thrown([-0.15, 0.0, 0.625], [speed, 0, 0])
    settle(body)
    assert body.pose[0, 3] + 0.15 == pytest.approx(speed**2 / (2 * 0.5 * 9.81), abs=2 * speed * DT)


def test_slides_off_the_edge_to_the_floor():
    body = thrown([0.15, 0.0, 0.625], [1.5, 0, 0])
    settle(body)
    assert body.pose[2, 3] == pytest.approx(0.025)
    assert body.pose[0, 3] > 0.4


def test_falls_beside_the_table_to_the_floor():
    body = thrown([0.5, 0.5, 0.7], [0, 0, 0])
    settle(body)
    np.testing.assert_allclose(body.pose[:3, 3], [0.5, 0.5, 0.025], atol=1e-12)


def test_a_table_above_does_not_catch_what_is_below():
    body = thrown([0.0, 0.0, 0.3], [0, 0, 0])
    settle(body)
    assert body.pose[2, 3] == pytest.approx(0.025)


def finger(centre, tilt=0.0):
    corners = np.array(np.meshgrid([-0.01, 0.01], [-0.008, 0.008], [-0.04, 0.04])).T.reshape(-1, 3)
    c, s = np.cos(tilt), np.sin(tilt)
    return corners @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T + centre


@given(
    x=st.floats(-0.06, 0.06), y=st.floats(-0.06, 0.06),
    yaw=st.floats(-3.1, 3.1), tilt=st.floats(-0.8, 0.8),
)  # fmt: skip
def test_a_push_frees_the_object_and_is_no_longer_than_needed(x, y, yaw, tilt):
    pose = upright_pose(np.zeros(3), yaw)
    corners = finger([x, y, 0.03], tilt)
    offset = push_out(corners, CUBE, pose, np.eye(3))
    moved = pose.copy()
    moved[:2, 3] += offset
    again = push_out(corners, CUBE, moved, np.eye(3))
    assert np.linalg.norm(again) < 1e-9
    if np.any(offset):
        moved[:2, 3] -= 0.01 * offset
        assert np.any(push_out(corners, CUBE, moved, np.eye(3)))


def test_a_finger_that_overlaps_by_3_mm_pushes_by_3_mm():
    offset = push_out(finger([0.025 + 0.01 - 0.003, 0.0, 0.03]), CUBE, np.eye(4), np.eye(3))
    np.testing.assert_allclose(offset, [-0.003, 0.0], atol=1e-12)


def test_a_finger_above_the_object_pushes_nothing():
    offset = push_out(finger([0.0, 0.0, 0.0651]), CUBE, np.eye(4), np.eye(3))
    np.testing.assert_array_equal(offset, [0.0, 0.0])
