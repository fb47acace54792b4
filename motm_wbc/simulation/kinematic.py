"""The kinematic plant: commands are carried out exactly; objects are held, fall, are pushed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.interfaces import Command
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.rotations import inverse_pose
from motm_wbc.simulation.fingers import FingerShapes, push_out
from motm_wbc.simulation.loose import Ground, LooseBody
from motm_wbc.simulation.plant import PlantSetup, SimulatedPlant


class KinematicPlant(SimulatedPlant):
    """Velocities are reached at once and integrated exactly; nothing is clipped.

    Commands beyond the limits are carried out as they are: whoever judges the run sees them.
    An unheld object is pushed in the plane by fingers that would overlap it; it doesn't tilt.

    Args:
        setup: what it is made from.
    """

    def __init__(self, setup: PlantSetup) -> None:
        super().__init__(setup)
        scenario, model, parameters = setup.scenario, setup.model, setup.parameters
        self._pose = scenario.start_pose
        self._inputs: Array = np.zeros(model.n_base)
        self._q = np.array(model.home)
        self._v = np.zeros(model.n_arm)
        self._ground = Ground(scenario)
        self._fingers = FingerShapes(model)
        self._bodies = {
            thing.name: LooseBody(
                self._shapes[thing.name],
                thing.friction * parameters.contact_friction,
                scenario.T_world_object(thing.name),
            )
            for thing in scenario.objects
        }
        self._T_held: Array | None = None
        self._at_tool = self._configuration()
        self._tool_velocity = np.zeros(3)
        self._sample_sensors()

    def close(self) -> None:
        """Nothing is held."""

    def _advance(self, command: Command) -> None:
        before = self._at_tool.T_world_tool[:3, 3]
        self._move_robot(command)
        self._at_tool = self._configuration()
        self._tool_velocity = (self._at_tool.T_world_tool[:3, 3] - before) / self._dt
        for name, body in self._bodies.items():
            if name == self._gripper.held:
                assert self._T_held is not None
                body.pose = self._at_tool.T_world_tool @ self._T_held
            else:
                body.advance(self._ground, self._parameters.gravity, self._dt)
                self._meet_fingers(name, body)

    def _move_robot(self, command: Command) -> None:
        self._inputs = np.array(command.base, dtype=float)
        self._v = np.array(command.arm, dtype=float)
        vx, omega = self._inputs[0], self._inputs[-1]
        vy = self._inputs[1] if self.model.base_kind is BaseKind.OMNIDIRECTIONAL else 0.0
        self._pose = se2.integrate_twist(self._pose, vx, vy, omega, self._dt)
        self._q = self._q + self._v * self._dt

    def _configuration(self) -> Configuration:
        return self.model.configuration(self._pose, self._q, self._gripper_width())

    def _meet_fingers(self, name: str, body: LooseBody) -> None:
        """Hold the object if both fingers touch it, else push it out of them."""
        T_world_tool = self._at_tool.T_world_tool
        near = body.shape.radius + self._fingers.reach
        if float(np.linalg.norm(body.pose[:3, 3] - T_world_tool[:3, 3])) > near:
            return
        axis = T_world_tool[:3, :3] @ self._closing_axis
        width = body.shape.width(body.pose, axis)
        reference = self._gripper.fingers.reference
        if reference <= width and self._gripper.may_hold(name, T_world_tool, body.pose):
            self._grip(name, body, axis, width)
        else:
            self._push(name, body)

    def _grip(self, name: str, body: LooseBody, axis: Array, width: float) -> None:
        """The fingers have centred the object between them."""
        T_world_tool = self._at_tool.T_world_tool
        offset = float((T_world_tool[:3, 3] - body.shape.grasp_point(body.pose)) @ axis)
        body.pose = body.pose.copy()
        body.pose[:3, 3] += offset * axis
        body.moving = False
        self._T_held = inverse_pose(T_world_tool) @ body.pose
        self._take(name, width)

    def _push(self, name: str, body: LooseBody) -> None:
        moved = 0.0
        R_world_tool = self._at_tool.T_world_tool[:3, :3]
        lower, upper = body.shape.bounds(body.pose)
        for corners in self._fingers.near(self._at_tool, lower, upper):
            offset = push_out(corners, body.shape, body.pose, R_world_tool)
            if np.any(offset):
                body.push(offset)
                moved += float(np.linalg.norm(offset))
        if moved > 0.0:
            self._pushed(name, moved)

    def _let_go(self, name: str) -> None:
        self._T_held = None
        body = self._bodies[name]
        body.throw(body.pose, self._tool_velocity)

    def _base_pose(self) -> Array:
        return self._pose

    def _base_velocity(self) -> Array:
        return self._inputs

    def _arm_position(self) -> Array:
        return self._q

    def _arm_velocity(self) -> Array:
        return self._v

    def _gripper_width(self) -> float:
        return self._gripper.ideal_width

    def _fingers_loaded(self) -> bool:
        return self._gripper.held is not None

    def _T_world_tool(self) -> Array:
        return self._at_tool.T_world_tool

    def _object_poses(self) -> Mapping[str, Array]:
        return {name: body.pose for name, body in self._bodies.items()}

    def _T_tool_held(self) -> Array | None:
        return self._T_held
