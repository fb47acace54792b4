"""The robot in a physics client: motors that follow velocities with limited force."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.interfaces import Command
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.urdf import BASE_JOINTS, BASE_LINKS, TOOL_LINK
from motm_wbc.simulation.bullet_client import BulletClient, quiet
from motm_wbc.simulation.parameters import PhysicsParameters
from motm_wbc.simulation.quaternions import pose_matrix


@dataclass(frozen=True, slots=True)
class RobotReading:
    """The robot's joints after a physics step.

    Attributes:
        base_pose: (3,).
        base_velocity: base inputs.
        q: (n,) arm joint positions.
        v: (n,) arm joint velocities.
        gripper_width: [m].
    """

    base_pose: Array
    base_velocity: Array
    q: Array
    v: Array
    gripper_width: float


class BulletRobot:
    """Base, arm and fingers on velocity motors.

    The base hangs on three joints (x, y, yaw). That it rolls and can't slide is a rule of
    the drive: its inputs are turned into world axes at every physics step.

    Args:
        client: the physics client.
        model: the robot.
        start: (3,) base pose.
        parameters: forces of the base's motors.
        dt: physics step [s].
    """

    def __init__(
        self,
        client: BulletClient,
        model: RobotModel,
        start: Array,
        parameters: PhysicsParameters,
        dt: float,
    ) -> None:
        self._client = client
        self._model = model
        self._dt = dt
        self._fingers = model.description.gripper.fingers
        with quiet():
            self.body: int = client.loadURDF(
                str(model.urdf_path), useFixedBase=True, flags=client.URDF_USE_INERTIA_FROM_FILE
            )
        infos = [client.getJointInfo(self.body, i) for i in range(client.getNumJoints(self.body))]
        joint_of = {info[1].decode(): info[0] for info in infos}
        self._link_of = {info[12].decode(): info[0] for info in infos}
        self.tool: int = self._link_of[TOOL_LINK]
        self.finger_links = tuple(self._link_of[finger.link] for finger in self._fingers)
        names = (*BASE_JOINTS, *model.arm_joints, *model.finger_joints)
        self._joints = [joint_of[name] for name in names]
        self._finger_now = np.zeros(len(self._fingers))
        self._forces = self._motor_forces(infos, parameters)
        self._prepare(start)
        self.reading = self._read()

    def _motor_forces(
        self, infos: Sequence[tuple[object, ...]], p: PhysicsParameters
    ) -> list[float]:
        """Largest force or torque of each motor, in the order of the joints."""
        arm = self._joints[3 : 3 + self._model.n_arm]
        efforts = [float(str(infos[joint][10])) for joint in arm]
        finger = self._model.description.gripper.force
        return [p.base_force, p.base_force, p.base_torque, *efforts, *[finger] * len(self._fingers)]

    def _prepare(self, start: Array) -> None:
        client = self._client
        fingers = self._model.finger_positions(self._model.description.gripper.max_width)
        positions = [*start, *self._model.home, *fingers]
        for joint, position in zip(self._joints, positions, strict=True):
            client.resetJointState(self.body, joint, float(position))
        for link in range(-1, client.getNumJoints(self.body)):
            client.changeDynamics(
                self.body, link, linearDamping=0.0, angularDamping=0.0, jointDamping=0.0
            )

    def ignore(self, body: int) -> None:
        """Let the base's own links pass through a body: wheels are no part of this model."""
        for name in BASE_LINKS:
            self._client.setCollisionFilterPair(self.body, body, self._link_of[name], -1, 0)

    def set_finger_friction(self, friction: float) -> None:
        """Friction coefficient of the fingers."""
        for link in self.finger_links:
            self._client.changeDynamics(self.body, link, lateralFriction=friction)

    def drive(self, command: Command, gripper_width: float) -> None:
        """Set all motors for the next physics step; fingers go to a width [m]."""
        arm = [float(value) for value in command.arm]
        targets = [*self._base_targets(command.base), *arm, *self._finger_targets(gripper_width)]
        self._client.setJointMotorControlArray(
            self.body,
            self._joints,
            self._client.VELOCITY_CONTROL,
            targetVelocities=targets,
            forces=self._forces,
        )

    def _base_targets(self, inputs: Array) -> list[float]:
        """World velocities whose step is the chord of the arc that the inputs mean."""
        omega = float(inputs[-1])
        half = 0.5 * omega * self._dt
        chord = math.sin(half) / half if abs(half) > 1e-9 else 1.0
        heading = float(self.reading.base_pose[2]) + half
        vx = float(inputs[0]) * chord
        vy = float(inputs[1]) * chord if self._is_omnidirectional else 0.0
        c, s = math.cos(heading), math.sin(heading)
        return [c * vx - s * vy, s * vx + c * vy, omega]

    @property
    def _is_omnidirectional(self) -> bool:
        return self._model.base_kind is BaseKind.OMNIDIRECTIONAL

    def _finger_targets(self, width: float) -> list[float]:
        """Joint velocities that bring the fingers to a width within a physics step."""
        gripper = self._model.description.gripper
        # The width's own speed is limited upstream; this only bounds the catching up.
        fastest = 2.0 * max(gripper.closing_speed, gripper.opening_speed)
        wanted = self._model.finger_positions(width)
        targets = []
        for finger, target, now in zip(self._fingers, wanted, self._finger_now, strict=True):
            limit = fastest * abs(finger.per_width)
            targets.append(min(max((target - float(now)) / self._dt, -limit), limit))
        return targets

    def read(self) -> None:
        """Read the joints after a physics step."""
        self.reading = self._read()

    def _read(self) -> RobotReading:
        states = self._client.getJointStates(self.body, self._joints)
        position = np.array([state[0] for state in states])
        velocity = np.array([state[1] for state in states])
        n = self._model.n_arm
        pose = position[:3].copy()
        pose[2] = wrap(pose[2])
        self._finger_now = position[3 + n :]
        self._T_world_tool: Array | None = None
        return RobotReading(
            base_pose=pose,
            base_velocity=self._inputs(pose[2], velocity[:3]),
            q=position[3 : 3 + n],
            v=velocity[3 : 3 + n],
            gripper_width=self._width(position[3 + n :]),
        )

    def _inputs(self, heading: float, velocity: Array) -> Array:
        """Base inputs of a velocity in world axes."""
        c, s = math.cos(heading), math.sin(heading)
        ahead, left = c * velocity[0] + s * velocity[1], c * velocity[1] - s * velocity[0]
        if self._is_omnidirectional:
            return np.array([ahead, left, velocity[2]])
        return np.array([ahead, velocity[2]])

    def _width(self, positions: Array) -> float:
        widths = [
            (q - finger.closed) / finger.per_width
            for q, finger in zip(positions, self._fingers, strict=True)
        ]
        return float(sum(widths) / len(widths)) if widths else math.nan

    def T_world_tool(self) -> Array:
        """(4, 4) pose of the tool frame."""
        if self._T_world_tool is None:
            state = self._client.getLinkState(self.body, self.tool, computeForwardKinematics=1)
            self._T_world_tool = pose_matrix(state[4], state[5])
        return self._T_world_tool
