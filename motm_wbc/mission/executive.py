"""One control step of the whole: sense, lead the base, lead the arm, solve, command."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind, stopping_time
from motm_wbc.interfaces import Command, Event, RobotState, StepReport, WorldState
from motm_wbc.kinematics import RobotModel
from motm_wbc.mission.arm_lead import ArmLead, ArmStep
from motm_wbc.mission.base_lead import BaseLead, BaseStep
from motm_wbc.mission.bodies import SceneBodies
from motm_wbc.mission.methods import BaseMoment, Method
from motm_wbc.mission.parameters import GraspParameters, MissionParameters, ReachParameters
from motm_wbc.mission.patience import expected_wait
from motm_wbc.mission.stages import Stage
from motm_wbc.qp import (
    NavigatedBase,
    PostureTask,
    WholeBodyController,
    WholeBodyParameters,
    WholeBodyResult,
)
from motm_wbc.scene.scenario import Scenario


@dataclass(frozen=True, slots=True)
class ExecutiveParameters:
    """What the executive and its parts are set by."""

    mission: MissionParameters
    reach: ReachParameters
    grasp: GraspParameters
    whole_body: WholeBodyParameters
    solver: str


class Executive:
    """Does a scenario's task with a robot: state in, command out, once a control step.

    It never throws: where a part fails, the answer is a safe command and an event.
    """

    def __init__(
        self,
        scenario: Scenario,
        model: RobotModel,
        method: Method,
        parameters: ExecutiveParameters,
        dt: float,
    ) -> None:
        """Set up at the first step.

        Args:
            scenario: the task and what is known of the world.
            model: the robot.
            method: leads the base.
            parameters: of all parts.
            dt: control step [s].

        Raises:
            InputError: the robot can't do the task, or the solver is unknown.
        """
        self._model = model
        self._controller = WholeBodyController(
            model, dt, parameters.whole_body, solver=parameters.solver
        )
        self._controller.warm_up()
        self._arm = ArmLead(scenario, model, parameters.reach, parameters.grasp, dt)
        self._base = BaseLead(
            method,
            model.base_limits,
            parameters.mission.base_rate_divider,
            dt,
            model.arm_base_xy,
        )
        self._bodies = SceneBodies(scenario)
        self._posture = _posture(model)
        self._home = PostureTask(model.home, np.ones(model.n_arm))
        self._attempt_time = parameters.grasp.typical_time
        self._base_command = np.zeros(model.n_base)
        self._arm_command = np.zeros(model.n_arm)
        self._gripper_width = model.description.gripper.max_width
        self._seen = {thing.name: scenario.T_world_object(thing.name) for thing in scenario.objects}
        self._dt = dt
        self._stage = Stage.TRAVEL.value
        self._rung = "full"

    @property
    def done(self) -> bool:
        """The task is done, the hand has retreated."""
        return self._arm.done

    @property
    def steps_done(self) -> int:
        """Number of task steps that are done."""
        return self._arm.step_index

    @property
    def stage(self) -> str:
        """What the arm is at."""
        return self._stage

    @property
    def goal_switches(self) -> int:
        """How often the base's goal has changed so far."""
        return self._base.goal_switches

    def step(self, state: RobotState, world: WorldState) -> StepReport:
        """Decide the next command.

        Args:
            state: the robot's own sensors.
            world: what is seen of the world, of the same instant.
        """
        try:
            return self._step(state, self._with_unseen(world))
        except Exception as error:
            return self._stop(state, f"{type(error).__name__}: {error}")

    def _step(self, state: RobotState, world: WorldState) -> StepReport:
        base = self._base.step(self._base_moment(state, world))
        started = time.perf_counter()
        reference = self._inputs(base.reference)
        configuration = self._model.configuration(state.base_pose, state.q, state.gripper_width)
        target = self._arm.target_xy(self._arm.step_index, world)
        reach = self._arm.reach(self._arm.step_index)
        arm = self._arm.lead(
            state,
            world,
            configuration,
            self._twist(reference),
            self._base.pass_poses,
            None if target is None else self._base.arrival(target, reach),
        )
        result = self._solve(state, world, reference, arm)
        return self._report(state, base, reference, arm, result, started)

    def _with_unseen(self, world: WorldState) -> WorldState:
        """The world with the objects that are not seen now where they were seen last."""
        self._seen.update(world.objects)
        return replace(world, objects=dict(self._seen))

    def _stop(self, state: RobotState, why: str) -> StepReport:
        """A safe answer to what should not happen: brake on the arc, keep the grip."""
        started = time.perf_counter()
        v, omega = float(self._base_command[0]), float(self._base_command[-1])
        steps = max(stopping_time(v, omega, self._model.base_limits) / self._dt, 1.0)
        reference = self._base_command * (1.0 - 1.0 / steps)
        result = self._controller.step(
            base_pose=state.base_pose,
            q=state.q,
            previous=(self._base_command, self._arm_command),
            base=NavigatedBase(reference),
            gripper_width=state.gripper_width,
        )
        event = Event(state.time, "fault", why, "error")
        arm = ArmStep(None, self._gripper_width, Stage.TRAVEL, None, math.nan, False, (event,))
        base = BaseStep(reference, None, ())
        return self._report(state, base, reference, arm, result, started)

    def _solve(
        self, state: RobotState, world: WorldState, reference: Array, arm: ArmStep
    ) -> WholeBodyResult:
        return self._controller.step(
            base_pose=state.base_pose,
            q=state.q,
            previous=(self._base_command, self._arm_command),
            tools=() if arm.task is None else (arm.task,),
            base=NavigatedBase(reference),
            posture=self._posture if arm.task is not None else self._home,
            bodies=self._bodies.at(world, self._arm.held),
            target_object=self._arm.touchable,
            held=self._bodies.held(self._arm.held, self._arm.T_tool_held, arm.touch_support),
            gripper_width=state.gripper_width,
        )

    def _base_moment(self, state: RobotState, world: WorldState) -> BaseMoment:
        v, omega = float(self._base_command[0]), float(self._base_command[-1])
        index = self._arm.base_step_index
        return BaseMoment(
            time=state.time,
            pose=state.base_pose,
            v=v,
            omega=omega,
            step_index=index,
            target=self._arm.steady_target_xy(index, world),
            next_target=self._arm.steady_target_xy(index + 1, world),
            wait=self._wait(state, world, index),
            attempts_fail=self._arm.attempts_fail,
        )

    def _wait(self, state: RobotState, world: WorldState, index: int) -> float:
        """Expected time until the base is needed no longer for step `index` [s]."""
        target = self._arm.target_xy(index, world)
        if target is None:
            return 0.0
        reach = self._arm.reach(index)
        arrival = self._base.arrival(target, reach)
        until = self._base.horizon if arrival is None else arrival.time
        return expected_wait(state.time, self._arm.first_attempt, until, self._attempt_time)

    def _inputs(self, reference: Array) -> Array:
        """(n_base,) base inputs of (v, omega): an omnidirectional base drives along its heading."""
        if self._model.base_kind is BaseKind.DIFFERENTIAL:
            return reference
        return np.array([reference[0], 0.0, reference[1]])

    def _twist(self, inputs: Array) -> Array:
        """(3,) v_x, v_y, omega of base inputs."""
        if self._model.base_kind is BaseKind.DIFFERENTIAL:
            return np.array([inputs[0], 0.0, inputs[1]])
        return inputs

    def _report(
        self,
        state: RobotState,
        base: BaseStep,
        reference: Array,
        arm: ArmStep,
        result: WholeBodyResult,
        started: float,
    ) -> StepReport:
        events = [*base.events, *arm.events]
        self._base_command, self._arm_command = result.base, result.arm
        self._gripper_width, self._stage = arm.gripper_width, arm.stage.value
        if result.rung != self._rung:
            level = "info" if result.rung == "full" else "warn"
            text = f"controller answers on rung {result.rung}: {result.reason or 'recovered'}"
            events.append(Event(state.time, "fallback", text, level))
            self._rung = result.rung
        return StepReport(
            time=state.time,
            command=Command(result.base, result.arm, arm.gripper_width),
            base_reference=reference,
            T_world_target=arm.T_world_target,
            tool_error=arm.tool_error,
            stage=arm.stage.value,
            rung=result.rung,
            active=result.active,
            step_index=self._arm.step_index,
            compute_time=time.perf_counter() - started,
            events=tuple(events),
            base=base.report,
        )


def _posture(model: RobotModel) -> PostureTask:
    """What the robot's file wants its redundancy to be used for."""
    wanted = model.posture
    return PostureTask(wanted.value, wanted.weight, wanted.lower, wanted.upper)
