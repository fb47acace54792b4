import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.kinematics import solve_ik
from motm_wbc.kinematics.rotations import axis_angle

FREE_YAW = (1.0, 1.0, 1.0, 1.0, 1.0, 0.0)


def top_down(bearing, radius, height, yaw):
    T = np.eye(4)
    c, s = np.cos(yaw), np.sin(yaw)
    T[:3, :3] = [[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]
    T[:3, 3] = [0.15 + radius * np.cos(bearing), radius * np.sin(bearing), height]
    return T


def test_reaches_every_top_down_grasp_around_the_base(frankie):
    rng = np.random.default_rng(8)
    for _ in range(200):
        bearing = rng.uniform(-2.6, 2.6)
        target = top_down(
            bearing, rng.uniform(0.4, 0.72), rng.uniform(0.5, 0.8), rng.uniform(-3, 3)
        )
        start = frankie.home.copy()
        start[0] = bearing
        result = solve_ik(frankie, target, start, FREE_YAW)
        assert result.converged and result.iterations <= 30
        T = frankie.configuration(np.zeros(3), result.q).T_base_tool
        assert np.linalg.norm(T[:3, 3] - target[:3, 3]) <= 1e-4
        assert np.arccos(min(1.0, T[:3, 2] @ target[:3, 2])) <= 1e-3 + 1e-6
        assert (frankie.q_lower <= result.q).all() and (result.q <= frankie.q_upper).all()


def test_full_pose_is_met(frankie):
    target = top_down(0.4, 0.6, 0.6, 0.9)
    result = solve_ik(frankie, target, frankie.home)
    T = frankie.configuration(np.zeros(3), result.q).T_base_tool
    assert result.converged
    np.testing.assert_allclose(T, target, atol=1.1e-3)
    assert result.position_error == pytest.approx(np.linalg.norm((T - target)[:3, 3]), abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([FREE_YAW, (1.0,) * 6, (1.0, 1.0, 1.0, 0, 0, 0)]))
def test_answers_are_inside_the_limits_and_honest(frankie, seed, weights):
    rng = np.random.default_rng(seed)
    target = np.eye(4)
    target[:3, :3] = axis_angle(rng.normal(size=3), rng.uniform(0.0, np.pi))
    target[:3, 3] = rng.uniform([-1.5, -1.5, -0.5], [1.5, 1.5, 2.0])
    start = rng.uniform(frankie.q_lower - 0.5, frankie.q_upper + 0.5)
    result = solve_ik(frankie, target, start, weights)
    assert (frankie.q_lower <= result.q).all() and (result.q <= frankie.q_upper).all()
    T = frankie.configuration(np.zeros(3), result.q).T_base_tool
    distance = np.linalg.norm(T[:3, 3] - target[:3, 3])
    assert result.position_error == pytest.approx(distance, abs=1e-9)
    assert result.converged == (result.position_error <= 1e-4 and result.angle_error <= 1e-3)
    again = solve_ik(frankie, target, start, weights)
    np.testing.assert_array_equal(again.q, result.q)


def test_out_of_reach_is_said(frankie):
    result = solve_ik(frankie, top_down(0.0, 1.5, 0.6, 0.0), frankie.home, FREE_YAW)
    assert not result.converged
    assert result.position_error > 0.3
    assert result.iterations <= 60


def test_free_axis_keeps_the_wrist_still(frankie):
    T = frankie.configuration(np.zeros(3), frankie.home).T_base_tool
    turned = T.copy()
    turned[:3, :3] = T[:3, :3] @ axis_angle(np.array([0.0, 0.0, 1.0]), 3.0)
    free = solve_ik(frankie, turned, frankie.home, FREE_YAW)
    assert free.converged and free.iterations == 0
    np.testing.assert_array_equal(free.q, frankie.home)
    assert solve_ik(frankie, turned, frankie.home).iterations > 0


def test_opposite_approach_is_turned_round(frankie):
    start = np.array([0.0, 0.0, 0.0, -1.6, 0.0, 1.6, 0.785])
    T = frankie.configuration(np.zeros(3), start).T_base_tool
    target = T.copy()
    target[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ T[:3, :3]
    result = solve_ik(frankie, target, start, FREE_YAW)
    assert result.angle_error < np.pi - 0.5  # it moves off the half turn


def test_posture_pulls_where_the_target_allows(frankie):
    target = top_down(0.3, 0.6, 0.65, 0.5)
    start = frankie.home.copy()
    start[2] = 0.8
    result = solve_ik(frankie, target, start)
    assert result.converged
    assert abs(result.q[2]) < 0.5


def test_continuous_joints_and_few_joints(mini):
    q = np.array([0.2, 2.9, 0.4, 0.3])
    target = mini.configuration(np.zeros(3), q).T_base_tool
    result = solve_ik(mini, target, np.array([0.1, 3.6, 0.5, 0.1]))
    assert result.converged
    np.testing.assert_allclose(result.q, q, atol=5e-3)
