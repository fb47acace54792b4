"""Makes the machine of each task step from what the scenario and the robot say."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.mission.cylinder import CylinderPoint
from motm_wbc.mission.grip import grasp_yaws, grip_in_tool
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.pick import PickMachine
from motm_wbc.mission.place import PlaceMachine
from motm_wbc.mission.reachable import grip_height, reach_of_step
from motm_wbc.mission.tool_yaw import YawRange, yaw_range
from motm_wbc.scene.scenario import Scenario

_OPEN = 0.002  # [m] short of its full width at which a gripper counts as open


class MachineFactory:
    """What every step of a task needs to know, found once."""

    def __init__(
        self,
        scenario: Scenario,
        model: RobotModel,
        reach: ReachParameters,
        grasp: GraspParameters,
    ) -> None:
        """Set up.

        Raises:
            InputError: an object does not fit into the gripper.
        """
        self._scenario = scenario
        self._model = model
        self._reach = reach
        self._grasp = grasp
        self._gripper = model.description.gripper
        self._R_tool_grip = grip_in_tool(model.description)
        self._yaws = {
            thing.name: grasp_yaws(thing, self._gripper.max_width) for thing in scenario.objects
        }
        count = len(scenario.task)
        self._reaches = [reach_of_step(model, scenario, index, grasp) for index in range(count)]
        self._yaw_ranges: dict[float, YawRange] = {}

    def reach(self, index: int) -> float:
        """Distance from the arm's base within which a step's target can be worked on [m]."""
        return self._reaches[min(index, len(self._reaches) - 1)]

    def pick(self, index: int) -> PickMachine:
        """The machine of a pick step."""
        thing = self._scenario.object(self._scenario.task[index].object)
        gripper = self._gripper
        way = max(gripper.max_width - thing.narrowest, 0.0)
        return PickMachine(
            thing.name,
            grasp_height=thing.grasp_height,
            yaws=self._yaws[thing.name],
            yaw_range=self._yaw_range(grip_height(self._scenario, index)),
            open_width=gripper.max_width,
            opened_width=gripper.max_width - _OPEN,
            closing_time=max(gripper.min_closing_time, way / gripper.closing_speed),
            grasp=self._grasp,
            reach=self._reach,
        )

    def place(self, index: int, T_tool_held: Array, held_width: float) -> PlaceMachine:
        """The machine of a place step.

        Args:
            index: of the step.
            T_tool_held: (4, 4) the held object in the tool frame.
            held_width: width of the gripper about it [m].
        """
        step = self._scenario.task[index]
        T_grip_tool = np.eye(4)
        T_grip_tool[:3, :3] = self._R_tool_grip.T
        return PlaceMachine(
            step.object,
            self._scenario.T_world_drop(step),
            T_grip_tool @ T_tool_held,
            closed_width=held_width,
            open_width=self._gripper.max_width,
            grasp=self._grasp,
            reach=self._reach,
        )

    def carry_point(self, held: str) -> CylinderPoint:
        """Where the grip carries an object: in front of the arm, above all supports."""
        thing = self._scenario.object(held)
        highest = max(support.top for support in self._scenario.supports)
        below = 0.5 * thing.top + thing.grasp_height
        height = highest + self._grasp.carry_clearance + below
        return CylinderPoint(self._grasp.carry_radius, 0.0, height, 0.0, 0.0, 0.0)

    def _yaw_range(self, height: float) -> YawRange:
        """What the wrist can hold at a grasp's height, found once for each height."""
        if height not in self._yaw_ranges:
            radius = self._model.description.reach.hold_radius
            self._yaw_ranges[height] = yaw_range(self._model, radius, height)
        return self._yaw_ranges[height]
