import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.kinematics.rotations import (
    axis_angle,
    inverse_pose,
    pose,
    rotation_vector,
    rpy_from_rotation,
    rpy_rotation,
)

angles = st.floats(-3.2, 3.2)


@given(angles, angles, angles)
def test_rpy_there_and_back(roll, pitch, yaw):
    R = rpy_rotation((roll, pitch, yaw))
    np.testing.assert_allclose(rpy_rotation(rpy_from_rotation(R)), R, atol=1e-7)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_rpy_at_the_gimbal(pitch):
    R = rpy_rotation((0.4, pitch, -0.3))
    np.testing.assert_allclose(rpy_rotation(rpy_from_rotation(R)), R, atol=1e-12)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, np.pi))
def test_rotation_vector_is_the_inverse_of_axis_angle(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    R = axis_angle(axis, angle)
    vector = rotation_vector(R)
    assert np.linalg.norm(vector) == pytest.approx(angle, abs=1e-6)
    np.testing.assert_allclose(
        axis_angle(vector, np.linalg.norm(vector)) if angle > 1e-6 else R, R, atol=1e-6
    )


@pytest.mark.parametrize("axis", [*np.eye(3), (1, 1, 0), (-1, 2, 3)])
def test_half_turns(axis):
    R = axis_angle(np.array(axis, dtype=float), np.pi)
    vector = rotation_vector(R)
    np.testing.assert_allclose(axis_angle(vector, np.pi), R, atol=1e-9)


def test_inverse_pose():
    T = pose(rpy_rotation((0.1, 0.2, 0.3)), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(T @ inverse_pose(T), np.eye(4), atol=1e-12)
