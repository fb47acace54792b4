import numpy as np
import pytest

from motm_wbc.errors import UnknownName
from motm_wbc.geometry import se2
from motm_wbc.kinematics.rotations import rotation_vector

STEP = 1e-6


def random_state(model, rng):
    low = np.where(np.isfinite(model.q_lower), model.q_lower, -7.0)
    high = np.where(np.isfinite(model.q_upper), model.q_upper, 7.0)
    return rng.uniform([-3.0, -3.0, -4.0], [3.0, 3.0, 4.0]), rng.uniform(low, high)


def moved(model, base_pose, q, inputs, step):
    """Where the inputs, held for `step` seconds, lead to."""
    u = inputs[: model.n_base]
    vx, vy, omega = (u[0], 0.0, u[1]) if model.n_base == 2 else u
    return model.configuration(
        se2.integrate_twist(base_pose, vx, vy, omega, step), q + step * inputs[model.n_base :]
    )


def differences(model, base_pose, q, value):
    """Central differences of `value(configuration)` for every input, as columns."""
    columns = []
    for inputs in np.eye(model.n_base + model.n_arm):
        ahead = value(moved(model, base_pose, q, inputs, STEP))
        behind = value(moved(model, base_pose, q, inputs, -STEP))
        columns.append((ahead - behind) / (2 * STEP))
    return np.array(columns).T


def test_tool_jacobian_is_the_derivative_of_the_tool_pose(robot):
    rng = np.random.default_rng(1)
    for _ in range(20):
        base_pose, q = random_state(robot, rng)
        here = robot.configuration(base_pose, q)
        R = here.T_world_tool[:3, :3]
        linear = differences(robot, base_pose, q, lambda c: c.T_world_tool[:3, 3])
        angular = differences(
            robot, base_pose, q, lambda c, R=R: rotation_vector(c.T_world_tool[:3, :3] @ R.T)
        )
        np.testing.assert_allclose(here.J_tool, np.vstack([linear, angular]), atol=1e-8)
        assert np.abs(here.J_tool).max() > 0.9


def test_point_jacobian_is_the_derivative_of_a_point_on_the_link(robot):
    rng = np.random.default_rng(2)
    for index, link in enumerate(robot.capsules.frames):
        base_pose, q = random_state(robot, rng)
        here = robot.configuration(base_pose, q)
        local = np.append(rng.uniform(-0.1, 0.1, 3), 1.0)
        point = (here.link_pose(link) @ local)[:3]
        expected = differences(
            robot, base_pose, q, lambda c, link=link, local=local: (c.link_pose(link) @ local)[:3]
        )
        np.testing.assert_allclose(here.point_jacobian(index, point), expected, atol=1e-8)


def test_differential_base_cannot_slide_sideways(frankie):
    for heading in (0.0, 0.7, -2.5, 9.0):
        here = frankie.configuration(np.array([1.5, -0.7, heading]), frankie.home)
        J = here.point_jacobian(0, np.array([1.5, -0.7, 0.0]))
        ahead, left = (np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))
        np.testing.assert_allclose(np.array(ahead) @ J[:2, :2], [1.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(np.array(left) @ J[:2, :2], [0.0, 0.0], atol=1e-12)
        assert not J[:, 2:].any()


def test_omnidirectional_base_moves_in_its_own_axes(mini):
    here = mini.configuration(np.array([0.3, 0.2, np.pi / 2]), mini.home)
    J = here.point_jacobian(0, np.array([0.3, 0.2, 0.0]))
    np.testing.assert_allclose(J[:, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 0]], atol=1e-12)


def test_capsule_ends_move_with_their_links(robot):
    rng = np.random.default_rng(3)
    here = robot.configuration(*random_state(robot, rng))
    segments = here.capsule_segments()
    assert segments.shape == (len(robot.capsules), 2, 3)
    for segment, link, a, b in zip(
        segments, robot.capsules.frames, robot.capsules.a, robot.capsules.b, strict=True
    ):
        T = here.link_pose(link)
        np.testing.assert_allclose(segment[0], T[:3, :3] @ a + T[:3, 3], atol=1e-12)
        np.testing.assert_allclose(segment[1], T[:3, :3] @ b + T[:3, 3], atol=1e-12)


def test_tool_in_base_does_not_depend_on_where_the_base_stands(robot):
    rng = np.random.default_rng(4)
    base_pose, q = random_state(robot, rng)
    there = robot.configuration(base_pose, q)
    here = robot.configuration(np.zeros(3), q)
    np.testing.assert_allclose(there.T_base_tool, here.T_world_tool, atol=1e-12)
    np.testing.assert_allclose(
        there.T_world_base @ here.T_base_tool, there.T_world_tool, atol=1e-12
    )
    np.testing.assert_allclose(there.link_pose("base_link"), there.T_world_base, atol=1e-12)
    np.testing.assert_allclose(there.link_pose("tool"), there.T_world_tool, atol=1e-12)


def test_mounted_where_the_file_says(frankie):
    here = frankie.configuration(np.zeros(3), frankie.home)
    np.testing.assert_allclose(here.link_pose("panda_link0"), frankie.T_base_arm, atol=1e-12)
    np.testing.assert_allclose(frankie.T_base_arm[:3, 3], [0.15, 0.0, 0.38])
    assert here.T_world_tool[2, 2] == pytest.approx(-1.0, abs=1e-6)  # home: looks down


def test_continuous_joints_count_one_number_each(mini):
    q = np.array([0.1, 2.0, 0.4, -2.5])
    here = mini.configuration(np.zeros(3), q)
    around = mini.configuration(np.zeros(3), q + np.array([0.0, 2 * np.pi, 0.0, -4 * np.pi]))
    np.testing.assert_allclose(here.T_world_tool, around.T_world_tool, atol=1e-12)
    np.testing.assert_array_equal(mini.q_lower, [0.0, -np.inf, -2.0, -np.inf])
    np.testing.assert_array_equal(mini.q_upper, [0.4, np.inf, 2.0, np.inf])
    np.testing.assert_array_equal(mini.v_max, [0.2, 2.0, 2.0, 3.0])


def test_fingers_are_as_far_apart_as_the_gripper_is_wide(frankie):
    for width in (0.0, 0.03, 0.08):
        here = frankie.configuration(np.zeros(3), frankie.home, width)
        left, right = (here.link_pose(link)[:3, 3] for link in frankie.finger_links)
        assert np.linalg.norm(left - right) == pytest.approx(width, abs=1e-12)
    opened = frankie.configuration(np.zeros(3), frankie.home)
    assert opened.gripper_width == 0.08


def test_a_configuration_does_not_change(frankie):
    base_pose, q = np.array([1.0, 2.0, 0.5]), frankie.home.copy()
    here = frankie.configuration(base_pose, q)
    frankie.configuration(np.zeros(3), q + 0.3)
    base_pose += 1.0
    q += 0.2
    again = frankie.configuration(np.array([1.0, 2.0, 0.5]), frankie.home)
    np.testing.assert_array_equal(here.T_world_tool, again.T_world_tool)
    np.testing.assert_array_equal(here.J_tool, again.J_tool)
    np.testing.assert_array_equal(here.capsule_segments(), again.capsule_segments())
    np.testing.assert_array_equal(here.q, frankie.home)


def test_unknown_link_names_the_nearest(frankie):
    here = frankie.configuration(np.zeros(3), frankie.home)
    with pytest.raises(UnknownName, match="unknown link 'panda_hnd'; did you mean 'panda_hand'"):
        here.link_pose("panda_hnd")
