"""The compiled step against the same problem put together from Pinocchio, coal and numpy."""

import coal
import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.kinematics.urdf import BASE_JOINTS
from motm_wbc.qp import (
    Body,
    FreeBase,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    WholeBodyParameters,
)
from motm_wbc.qp.nearby import measure, rough_pairs
from motm_wbc.qp.problem import NO_BOUND
from motm_wbc.scene.finder import robot_names

DT = 1.0 / 120.0
P = WholeBodyParameters(collision_rows=40)


@pytest.fixture(scope="module", params=robot_names())
def model(request):
    return load_robot(request.param)


class InPinocchio:
    """Pose, Jacobian by inputs and bias acceleration of the tool, from the generated URDF."""

    def __init__(self, model):
        self.model = model
        self.pin = pinocchio.buildModelFromUrdf(str(model.urdf_path))
        self.data = self.pin.createData()
        self.base = [self.pin.joints[self.pin.getJointId(name)] for name in BASE_JOINTS]
        self.arm = [self.pin.joints[self.pin.getJointId(name)] for name in model.arm_joints]

    def tool(self, pose, q, inputs):
        positions, velocities, accelerations = self.vectors(pose, q, inputs)
        pinocchio.forwardKinematics(self.pin, self.data, positions, velocities, accelerations)
        pinocchio.computeJointJacobians(self.pin, self.data, positions)
        pinocchio.updateFramePlacements(self.pin, self.data)
        frame = self.pin.getFrameId(self.model.tool_link)
        axes = pinocchio.LOCAL_WORLD_ALIGNED
        J = pinocchio.getFrameJacobian(self.pin, self.data, frame, axes)
        base = J[:, [joint.idx_v for joint in self.base]] @ self.selection(pose[2])
        arm = J[:, [joint.idx_v for joint in self.arm]]
        bias = pinocchio.getFrameClassicalAcceleration(self.pin, self.data, frame, axes)
        T = self.data.oMf[frame].homogeneous
        return T, np.hstack((base, arm)), np.concatenate((bias.linear, bias.angular))

    def vectors(self, pose, q, inputs):
        """Of all joints; the planar ones lie along world axes, so a held twist turns in them."""
        positions = pinocchio.neutral(self.pin)
        velocities, accelerations = np.zeros(self.pin.nv), np.zeros(self.pin.nv)
        rates = self.selection(pose[2]) @ inputs[: self.model.n_base]
        turning = rates[2] * np.array([-rates[1], rates[0], 0.0])
        for joints, places in ((self.base, pose), (self.arm, q)):
            for joint, place in zip(joints, places, strict=True):
                turns = joint.nq == 2
                positions[joint.idx_q : joint.idx_q + joint.nq] = (
                    [np.cos(place), np.sin(place)] if turns else place
                )
        for joint, rate, acceleration in zip(self.base, rates, turning, strict=True):
            velocities[joint.idx_v], accelerations[joint.idx_v] = rate, acceleration
        for joint, rate in zip(self.arm, inputs[self.model.n_base :], strict=True):
            velocities[joint.idx_v] = rate
        return positions, velocities, accelerations

    def selection(self, heading):
        """(3, n_base) planar joint rates of the base's inputs."""
        c, s = np.cos(heading), np.sin(heading)
        if self.model.base_kind is BaseKind.DIFFERENTIAL:
            return np.array([[c, 0.0], [s, 0.0], [0.0, 1.0]])
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def random_rotation(rng):
    return Rotation.random(rng=rng).as_matrix()


def random_case(model, rng):
    span = np.where(np.isfinite(model.q_upper - model.q_lower), model.q_upper - model.q_lower, 6.0)
    low = np.where(np.isfinite(model.q_lower), model.q_lower, -3.0)
    n = model.n_base + model.n_arm
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = random_rotation(rng), rng.normal(size=3)
    tool = ToolTask(
        rng.normal(size=6) * 0.3,
        T_world_target=T if rng.uniform() < 0.7 else None,
        acceleration=rng.normal(size=6),
        gain=rng.uniform(0.5, 8.0),
        weights=rng.uniform(0.0, 1.0, 6),
        R_world_task=random_rotation(rng),
    )
    posture = PostureTask(
        low + rng.uniform(0, 1, model.n_arm) * span,
        rng.uniform(0, 1, model.n_arm),
        lower=low + 0.3 * span,
        upper=np.full(model.n_arm, np.inf),
    )
    return {
        "base_pose": np.array([*rng.normal(size=2), rng.uniform(-4, 4)]),
        "q": low + rng.uniform(0.02, 0.98, model.n_arm) * span,
        "previous": (rng.uniform(-0.18, 0.3, model.n_base), rng.uniform(-0.5, 0.5, model.n_arm)),
        "tools": [tool],
        "posture": posture,
        "extra": [LinearTask(rng.normal(size=(2, n)), rng.normal(size=2), rng.uniform(0, 2, 2))],
    }


def wanted_twist(tool, T, bias):
    wanted = tool.twist + 0.5 * DT * (tool.acceleration - bias)
    if tool.T_world_target is None:
        return wanted
    away = tool.gain * (tool.T_world_target[:3, 3] - T[:3, 3])
    turn = tool.gain * pinocchio.log3(tool.T_world_target[:3, :3] @ T[:3, :3].T)
    return wanted + np.concatenate(
        (shortened(away, P.pose_speed), shortened(turn, P.pose_turn_speed))
    )


def shortened(vector, most):
    return vector * min(1.0, most / max(np.linalg.norm(vector), 1e-300))


def cost_of_inputs(model, case, reference, free):
    """H and f over all inputs, and the manipulability's part in f."""
    inputs = np.concatenate(case["previous"])
    T, J, bias = reference.tool(case["base_pose"], case["q"], inputs)
    tool, posture, extra = case["tools"][0], case["posture"], case["extra"][0]
    weights, n_base, n = P.holistic, model.n_base, J.shape[1]
    error = 1.0
    if free:
        goal = tool.T_world_target
        error = np.abs(goal[:3, 3] - T[:3, 3]).sum() if goal is not None else 0.0
        error = error if goal is not None else np.abs(tool.twist[:3]).sum() / weights.servo_gain
        error = np.clip(error, weights.least_error, weights.largest_error)
    scale = np.repeat([P.linear_weight, P.angular_weight] if not free else [1 / error] * 2, 3)
    R = np.kron(np.eye(2), tool.R_world_task)
    W = R @ np.diag(scale * tool.weights) @ R.T
    wanted = wanted_twist(tool, T, bias)
    H, f = J.T @ W @ J, -J.T @ W @ wanted
    H += extra.J.T @ np.diag(extra.weights) @ extra.J
    f -= extra.J.T @ (extra.weights * extra.target)
    missing = tool.R_world_task.T @ (wanted - J @ inputs).reshape(2, 3).T
    size = DT * scale[[0, 3]] * np.sqrt((tool.weights.reshape(2, 3).T * missing**2).sum(axis=0))
    lever = np.linalg.norm(J.reshape(2, 3, -1), axis=1)
    arm = np.arange(n_base, n)
    H[arm, arm] += (size @ lever)[arm]
    H[arm, arm] += weights.arm_weight if free else P.damping
    q = case["q"]
    pull = P.posture_weight * posture.weights
    wish = np.clip(P.posture_gain * (posture.target - q), -P.posture_speed, P.posture_speed)
    near = np.clip(1 - (q - posture.lower) / P.preferred_bound_margin, 0, 1)
    back = np.clip(P.posture_gain * (posture.lower - q), 0, P.posture_speed)
    H[arm, arm] += pull + P.preferred_bound_weight * near
    f[arm] -= pull * wish + P.preferred_bound_weight * near * back
    gradient = model.configuration(case["base_pose"], q).manipulability_gradient
    f[arm] -= (weights.manipulability_weight if free else P.manipulability_weight) * gradient
    return H, f, T, wanted, J


@pytest.mark.parametrize("free", [False, True])
def test_the_cost_is_that_of_pinocchio_and_numpy_to_1e_9(model, free):
    rng, reference = np.random.default_rng(4), InPinocchio(model)
    controller = WholeBodyController(model, DT, P, solver="daqp")
    n_base = model.n_base
    for _ in range(150):
        case = random_case(model, rng)
        heading = rng.uniform(-3, 3)
        preferred = rng.uniform(-0.3, 0.3, n_base), rng.uniform(0, 2, n_base)
        # what is a step away from the last command can be followed
        lead = case["previous"][0] * 0.999
        base = FreeBase(*preferred, heading=heading) if free else NavigatedBase(lead)
        result = controller.step(**case, base=base)
        H, f, T, wanted, J = cost_of_inputs(model, case, reference, free)
        if free:
            tool = case["tools"][0]
            goal = tool.T_world_target
            error = (
                np.abs(goal[:3, 3] - T[:3, 3]).sum()
                if goal is not None
                else np.abs(tool.twist[:3]).sum() / P.holistic.servo_gain
            )
            error = np.clip(error, P.holistic.least_error, P.holistic.largest_error)
            index = np.arange(n_base)
            H[index, index] += P.holistic.base_weight / error + preferred[1]
            f[:n_base] -= preferred[0] * preferred[1]
            tool_in_base = np.linalg.inv(se2_matrix(case["base_pose"])) @ T
            f[n_base - 1] -= P.holistic.yaw_weight * np.arctan2(*tool_in_base[1::-1, 3])
            away = (heading - case["base_pose"][2] + np.pi) % (2 * np.pi) - np.pi
            H[n_base - 1, n_base - 1] += 1.0
            f[n_base - 1] -= 1.5 * away
        else:
            S = np.zeros((J.shape[1], 1 + model.n_arm))
            S[:n_base, 0], S[n_base:, 1:] = lead, np.eye(model.n_arm)
            H, f = S.T @ H @ S, S.T @ f
            pull = P.scale_weight * max(np.abs(lead).sum(), 1e-3)
            H[0, 0] += pull
            f[0] -= 2 * pull
        problem = controller.problem
        np.testing.assert_allclose(problem.H, H, rtol=1e-9, atol=1e-9 * np.abs(H).max())
        np.testing.assert_allclose(problem.f, f, rtol=1e-9, atol=1e-9 * np.abs(f).max())
        x = np.concatenate((result.base, result.arm))
        np.testing.assert_allclose(result.slack, wanted - J @ x, atol=1e-9)


def se2_matrix(pose):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", pose[2]).as_matrix()
    T[:2, 3] = pose[:2]
    return T


def random_bodies(rng, centre):
    """Boxes, prisms and cylinders about the robot, some of them in it."""
    bodies = []
    for index in range(8):
        kind = index % 3
        pose = np.array([*(centre + rng.uniform(-1.0, 1.0, 2)), rng.uniform(-3, 3)])
        bottom = rng.uniform(0.0, 0.9)
        outline = polygons.rectangle(*rng.uniform(0.05, 0.4, 2))
        if kind == 1:
            angles = np.sort(rng.uniform(0, 2 * np.pi, 5)) + np.arange(5) * 1e-3
            outline = 0.2 * np.column_stack([np.cos(angles), np.sin(angles)])
        bodies.append(
            Body(
                name=f"solid{index}",
                role=SolidRole.OBSTACLE,
                outlines=() if kind == 2 else (outline,),
                radius=0.15 if kind == 2 else None,
                bottom=bottom,
                top=bottom + rng.uniform(0.02, 0.6),
                pose=pose,
                velocity=np.zeros(3),
            )
        )
    return tuple(bodies)


def in_coal(body):
    place = coal.Transform3s(
        Rotation.from_euler("z", body.pose[2]).as_matrix(),
        np.array([*body.pose[:2], 0.5 * (body.bottom + body.top)]),
    )
    height = body.top - body.bottom
    if body.radius is not None:
        return coal.Cylinder(body.radius, height), place
    points = coal.StdVec_Vec3s()
    for z in (-0.5 * height, 0.5 * height):
        for corner in body.outlines[0]:
            points.append(np.array([*corner, z]))
    return coal.Convex.convexHull(points, True, None), place


def capsule_in_coal(a, b, radius):
    along = b - a
    length = np.linalg.norm(along)
    turn, _ = Rotation.align_vectors([along / length], [[0, 0, 1.0]])
    return coal.Capsule(radius, length), coal.Transform3s(turn.as_matrix(), 0.5 * (a + b))


@pytest.mark.filterwarnings("ignore:Optimal rotation is not uniquely")
def test_distances_of_the_whole_robot_are_coals_to_1e_5(model):
    """Each pair within reach, and none is missing."""
    rng = np.random.default_rng(5)
    compared, overlapping = 0, 0
    for _ in range(25):
        case = random_case(model, rng)
        bodies = random_bodies(rng, case["base_pose"][:2])
        controller = WholeBodyController(model, DT, P, solver="daqp")
        controller.step(**case, base=FreeBase(), bodies=bodies)
        near = controller._neighbourhood
        here = model.configuration(case["base_pose"], case["q"])
        ends = here.capsule_segments()
        solids = [in_coal(body) for body in bodies]
        expected = {}
        for k, segment in enumerate(ends):
            capsule = capsule_in_coal(*segment, model.capsules.radius[k])
            for index, solid in enumerate(solids):
                request, result = coal.DistanceRequest(), coal.DistanceResult()
                request.enable_signed_distance = True
                expected[k, 1 + index] = coal.distance(*capsule, *solid, request, result)
        assert len(near.shapes.owner) == 1 + len(bodies)
        found = near_pairs(controller)
        for pair, distance in expected.items():
            reach = near.pairs.reach[pair]
            if distance < reach - 1e-5:
                # coal iterates in penetration with curved shapes; its own tolerance is 1e-6
                assert found[pair] == pytest.approx(distance, abs=1e-5)
                compared += 1
                overlapping += distance < 0.0
    assert compared > 400 and overlapping > 20


def near_pairs(controller):
    """Pair -> distance of all pairs that may be near, by the kernels."""
    step = controller._step
    count, found = rough_pairs(step.segments, step.scene, step.pairs, True, step.near), {}
    for c in range(count):
        measure(step.segments, step.scene, step.near, c)
        found[tuple(step.near.pair[c].tolist())] = step.near.contact[c, 0]
    return found


def test_rows_are_those_of_the_inputs_where_navigation_scales_them(model):
    """Both modes see the same dampers; one factor stands for the base's columns."""
    rng = np.random.default_rng(6)
    controller = WholeBodyController(model, DT, P, solver="daqp")
    compared = 0
    for _ in range(40):
        case = random_case(model, rng)
        bodies = random_bodies(rng, case["base_pose"][:2])
        lead = case["previous"][0] * 0.999
        controller.step(**case, base=NavigatedBase(lead), bodies=bodies)
        A, rows = controller.problem.A.copy(), controller._step.rows.A
        used = controller.problem.bound < NO_BOUND
        np.testing.assert_allclose(A[:, 0], rows[:, : model.n_base] @ lead, atol=1e-12)
        np.testing.assert_allclose(A[:, 1:], rows[:, model.n_base :], atol=0.0)
        compared += used.sum()
    assert compared > 200


def test_the_tool_moves_by_its_mean_twist(model):
    """Second order: after one step the tool is where the wanted twist leads, but for dt^3."""
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(60):
        inputs = np.concatenate(
            (rng.uniform(-0.4, 0.4, model.n_base), rng.uniform(-0.6, 0.6, model.n_arm))
        )
        case = random_case(model, rng)
        case["previous"] = inputs[: model.n_base], inputs[model.n_base :]
        case["tools"] = [ToolTask()]
        controller = WholeBodyController(model, DT, P, solver="daqp")
        result = controller.step(**case, base=FreeBase())
        before = model.configuration(case["base_pose"], case["q"])
        # the twist that these inputs really give, by the controller's own account
        account = before.J_tool @ inputs + 0.5 * DT * bias_of(result, before, controller)
        base = inputs[: model.n_base]
        sideways = 0.0 if model.base_kind is BaseKind.DIFFERENTIAL else base[1]
        pose = se2.integrate_twist(case["base_pose"], base[0], sideways, base[-1], DT)
        after = model.configuration(pose, case["q"] + inputs[model.n_base :] * DT)
        moved = (after.T_world_tool[:3, 3] - before.T_world_tool[:3, 3]) / DT
        worst = max(worst, np.abs(moved - account[:3]).max())
    assert worst < 1e-4  # without the second order it is 2e-3


def bias_of(result, here, controller):
    """Jdot x of the last command: what a task without any wish is left with, twofold."""
    x = np.concatenate((result.base, result.arm))
    return -2.0 / DT * (result.slack + here.J_tool @ x)
