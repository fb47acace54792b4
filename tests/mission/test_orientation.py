import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.mission.orientation import rotation_error, top_down, yaw_of

angle = st.floats(-3.0, 3.0)


def rotation(vector):
    theta = float(np.linalg.norm(vector))
    if theta < 1e-12:
        return np.eye(3)
    x, y, z = vector / theta
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(theta) * K + (1.0 - math.cos(theta)) * K @ K


@given(st.tuples(angle, angle, angle).map(np.array), angle)
def test_the_error_turns_the_one_into_the_other(vector, yaw):
    R = top_down(yaw)
    target = rotation(vector) @ R
    error = rotation_error(target, R)
    assert np.linalg.norm(error) <= math.pi + 1e-9
    assert np.allclose(rotation(error) @ R, target, atol=2e-4)


def test_half_a_turn_is_not_lost():
    error = rotation_error(top_down(math.pi), top_down(0.0))
    assert np.linalg.norm(error) == pytest.approx(math.pi, abs=1e-6)


@given(angle)
def test_top_down_is_a_rotation_that_looks_down(yaw):
    R = top_down(yaw)
    assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1.0)
    assert np.allclose(R[:, 2], [0.0, 0.0, -1.0])
    assert yaw_of(R) == pytest.approx(yaw)
