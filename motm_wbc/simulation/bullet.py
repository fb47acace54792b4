"""The physics plant: rigid bodies, contact and friction by pybullet."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Command
from motm_wbc.kinematics.rotations import inverse_pose
from motm_wbc.simulation.bullet_client import BulletClient
from motm_wbc.simulation.bullet_robot import BulletRobot
from motm_wbc.simulation.bullet_scene import BulletScene
from motm_wbc.simulation.plant import PlantSetup, SimulatedPlant
from motm_wbc.simulation.quaternions import quaternion

_NEAR = 0.1  # [m] between fingers and an object beyond which contacts aren't asked for


class BulletPlant(SimulatedPlant):
    """Motors follow the commanded velocities with limited force; objects obey physics.

    A grasp holds only when both fingers touch the object: then a fixed joint ties it to the
    tool until the fingers open. The simulation is deterministic to the bit.

    Args:
        setup: what it is made from.
    """

    def __init__(self, setup: PlantSetup) -> None:
        super().__init__(setup)
        scenario, model, parameters = setup.scenario, setup.model, setup.parameters
        client = BulletClient()
        self._client = client
        client.setPhysicsEngineParameter(
            fixedTimeStep=self._dt,
            numSolverIterations=parameters.solver_iterations,
            deterministicOverlappingPairs=1,
        )
        client.setGravity(0.0, 0.0, -parameters.gravity)
        self._scene = BulletScene(client, scenario, parameters)
        self._robot = BulletRobot(client, model, scenario.start_pose, parameters, self._dt)
        self._robot.ignore(self._scene.floor)
        self._robot.set_finger_friction(parameters.contact_friction)
        self._tie: int | None = None
        self._poses = self._read_objects()
        self._sample_sensors()

    def close(self) -> None:
        """End the simulation."""
        self._client.close()

    def _advance(self, command: Command) -> None:
        self._robot.drive(command, self._gripper.fingers.reference)
        if self._moving:
            self._scene.move(self._moving_bodies())
        self._client.stepSimulation()
        self._robot.read()
        before, self._poses = self._poses, self._read_objects()
        for name in self._poses:
            if name != self._gripper.held and self._is_near(name):
                self._meet_fingers(name, before[name])

    def _read_objects(self) -> dict[str, Array]:
        return {name: self._scene.T_world_object(name) for name in self._scene.objects}

    def _is_near(self, name: str) -> bool:
        gap = self._poses[name][:3, 3] - self._T_world_tool()[:3, 3]
        far = self._shapes[name].radius + self.model.description.gripper.max_width + _NEAR
        return float(gap @ gap) < far * far

    def _meet_fingers(self, name: str, before: Array) -> None:
        """Hold the object if both fingers touch it; tell if one knocks against it."""
        touching = self._touching(name)
        T_world_tool = self._T_world_tool()
        if all(touching) and self._gripper.may_hold(name, T_world_tool, self._poses[name]):
            self._tie = self._tie_to_tool(name, T_world_tool)
            self._take(name, self._gripper_width())
        elif any(touching) and self._robot.finger_links:
            moved = float(np.linalg.norm(self._poses[name][:2, 3] - before[:2, 3]))
            self._pushed(name, moved)

    def _touching(self, name: str) -> list[bool]:
        """Whether each finger touches the object; without fingers, whether it fits the grip."""
        body = self._scene.objects[name]
        if not self._robot.finger_links:
            axis = self._T_world_tool()[:3, :3] @ self._closing_axis
            width = self._shapes[name].width(self._poses[name], axis)
            return [self._gripper.fingers.reference <= width]
        return [
            bool(self._client.getContactPoints(self._robot.body, body, link, -1))
            for link in self._robot.finger_links
        ]

    def _tie_to_tool(self, name: str, T_world_tool: Array) -> int:
        """A fixed joint between tool and object, where they are now."""
        T_tool_object = inverse_pose(T_world_tool) @ self._poses[name]
        centre = T_tool_object[:3, 3] + T_tool_object[:3, :3] @ self._scene.centres[name]
        return int(
            self._client.createConstraint(
                self._robot.body,
                self._robot.tool,
                self._scene.objects[name],
                -1,
                self._client.JOINT_FIXED,
                (0.0, 0.0, 0.0),
                centre.tolist(),
                (0.0, 0.0, 0.0),
                quaternion(T_tool_object[:3, :3]),
                (0.0, 0.0, 0.0, 1.0),
            )
        )

    def _let_go(self, name: str) -> None:
        if self._tie is not None:
            self._client.removeConstraint(self._tie)
            self._tie = None

    def _base_pose(self) -> Array:
        return self._robot.reading.base_pose

    def _base_velocity(self) -> Array:
        return self._robot.reading.base_velocity

    def _arm_position(self) -> Array:
        return self._robot.reading.q

    def _arm_velocity(self) -> Array:
        return self._robot.reading.v

    def _gripper_width(self) -> float:
        if self._robot.finger_links:
            return self._robot.reading.gripper_width
        return self._gripper.ideal_width

    def _fingers_loaded(self) -> bool:
        return self._gripper.held is not None

    def _T_world_tool(self) -> Array:
        return self._robot.T_world_tool()

    def _object_poses(self) -> Mapping[str, Array]:
        return self._poses

    def _T_tool_held(self) -> Array | None:
        if self._gripper.held is None:
            return None
        return inverse_pose(self._T_world_tool()) @ self._poses[self._gripper.held]
