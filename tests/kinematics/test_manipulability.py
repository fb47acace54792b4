import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.kinematics.chain import FIXED, SLIDING, TURNING, Chain, jacobian_at, place
from motm_wbc.kinematics.manipulability import manipulability, manipulability_gradient
from motm_wbc.kinematics.rotations import axis_angle


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
    gradient = np.ones(7)
    assert manipulability(J) == manipulability_gradient(J, gradient) == 0.0
    np.testing.assert_array_equal(gradient, np.zeros(7))


def test_no_gradient_where_rounding_hides_the_singularity():
    rng = np.random.default_rng(7)
    for joints in (4, 6, 8):
        J = rng.normal(size=(6, joints))
        J[-1] = J[0] + 1e-9 * rng.normal(size=joints)
        J[:, -1] = J[:, 0] + 1e-9 * rng.normal(size=6)
        gradient = np.ones(joints)
        assert manipulability_gradient(J, gradient) == 0.0
        np.testing.assert_array_equal(gradient, np.zeros(joints))


def serial_chain(rng, n):
    """A base and n joints, one on the other, on skew axes; a point on the last."""
    axes, sliding = rng.normal(size=(n, 3)), rng.random(n) < 0.3
    kinds = np.where(sliding, SLIDING, TURNING)
    return Chain(
        parent=np.array([0, *range(n + 3)]),
        kind=np.array([FIXED, SLIDING, SLIDING, TURNING, *kinds]),
        rotation=np.array([*[np.eye(3)] * 4, *(axis_angle(a, a[0]) for a in axes[::-1])]),
        translation=np.concatenate((np.zeros((4, 3)), rng.uniform(-0.5, 0.5, (n, 3)))),
        axis=np.array([np.zeros(3), *np.eye(3), *(a / np.linalg.norm(a) for a in axes)]),
        source=np.arange(-1, n + 3),
    )


def arm_jacobian(chain, positions, local):
    """(6, n) at a point that is fixed to the last frame."""
    count = len(chain.parent)
    rotations, translations = np.empty((count, 3, 3)), np.empty((count, 3))
    J_world = np.empty((6, count - 2))
    place(chain, True, count - 4, positions, rotations, translations, J_world)
    J = np.empty_like(J_world)
    jacobian_at(J_world, rotations[-1] @ local + translations[-1], J)
    return J[:, 2:]


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 9))
def test_gradient_on_random_chains(seed, joints):
    rng = np.random.default_rng(seed)
    chain = serial_chain(rng, joints)
    positions, local = rng.uniform(-3.0, 3.0, joints + 3), rng.uniform(-0.3, 0.3, 3)
    J = arm_jacobian(chain, positions, local)
    gradient = np.full(joints, np.nan)
    m = manipulability_gradient(J, gradient)
    assert m == manipulability(J) == manipulability(np.ascontiguousarray(J))
    step = 1e-5 * np.eye(joints + 3)[3:]
    numeric = [
        manipulability(arm_jacobian(chain, positions + d, local))
        - manipulability(arm_jacobian(chain, positions - d, local))
        for d in step
    ]
    np.testing.assert_allclose(gradient, np.array(numeric) / 2e-5, rtol=1e-5, atol=1e-7)
    assert np.abs(gradient).max() > 1e-3


def test_translational_measure_is_that_of_the_linear_rows(frankie):
    here = frankie.configuration(np.zeros(3), frankie.home)
    J = here.J_tool[:3, 2:]
    assert here.translational_manipulability == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)))
