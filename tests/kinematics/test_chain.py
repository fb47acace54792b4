"""The compiled kinematics against Pinocchio, and against finite differences."""

from dataclasses import dataclass

import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.geometry import se2
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics.chain import (
    Chain,
    bias_acceleration,
    forward,
    input_jacobian,
    jacobian_at,
    moved_by_arm,
)
from motm_wbc.kinematics.pinocchio_model import read_model
from motm_wbc.kinematics.rotations import rotation_error
from motm_wbc.kinematics.urdf import BASE_JOINTS, BASE_LINK, BASE_LINKS, WORLD_LINK

CARRIAGES = BASE_LINKS[:2]
"""Between world and base; the base's inputs don't move them as they move all else."""

seeds = st.integers(0, 2**32 - 1)


@dataclass
class Tree:
    """A robot as the kernels see it, and the same one in Pinocchio."""

    chain: Chain
    frames: dict
    n_arm: int
    reference: pinocchio.Model
    names: list

    def placed(self, positions):
        count = len(self.chain.parent)
        rotations, translations = np.full((count, 3, 3), np.nan), np.full((count, 3), np.nan)
        forward(self.chain, positions, rotations, translations)
        return rotations, translations

    def pose(self, link, positions):
        rotations, translations = self.placed(positions)
        joint, placement = self.frames[link]
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotations[joint], translations[joint]
        return T @ placement

    def jacobian(self, positions, differential):
        J = np.full((6, (2 if differential else 3) + self.n_arm), np.nan)
        input_jacobian(
            self.chain, differential, positions[:3], self.n_arm, *self.placed(positions), J
        )
        return J

    def moved_by(self, link, n_base):
        arm = moved_by_arm(self.chain, self.frames[link][0], self.n_arm)
        return np.concatenate((np.full(n_base, float(link != WORLD_LINK)), arm))

    def moved(self, positions, inputs, step):
        """Positions after `step` seconds of constant inputs."""
        vx, vy, omega = twist_of(inputs[: len(inputs) - self.n_arm])
        base = se2.integrate_twist(positions[:3], vx, vy, omega, step)
        arm = positions[3 : 3 + self.n_arm] + step * inputs[len(inputs) - self.n_arm :]
        return np.concatenate((base, arm, positions[3 + self.n_arm :]))


def twist_of(base):
    return (base[0], 0.0, base[1]) if len(base) == 2 else base


def in_pinocchio(tree, positions, inputs):
    """Pinocchio's data while the inputs are held.

    The planar joints lie along the world's axes: while the base turns at a constant twist,
    their rates turn with it, and so they accelerate.
    """
    model = tree.reference
    q, v, a = pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    vx, vy, omega = twist_of(inputs[: len(inputs) - tree.n_arm])
    c, s = np.cos(positions[2]), np.sin(positions[2])
    rates = [c * vx - s * vy, s * vx + c * vy, omega, *inputs[len(inputs) - tree.n_arm :]]
    for name, position in zip(tree.names, positions, strict=True):
        joint = model.joints[model.getJointId(name)]
        turn = [np.cos(position), np.sin(position)]
        q[joint.idx_q : joint.idx_q + joint.nq] = position if joint.nq == 1 else turn
    for name, rate in zip(tree.names, rates, strict=False):
        v[model.joints[model.getJointId(name)].idx_v] = rate
    for name, rate in zip(BASE_JOINTS, [-omega * rates[1], omega * rates[0], 0.0], strict=True):
        a[model.joints[model.getJointId(name)].idx_v] = rate
    data = model.createData()
    pinocchio.forwardKinematics(model, data, q, v, a)
    pinocchio.updateFramePlacements(model, data)
    return data


def tree_of(urdf_path, arm_joints, fingers):
    read = read_model(urdf_path, arm_joints, fingers)
    reference = pinocchio.buildModelFromUrdf(str(urdf_path))
    names = [*BASE_JOINTS, *arm_joints, *fingers]
    return Tree(read.chain, read.frames, len(arm_joints), reference, names)


def random_urdf(rng):
    """Joints of all types on skew axes, each on any of the links before it, and fixed links.

    Returns:
        The text, the names of the arm's joints and of the others.
    """
    lines = [f'<link name="{name}"/>' for name in (WORLD_LINK, *BASE_LINKS)]
    ends = zip((WORLD_LINK, *BASE_LINKS[:2]), BASE_LINKS, strict=True)
    types = (("prismatic", "1 0 0"), ("prismatic", "0 1 0"), ("continuous", "0 0 1"))
    for name, (parent, child), (kind, axis) in zip(BASE_JOINTS, ends, types, strict=True):
        lines.append(joint_text(name, kind, parent, child, axis, "0 0 0", "0 0 0"))
    links, arm, others = [BASE_LINK], [], []
    for k in range(rng.integers(1, 11)):
        # names fall, so that Pinocchio, which numbers by the alphabet, has another order
        name = f"j{99 - k}"
        kind = str(
            rng.choice(["revolute", "continuous", "prismatic", "fixed"], p=(0.3,) * 3 + (0.1,))
        )
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.3 else rng.normal(size=3)
        parent = links[-1] if rng.random() < 0.6 else str(rng.choice(links))
        numbers = (axis / np.linalg.norm(axis), rng.uniform(-0.5, 0.5, 3), rng.uniform(-3, 3, 3))
        texts = (" ".join(repr(float(value)) for value in row) for row in numbers)
        lines += [f'<link name="l{k}"/>', joint_text(name, kind, parent, f"l{k}", *texts)]
        links.append(f"l{k}")
        if kind != "fixed":
            (arm if rng.random() < 0.7 else others).append(name)
    return f'<robot name="tree">{"".join(lines)}</robot>', arm, others


def joint_text(name, kind, parent, child, axis, xyz, rpy):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
    )


@pytest.fixture(scope="session")
def random_tree(tmp_path_factory):
    path = tmp_path_factory.mktemp("trees") / "tree.urdf"

    def make(rng):
        text, arm, others = random_urdf(rng)
        path.write_text(text)
        return tree_of(path, arm, others)

    return make


def random_state(tree, rng, n_base):
    return (
        rng.uniform(-3.0, 3.0, len(tree.names)),
        rng.uniform(-2.0, 2.0, n_base + tree.n_arm),
    )


def agree_with_pinocchio(tree, rng, differential):
    """Pose, velocity and bias acceleration of every link."""
    n_base = 2 if differential else 3
    positions, inputs = random_state(tree, rng, n_base)
    data = in_pinocchio(tree, positions, inputs)
    J_world = tree.jacobian(positions, differential)
    axes = pinocchio.LOCAL_WORLD_ALIGNED
    for link in tree.frames:
        index = tree.reference.getFrameId(link)
        T = tree.pose(link, positions)
        np.testing.assert_allclose(T, data.oMf[index].homogeneous, rtol=1e-9, atol=1e-9)
        if link in CARRIAGES:
            continue
        moved_by = tree.moved_by(link, n_base)
        J = np.empty_like(J_world)
        jacobian_at(J_world * moved_by, T[:3, 3], J)
        velocity = pinocchio.getFrameVelocity(tree.reference, data, index, axes).vector
        np.testing.assert_allclose(J @ inputs, velocity, rtol=1e-9, atol=1e-9)
        bias = np.full(6, np.nan)
        bias_acceleration(J_world, moved_by, n_base, inputs, T[:3, 3], bias)
        expected = pinocchio.getFrameClassicalAcceleration(tree.reference, data, index, axes)
        np.testing.assert_allclose(bias, expected.vector, rtol=1e-9, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(seeds, st.booleans())
def test_random_trees_agree_with_pinocchio(random_tree, seed, differential):
    rng = np.random.default_rng(seed)
    agree_with_pinocchio(random_tree(rng), rng, differential)


def test_robots_agree_with_pinocchio(robot):
    tree = tree_of(robot.urdf_path, robot.arm_joints, robot.finger_joints)
    rng = np.random.default_rng(11)
    for _ in range(50):
        agree_with_pinocchio(tree, rng, robot.base_kind is BaseKind.DIFFERENTIAL)


@settings(max_examples=40, deadline=None)
@given(seeds, st.booleans())
def test_velocity_and_acceleration_are_derivatives(random_tree, seed, differential):
    rng = np.random.default_rng(seed)
    tree = random_tree(rng)
    n_base = 2 if differential else 3
    positions, inputs = random_state(tree, rng, n_base)
    link = str(rng.choice([name for name in tree.frames if name not in CARRIAGES]))
    moved_by = tree.moved_by(link, n_base)

    def velocity(at):
        J_world = tree.jacobian(at, differential)
        J = np.empty_like(J_world)
        jacobian_at(J_world * moved_by, tree.pose(link, at)[:3, 3], J)
        return J @ inputs

    step = 1e-5
    ahead, behind = tree.moved(positions, inputs, step), tree.moved(positions, inputs, -step)
    T_ahead, T_behind = tree.pose(link, ahead), tree.pose(link, behind)
    linear = T_ahead[:3, 3] - T_behind[:3, 3]
    angular = rotation_error(T_ahead[:3, :3], T_behind[:3, :3])
    np.testing.assert_allclose(
        velocity(positions), np.concatenate((linear, angular)) / (2 * step), atol=1e-6
    )
    bias = np.empty(6)
    point = tree.pose(link, positions)[:3, 3]
    bias_acceleration(tree.jacobian(positions, differential), moved_by, n_base, inputs, point, bias)
    change = (velocity(ahead) - velocity(behind)) / (2 * step)
    np.testing.assert_allclose(bias, change, atol=1e-6)


def test_a_base_alone_has_the_acceleration_of_its_circle(frankie):
    here = frankie.configuration(np.array([0.4, -0.2, 0.9]), frankie.home)
    inputs = np.zeros(9)
    inputs[:2] = 0.5, 1.2
    bias = np.empty(6)
    tool = here.T_world_tool[:3, 3]
    bias_acceleration(here.J_world, np.ones(9), 2, inputs, tool, bias)
    left = here.T_world_base[:2, 1]
    circle = 0.5 * 1.2 * left - 1.2**2 * (tool[:2] - here.base_pose[:2])
    np.testing.assert_allclose(bias, [*circle, 0.0, 0.0, 0.0, 0.0], atol=1e-12)


def test_trees_have_branches_and_joints_without_inputs(random_tree):
    rng = np.random.default_rng(12)
    trees = [random_tree(rng) for _ in range(30)]
    assert any(len(set(tree.chain.parent[4:])) < len(tree.chain.parent[4:]) for tree in trees)
    assert any((np.diff(tree.chain.source) < 0).any() for tree in trees)
    assert any(tree.n_arm + 3 < len(tree.names) for tree in trees)
