import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.kinematics.manipulability import manipulability, manipulability_gradient


def test_gradient_is_the_derivative(robot):
    rng = np.random.default_rng(5)
    low = np.where(np.isfinite(robot.q_lower), robot.q_lower, -3.0)
    high = np.where(np.isfinite(robot.q_upper), robot.q_upper, 3.0)
    largest = 0.0
    for _ in range(50):
        base_pose, q = rng.uniform(-2.0, 2.0, 3), rng.uniform(low, high)
        gradient = robot.configuration(base_pose, q).manipulability_gradient
        step = 1e-6 * np.eye(robot.n_arm)
        numeric = [
            (
                robot.configuration(base_pose, q + d).manipulability
                - robot.configuration(base_pose, q - d).manipulability
            )
            / 2e-6
            for d in step
        ]
        np.testing.assert_allclose(gradient, numeric, atol=2e-7)
        largest = max(largest, float(np.abs(gradient).max()))
    assert largest > 0.05


def test_measure_does_not_depend_on_the_base(frankie):
    values = [
        frankie.configuration(pose, frankie.home).manipulability
        for pose in (np.zeros(3), np.array([5.0, -3.0, 2.0]))
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-12)
    assert values[0] == pytest.approx(0.080165, abs=1e-5)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9))
def test_measure_is_the_product_of_the_singular_values(seed, joints):
    J = np.random.default_rng(seed).normal(size=(6, joints))
    product = float(np.prod(np.linalg.svd(J, compute_uv=False)))
    assert manipulability(J) == pytest.approx(product, rel=1e-6)


def test_no_gradient_at_a_singularity():
    J = np.zeros((6, 7))
    J[2] = 1.0
    assert manipulability(J) == 0.0
    np.testing.assert_array_equal(manipulability_gradient(J), np.zeros(7))


def test_translational_measure_is_that_of_the_linear_rows(frankie):
    here = frankie.configuration(np.zeros(3), frankie.home)
    J = here.J_tool[:3, 2:]
    assert here.translational_manipulability == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)))
