"""Leading the arm: the stages of each task step, and the tool task that they ask for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event, RobotState, WorldState
from motm_wbc.kinematics import Configuration, RobotModel
from motm_wbc.mission.arrival import Arrival
from motm_wbc.mission.cylinder import CylinderPoint, arm_base_position, as_cylinder
from motm_wbc.mission.grip import grasp_yaws, grip_in_tool
from motm_wbc.mission.orientation import top_down, yaw_of
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.pick import PickMachine
from motm_wbc.mission.place import PlaceMachine
from motm_wbc.mission.reachable import reach_of_step
from motm_wbc.mission.stages import Moment, Stage, ToolOrder
from motm_wbc.mission.tool_reference import ToolMotion, ToolReference
from motm_wbc.mission.tool_yaw import YawRange, bearing_sweep, yaw_range
from motm_wbc.qp import ToolTask
from motm_wbc.scene.scenario import Scenario, Step

_OPENING_SHARE = 0.25  # of the full way: fingers that closed on nothing stand this far off
_MOVED = 0.01  # [m] by which a target has to move for the base to take notice
_FREE = 0.0
_FIXED = 1.0


@dataclass(frozen=True, slots=True)
class ArmStep:
    """What the arm shall do in one control step.

    Attributes:
        task: for the whole-body controller; None: only the posture.
        gripper_width: [m].
        stage: where the step's machine stands.
        T_world_target: (4, 4) grip frame at the grasp or object at the drop, or None.
        tool_error: distance from what is to be at the target to the target [m], or NaN.
        touch_support: the held object may touch its support.
        events: what happened.
    """

    task: ToolTask | None
    gripper_width: float
    stage: Stage
    T_world_target: Array | None
    tool_error: float
    touch_support: bool
    events: tuple[Event, ...]


class ArmLead:
    """Goes through the task's steps and makes the arm's task from each moment."""

    def __init__(
        self,
        scenario: Scenario,
        model: RobotModel,
        reach: ReachParameters,
        grasp: GraspParameters,
        dt: float,
    ) -> None:
        """Set up at the first step.

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
        self._reaches = [reach_of_step(model, scenario, step, grasp) for step in scenario.task]
        self._reference = ToolReference(reach, model.arm_base_xy, dt)
        self._yaw_ranges: dict[float, YawRange] = {}
        self.step_index = 0
        self.held: str | None = None
        self.T_tool_held: Array | None = None
        self._held_width = 0.0
        self._last_placed: str | None = None
        self._steady: dict[int, Array] = {}
        self._machine: PickMachine | PlaceMachine | None = self._new_machine()

    @property
    def step(self) -> Step | None:
        """The task step at work; None when all are done."""
        return self._step_at(self.step_index)

    @property
    def base_step_index(self) -> int:
        """The step that the base works for: a placed object needs it no longer."""
        machine = self._machine
        released = isinstance(machine, PlaceMachine) and machine.released
        return self.step_index + (1 if released else 0)

    @property
    def first_attempt(self) -> float | None:
        """When the present step's first attempt began [s]; None before it."""
        return self._machine.first_attempt if isinstance(self._machine, PickMachine) else None

    @property
    def attempts_fail(self) -> bool:
        """An attempt of the present step has failed."""
        return isinstance(self._machine, PickMachine) and self._machine.failed

    @property
    def touchable(self) -> str | None:
        """The object that the fingers may touch: the one at hand.

        That is the one just placed until the hand sets out for another.
        """
        step = self.step
        if step is None or (
            self._last_placed is not None
            and self._machine is not None
            and self._machine.stage is Stage.TRAVEL
        ):
            return self._last_placed
        return step.object

    @property
    def done(self) -> bool:
        """All steps are done."""
        return self.step is None

    def reach(self, index: int) -> float:
        """Distance from the arm's base within which a step's target can be worked on [m]."""
        return self._reaches[min(index, len(self._reaches) - 1)]

    def target_xy(self, index: int, world: WorldState) -> Array | None:
        """(2,) where a step acts [m]; None beyond the last."""
        step = self._step_at(index)
        if step is None:
            return None
        if step.at is not None:
            return np.array(step.at)
        return np.asarray(world.objects[step.object][:2, 3])

    def steady_target_xy(self, index: int, world: WorldState) -> Array | None:
        """`target_xy` for the base: it stays until the target has moved by a centimetre.

        What navigation knows of a target is found once and kept; noise must not undo that.
        """
        target = self.target_xy(index, world)
        if target is None:
            return None
        kept = self._steady.get(index)
        if kept is None or math.dist(kept, target) > _MOVED:
            self._steady[index] = target.copy()
        return self._steady[index]

    def lead(
        self,
        state: RobotState,
        world: WorldState,
        configuration: Configuration,
        base_twist: Array,
        pass_poses: Array,
        arrival: Arrival | None,
    ) -> ArmStep:
        """Advance the present step's machine and make the arm's task.

        Args:
            state: of the robot.
            world: as sensed.
            configuration: of the robot at `state`.
            base_twist: (3,) v_x, v_y, omega that the base is about to be commanded.
            pass_poses: (m, 3) poses of the pass that the base foresees.
            arrival: when the present step's target comes into range.
        """
        if self._machine is None:
            return self._resting()
        now = self._moment(state, world, configuration, arrival)
        target = self.target_xy(self.step_index, world)
        assert target is not None
        sweep = (
            bearing_sweep(pass_poses, self._model.arm_base_xy, target, self.reach(self.step_index))
            if len(pass_poses)
            else np.zeros(1)
        )
        outcome = self._machine.update(now, sweep, self._carry_point())
        motion = ToolMotion(now.T_world_tool, state.base_pose, base_twist)
        task = self._task(outcome.order, motion, arrival)
        error = self._error(outcome.order, now)
        if outcome.stage is Stage.DONE:
            self._finish(configuration, world, state)
        return ArmStep(
            task,
            outcome.order.gripper_width,
            outcome.stage,
            outcome.order.T_world_target,
            error,
            outcome.order.may_touch,
            outcome.events,
        )

    def _moment(
        self,
        state: RobotState,
        world: WorldState,
        configuration: Configuration,
        arrival: Arrival | None,
    ) -> Moment:
        step = self.step
        assert step is not None
        target = self.target_xy(self.step_index, world)
        assert target is not None
        T_world_grip = configuration.T_world_tool.copy()
        T_world_grip[:3, :3] = T_world_grip[:3, :3] @ self._R_tool_grip
        inputs = np.concatenate((state.base_velocity, state.v))
        centre = arm_base_position(state.base_pose, self._model.arm_base_xy)
        return Moment(
            time=state.time,
            T_world_tool=T_world_grip,
            tool_velocity=configuration.J_tool[:3] @ inputs,
            T_world_object=world.objects[step.object],
            base_pose=state.base_pose,
            gripper_width=state.gripper_width,
            fingers_loaded=state.fingers_loaded,
            arrival=arrival,
            reach_time=self._reach_time(T_world_grip[:3, 3], state.base_pose, target, arrival),
            in_range=math.dist(centre, target) <= self.reach(self.step_index),
            tool_bearing=_bearing(centre, T_world_grip[:2, 3]),
            target_bearing=_bearing(centre, target),
        )

    def _reach_time(
        self, tool: Array, base_pose: Array, target: Array, arrival: Arrival | None
    ) -> float:
        """Estimated duration of the reach to where the target will come into range [s]."""
        if arrival is None:
            return self._reach.shortest
        still, arm_xy = np.zeros(3), self._model.arm_base_xy
        now = as_cylinder(tool, still, base_pose, still, arm_xy)
        there = as_cylinder(np.array([*target, 0.0]), still, arrival.base_pose, still, arm_xy)
        return max(
            abs(there.bearing - now.bearing) / self._reach.typical_bearing_rate,
            abs(there.radius - now.radius) / self._reach.typical_speed,
            self._reach.shortest,
        )

    def _task(self, order: ToolOrder, tool: ToolMotion, arrival: Arrival | None) -> ToolTask | None:
        """The order as a twist with a weight for each axis of the grip frame."""
        if order.point is None and order.cylinder is None:
            self._reference.reset()
            return None
        if order.point is not None:
            still = np.zeros(3)
            linear = self._reference.toward_point(
                order.point, still, tool, order.climb, self.reach(self.step_index), arrival
            )
        else:
            assert order.cylinder is not None
            linear = self._reference.toward_cylinder(order.cylinder, tool)
        R_now = tool.T_world_tool[:3, :3]
        free = order.yaw is None
        R_target = top_down(yaw_of(R_now) if order.yaw is None else order.yaw)
        angular = self._reference.turning(R_target, R_now)
        weights = np.array([_FIXED] * 5 + [_FREE if free else _FIXED])
        return ToolTask(np.concatenate((linear, angular)), weights, R_target)

    def _error(self, order: ToolOrder, now: Moment) -> float:
        """Distance from the grip, or from the held object, to where it shall be [m]."""
        if order.T_world_target is None:
            return math.nan
        holds = isinstance(self._machine, PlaceMachine)
        at = now.T_world_object[:3, 3] if holds else now.tool_position
        return float(np.linalg.norm(at - order.T_world_target[:3, 3]))

    def _finish(self, configuration: Configuration, world: WorldState, state: RobotState) -> None:
        """Go on to the next step; after a pick, remember how the object lies in the hand."""
        step = self.step
        assert step is not None
        if step.pick is not None:
            self.held = step.pick
            T_tool_world = np.linalg.inv(configuration.T_world_tool)
            self.T_tool_held = T_tool_world @ world.objects[step.pick]
            self._held_width = state.gripper_width
        else:
            self.held, self.T_tool_held = None, None
            self._last_placed = step.object
        self.step_index += 1
        self._machine = self._new_machine()

    def _new_machine(self) -> PickMachine | PlaceMachine | None:
        step = self.step
        if step is None:
            return None
        return self._pick(step.pick) if step.pick is not None else self._place(step)

    def _pick(self, name: str) -> PickMachine:
        thing = self._scenario.object(name)
        height = self._scenario.T_world_object(name)[2, 3] + thing.grasp_height
        gripper = self._gripper
        return PickMachine(
            name,
            grasp_height=thing.grasp_height,
            yaws=self._yaws[name],
            yaw_range=self._yaw_range(float(height)),
            open_width=gripper.max_width,
            closing_time=gripper.min_closing_time,
            opening_time=_OPENING_SHARE * gripper.max_width / gripper.opening_speed,
            grasp=self._grasp,
            reach=self._reach,
        )

    def _place(self, step: Step) -> PlaceMachine:
        assert self.T_tool_held is not None
        T_grip_tool = np.eye(4)
        T_grip_tool[:3, :3] = self._R_tool_grip.T
        return PlaceMachine(
            step.object,
            self._scenario.T_world_drop(step),
            T_grip_tool @ self.T_tool_held,
            closed_width=self._held_width,
            open_width=self._gripper.max_width,
            grasp=self._grasp,
            reach=self._reach,
        )

    def _yaw_range(self, height: float) -> YawRange:
        """What the wrist can hold at a grasp's height, found once for each height."""
        if height not in self._yaw_ranges:
            radius = self._model.description.reach.hold_radius
            self._yaw_ranges[height] = yaw_range(self._model, radius, height)
        return self._yaw_ranges[height]

    def _carry_point(self) -> CylinderPoint:
        """Where the grip carries an object: in front of the arm, above all supports."""
        highest = max(support.top for support in self._scenario.supports)
        below = 0.0 if self.T_tool_held is None else self._object_below_grip()
        height = highest + self._grasp.carry_clearance + below
        return CylinderPoint(self._grasp.carry_radius, 0.0, height, 0.0, 0.0, 0.0)

    def _object_below_grip(self) -> float:
        """How far the held object reaches below the grip [m]."""
        assert self.held is not None and self.T_tool_held is not None
        thing = self._scenario.object(self.held)
        return max(0.0, 0.5 * thing.top + thing.grasp_height)

    def _step_at(self, index: int) -> Step | None:
        task = self._scenario.task
        return task[index] if index < len(task) else None

    def _resting(self) -> ArmStep:
        self._reference.reset()
        return ArmStep(None, self._gripper.max_width, Stage.DONE, None, math.nan, False, ())


def _bearing(centre: Array, point: Array) -> float:
    """Direction from `centre` to `point` in the world [rad]."""
    return math.atan2(point[1] - centre[1], point[0] - centre[0])
