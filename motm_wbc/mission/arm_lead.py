"""Leading the arm: the stages of each task step, and the tool task that they ask for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event, RobotState, WorldState
from motm_wbc.kinematics import Configuration, RobotModel
from motm_wbc.mission.arrival import Arrival
from motm_wbc.mission.cylinder import arm_base_position, as_cylinder
from motm_wbc.mission.grip import grip_in_tool
from motm_wbc.mission.machines import MachineFactory
from motm_wbc.mission.orientation import top_down, yaw_of
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.pick import PickMachine
from motm_wbc.mission.place import PlaceMachine
from motm_wbc.mission.stages import Moment, Outcome, Stage, ToolOrder
from motm_wbc.mission.tool_reference import ToolMotion, ToolReference
from motm_wbc.mission.tool_yaw import bearing_sweep
from motm_wbc.qp import ToolTask
from motm_wbc.scene.scenario import Scenario, Step

_SLOW = 0.05  # [m/s] below which a base counts as this fast where its speed divides
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
        self._open_width = model.description.gripper.max_width
        self._R_tool_grip = grip_in_tool(model.description)
        self._machines = MachineFactory(scenario, model, reach, grasp)
        self._reference = ToolReference(reach, model.arm_base_xy, dt)
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
        sets_out = isinstance(self._machine, PickMachine) and self._machine.stage is Stage.TRAVEL
        if step is None or (sets_out and self._last_placed is not None):
            return self._last_placed
        return step.object

    @property
    def done(self) -> bool:
        """All steps are done."""
        return self.step is None

    def reach(self, index: int) -> float:
        """Distance from the arm's base within which a step's target can be worked on [m]."""
        return self._machines.reach(index)

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
        outcome = self._update(self._machine, now, pass_poses, target)
        motion = ToolMotion(now.T_world_tool, state.base_pose, base_twist)
        task = self._task(outcome.order, motion, arrival)
        error = self._error(outcome.order, now)
        if isinstance(self._machine, PlaceMachine) and self._machine.released:
            self.held, self.T_tool_held = None, None
        if outcome.stage is Stage.DONE:
            self._finish(configuration, world, state)
        elif outcome.stage is Stage.LOST:
            self._lose()
        return ArmStep(
            task,
            outcome.order.gripper_width,
            outcome.stage,
            outcome.order.T_world_target,
            error,
            outcome.order.may_touch,
            outcome.events,
        )

    def _update(
        self, machine: PickMachine | PlaceMachine, now: Moment, pass_poses: Array, target: Array
    ) -> Outcome:
        if isinstance(machine, PlaceMachine):
            return machine.update(now, self._machines.carry_point(machine.name))
        sweep = np.array([now.target_bearing])
        if len(pass_poses):
            reach = self.reach(self.step_index)
            sweep = bearing_sweep(pass_poses, self._model.arm_base_xy, target, reach)
        return machine.update(now, sweep)

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
            gripper_width=state.gripper_width,
            fingers_loaded=state.fingers_loaded,
            arrival=arrival,
            start_before=self._start_before(T_world_grip[:3, 3], state, target, arrival),
            in_range=math.dist(centre, target) <= self.reach(self.step_index),
            tool_bearing=_bearing(centre, T_world_grip[:2, 3]),
            target_bearing=_bearing(centre, target),
        )

    def _start_before(
        self, tool: Array, state: RobotState, target: Array, arrival: Arrival | None
    ) -> float:
        """Time before the target comes into range at which the reach has to start [s].

        The arm's own time to where the target will be, with some lead; in the literal form
        MotM's d/(k_A v), which starts it seconds earlier.
        """
        p = self._reach
        if arrival is None:
            return p.lead * p.shortest
        still, arm_xy = np.zeros(3), self._model.arm_base_xy
        now = as_cylinder(tool, still, state.base_pose, still, arm_xy)
        there = as_cylinder(np.array([*target, 0.0]), still, arrival.base_pose, still, arm_xy)
        if p.form == "quintic":
            aside = there.bearing - now.bearing
            flat = now.radius**2 + there.radius**2
            away = math.sqrt(flat - 2.0 * now.radius * there.radius * math.cos(aside))
            speed = max(abs(float(state.base_velocity[0])), _SLOW)
            return away / (p.arrival_gain * speed)
        return p.lead * max(
            abs(there.bearing - now.bearing) / p.typical_bearing_rate,
            abs(there.radius - now.radius) / p.typical_speed,
            p.shortest,
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
        return ToolTask(np.concatenate((linear, angular)), weights=weights, R_world_task=R_target)

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
            self._last_placed = step.object
        self.step_index += 1
        self._machine = self._new_machine()

    def _new_machine(self) -> PickMachine | PlaceMachine | None:
        step = self.step
        if step is None:
            return None
        if step.pick is not None:
            return self._machines.pick(self.step_index)
        assert self.T_tool_held is not None
        return self._machines.place(self.step_index, self.T_tool_held, self._held_width)

    def _lose(self) -> None:
        """The load slipped out: back to the step that picks it."""
        self.held, self.T_tool_held = None, None
        self.step_index -= 1
        self._machine = self._new_machine()

    def _step_at(self, index: int) -> Step | None:
        task = self._scenario.task
        return task[index] if index < len(task) else None

    def _resting(self) -> ArmStep:
        self._reference.reset()
        return ArmStep(None, self._open_width, Stage.DONE, None, math.nan, False, ())


def _bearing(centre: Array, point: Array) -> float:
    """Direction from `centre` to `point` in the world [rad]."""
    return math.atan2(point[1] - centre[1], point[0] - centre[0])
