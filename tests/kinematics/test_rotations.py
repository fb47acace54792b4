import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.kinematics.rotations import (
    axis_angle,
    inverse_pose,
    pose,
    rotation_error,
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


SMALL = (0.0, 1e-300, 1e-160, 1e-12, 1e-7, 1e-6, 1.1e-6, 1e-3)
edges = st.sampled_from([*SMALL, *(np.pi - small for small in SMALL), 2 * np.pi / 3])


def unit_vector(seed):
    """Along an axis, in a plane of two, or anywhere."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis[rng.permutation(3)[: rng.integers(3)]] = 0.0
    return axis / np.linalg.norm(axis)


@settings(max_examples=300)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, np.pi) | edges)
def test_rotation_vector_is_the_inverse_of_axis_angle(seed, angle):
    axis = unit_vector(seed)
    vector = rotation_vector(axis_angle(axis, angle))
    assert np.linalg.norm(vector) == pytest.approx(angle, abs=4e-15, rel=4e-15)
    if angle < np.pi - 1e-12:
        np.testing.assert_allclose(vector, angle * axis, rtol=0.0, atol=6e-15)
    else:  # half a turn has two logarithms
        np.testing.assert_allclose(
            np.outer(vector, vector), np.pi**2 * np.outer(axis, axis), rtol=0.0, atol=1e-11
        )


def test_a_small_turn_keeps_all_its_digits():
    axis = unit_vector(3)
    vector = rotation_vector(axis_angle(axis, 1e-9))
    np.testing.assert_allclose(vector, 1e-9 * axis, rtol=1e-12)


@settings(max_examples=200)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, np.pi) | edges)
def test_the_error_turns_the_one_into_the_other(seed, angle):
    rng = np.random.default_rng(seed)
    R = axis_angle(rng.normal(size=3), rng.uniform(0.0, np.pi))
    target = axis_angle(unit_vector(seed), angle) @ R
    error = rotation_error(target, R)
    length = np.linalg.norm(error)
    assert length <= np.pi + 1e-15
    turned = axis_angle(error, length) @ R if length > 0.0 else R
    np.testing.assert_allclose(turned, target, rtol=0.0, atol=4e-15)


def test_inverse_pose():
    T = pose(rpy_rotation((0.1, 0.2, 0.3)), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(T @ inverse_pose(T), np.eye(4), atol=1e-12)
