"""The whole-body velocity controller: tasks and the world in, one command out."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.geometry.views import AddressTable
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp import describe
from motm_wbc.qp.answer import read_answer
from motm_wbc.qp.arrays import PROTOTYPE, ProblemArrays, StepArrays, Weights
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.check import State, Tasks, usable, what_is_unusable
from motm_wbc.qp.inputs import InputArrays
from motm_wbc.qp.ladder import Ladder
from motm_wbc.qp.limits import BaseBounds, JointLimits
from motm_wbc.qp.nearby import Neighbourhood
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem
from motm_wbc.qp.result import WholeBodyResult
from motm_wbc.qp.rows import RowArrays, empty_rows
from motm_wbc.qp.selection import empty_selection
from motm_wbc.qp.solvers import QpSolver, make_solver
from motm_wbc.qp.step import PASSES_ACCELERATION, UNUSABLE, write_problem
from motm_wbc.qp.tasks import (
    BaseTask,
    FreeBase,
    HeldObject,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
)

_DEFAULT = WholeBodyParameters()
_TABLE = AddressTable(PROTOTYPE)
_SNAP = 1e-9  # a factor of navigation's inputs that is nearer than this to its bound is put there


class WholeBodyController:
    """Whole-body velocity control by one QP a step.

    The variables are the arm's joint velocities and either one factor that scales the base
    inputs of navigation, so that the base stays on its arc, or the base inputs themselves
    (Haviland et al., "A Holistic Approach to Reactive Mobile Manipulation", 2022).

    One controller serves one robot and one thread; a copy, or one that was pickled, starts anew.

    Args:
        model: the robot.
        dt: control step [s].
        parameters: weights, gains and safety.
        solver: `osqp`, `daqp`, any other solver that qpsolvers finds installed, or an object
            with the protocol `QpSolver`.

    Raises:
        UnknownName: there is no such solver.
        InputError: the control step is not a positive number.
    """

    def __init__(
        self,
        model: RobotModel,
        dt: float,
        parameters: WholeBodyParameters = _DEFAULT,
        solver: str | QpSolver = "osqp",
    ) -> None:
        if not 0.0 < dt < math.inf:
            raise InputError(f"the control step is {dt} s, must be a positive number")
        self._model, self._dt = model, dt
        self._parameters, self._solver = parameters, solver
        self._joints = JointLimits.of(model, dt, parameters.recovery_speed)
        self._base = BaseBounds(model.base_limits, model.n_base, dt)
        self._names = describe.input_names(model)
        self._differential = model.base_kind is BaseKind.DIFFERENTIAL
        count = len(self._names)
        self._sizes = count + 6, count + 2 + 3 * parameters.collision_rows
        self.reset()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies share no memory: their kernels would work on each other's arrays."""
        return type(self), (self._model, self._dt, self._parameters, self._solver)

    @property
    def model(self) -> RobotModel:
        """The robot."""
        return self._model

    @property
    def dt(self) -> float:
        """Control step [s]."""
        return self._dt

    @property
    def parameters(self) -> WholeBodyParameters:
        """Weights, gains and safety."""
        return self._parameters

    @property
    def solver(self) -> str | QpSolver:
        """The solver that is asked first."""
        return self._solver

    def warm_up(self) -> None:
        """Compile, or load, all that a step may need; to be called before a control loop starts.

        The first time on a machine that takes about half a minute, later a tenth of a second.
        """
        model = self._model
        last = np.zeros(model.n_base), np.zeros(model.n_arm)
        for base in (NavigatedBase(last[0]), FreeBase()):
            self.step(base_pose=np.zeros(3), q=model.home, previous=last, base=base)
            self._last.ladder.warm_up(self._last.problem)
        self._brake("", model.home, last, time.perf_counter())
        self.reset()

    def reset(self) -> None:
        """Forget all that was carried over from earlier steps. Not while a step runs."""
        self._lock = threading.Lock()
        model, parameters = self.model, self.parameters
        self._neighbourhood = Neighbourhood(model, parameters)
        self._inputs = InputArrays(model)
        self._led = _Mode(self, True, 1 + model.n_arm)
        self._free = _Mode(self, False, model.n_base + model.n_arm)
        self._last = self._led
        self._step = self._bundled()

    @property
    def problem(self) -> QpProblem:
        """The quadratic program of the last step; the next step overwrites it."""
        return self._last.problem

    def limits_summary(self) -> str:
        """The bounds of every degree of freedom, base included, and of every class of pairs."""
        return describe.limits_summary(self.model, self.dt, self.parameters)

    def step(
        self,
        *,
        base_pose: Array,
        q: Array,
        previous: tuple[Array, Array],
        base: BaseTask,
        tools: Sequence[ToolTask] = (),
        posture: PostureTask | None = None,
        extra: Sequence[LinearTask] = (),
        locked: Sequence[str] = (),
        bodies: Sequence[Body] = (),
        target_object: str | None = None,
        held: HeldObject | None = None,
        gripper_width: float | None = None,
        age: float = 0.0,
    ) -> WholeBodyResult:
        """The command for one control step. Never raises: unusable input makes it brake.

        Args:
            base_pose: (3,) x [m], y [m], heading [rad].
            q: (n_arm,) joint positions [rad or m].
            previous: base inputs and joint velocities that were commanded last.
            base: what the base shall do.
            tools: what frames of the robot shall do.
            posture: where the arm's redundancy shall lead, or None.
            extra: tasks of one's own.
            locked: names of joints and base inputs that shall stand still.
            bodies: the solids of the scene; pass the same instances on where nothing moved.
            target_object: name of the body that the fingers may touch.
            held: the object in the gripper, or None.
            gripper_width: distance of the fingers [m]; None: fully open.
            age: of the state that `base_pose` and `q` tell [s].
        """
        start = time.perf_counter()
        if not self._lock.acquire(blocking=False):
            return self._brake("another thread is in this controller", q, previous, start)
        try:
            trouble = self._late(age) or self._take(
                (base_pose, q, previous),
                (base, tools, posture, extra),
                locked,
                (bodies, target_object, held),
                gripper_width,
            )
            if trouble:
                return self._brake(trouble, q, previous, start)
            mode = self._free if isinstance(base, FreeBase) else self._led
            self._last = mode
            verdict = write_problem(mode.table, mode.led, self._differential)
            if verdict & UNUSABLE:
                state, tasks = (base_pose, q, previous), (base, tools, posture, extra)
                trouble = what_is_unusable(self.model, state, tasks, held, gripper_width)
                return self._brake(trouble or "a task's numbers are too large", q, previous, start)
            answer = mode.ladder.solve(mode.problem, self._row_name)
            if answer.x is None:
                return self._brake(answer.reason, q, previous, start)
            command, report = np.empty(self._sizes[0]), np.empty(self._sizes[1], np.int64)
            scale = read_answer(mode.table, mode.led, verdict, _SNAP, answer.x, command, report)
            n_base, n_inputs = self.model.n_base, len(self._names)
            rung, passed = answer.rung, ""
            if verdict & PASSES_ACCELERATION:
                rung = "no_acceleration" if rung == "full" else rung
                passed = describe.passed_accelerations(
                    self._step.state, mode.problem, self.model.arm_joints
                )
            return WholeBodyResult(
                command[:n_base],
                command[n_base:n_inputs],
                rung,
                scale,
                command[n_inputs:],
                float(self._step.selection.clearance[0]),
                answer.solve_time,
                time.perf_counter() - start,
                answer.solver_fallback,
                passed,
                answer,
                describe.Situation(report, self._names, self._pair_names),
            )
        finally:
            self._lock.release()

    def _late(self, age: float) -> str:
        """Why a sample of that age [s] is not used; empty if it is."""
        limit = self.parameters.largest_age
        try:
            if float(age) <= limit:
                return ""
        except (TypeError, ValueError):
            pass
        return f"the state is {age} s old, at most {limit:g} s is legal"

    def _take(
        self,
        state: State,
        tasks: Tasks,
        locked: Sequence[str],
        world: tuple[Sequence[Body], str | None, HeldObject | None],
        gripper_width: float | None,
    ) -> str:
        """Take over a step's input. Returns why that can't be, empty if it can."""
        try:
            self._neighbourhood.update(*world)
            self._inputs.take(state, tasks, locked, gripper_width)
            self._bundle()
        except Exception as error:
            trouble = what_is_unusable(self.model, state, tasks, world[2], gripper_width)
            return trouble or f"{type(error).__name__}: {error}"
        if self._neighbourhood.finite:
            return ""
        trouble = what_is_unusable(self.model, state, tasks, world[2], gripper_width)
        return trouble or "a body has a place that is not finite"

    def _row_name(self, slot: int) -> str:
        first, second, _ = self._step.rows.slots[slot].tolist()
        return self._pair_names.of(first, second)

    def _bundle(self) -> None:
        """Put together what the compiled step works on, if any of it was replaced."""
        near, inputs, now = self._neighbourhood, self._inputs, self._step
        if now.pairs is not near.pairs:  # pairs have other numbers: the rows start anew
            self._step = self._bundled()
        elif now.tools is not inputs.tools or now.state is not inputs.state:
            self._step = self._bundled(now.rows)

    def _bundled(self, rows: RowArrays | None = None) -> StepArrays:
        near, inputs, count = self._neighbourhood, self._inputs, self.parameters.collision_rows
        self._pair_names = near.names()
        step = StepArrays(
            self._led.weights,
            self._led.arrays,
            self.model.chain,
            near.segments.arrays,
            near.shapes.arrays,
            near.pairs,
            near.near,
            empty_selection(near.pairs, near.near, count),
            rows or empty_rows(near.pairs, len(self._names), count),
            inputs.tools,
            inputs.posture,
            self._joints.arrays,
            self._base.arrays,
            inputs.state,
        )
        for mode in (self._led, self._free):
            tree = step._replace(weights=mode.weights, problem=mode.arrays)
            mode.table, mode.tree = _TABLE.write(tree), tree
        return step

    def _brake(
        self, reason: str, q: Array, previous: tuple[Array, Array], start: float
    ) -> WholeBodyResult:
        """Everything brakes as its limits allow; what was no number counts as at rest."""
        n_base, n_arm = self.model.n_base, self.model.n_arm
        last_base, last_arm = np.zeros(n_base), np.zeros(n_arm)
        try:
            base, joints = previous
        except Exception:  # whatever it is: there is a command in every case
            base, joints = last_base, last_arm
        if usable(base, n_base):
            last_base = np.array(base, dtype=float)
        if usable(joints, n_arm):
            last_arm = np.array(joints, dtype=float)
        arm = self._joints.braked(last_arm)
        if usable(q, n_arm):
            box = self._joints.box(np.array(q, dtype=float), last_arm)
            arm = np.minimum(np.maximum(arm, box.hard_lower), box.hard_upper)
        return WholeBodyResult(
            base=self._base.braked(last_base) + 0.0,
            arm=arm,
            rung="brake",
            scale=0.0,
            slack=np.zeros(6),
            clearance=np.inf,
            solve_time=0.0,
            step_time=time.perf_counter() - start,
            solver_fallback=False,
            _passed=reason,
        )


class _Mode:
    """Problem, weights and solver of one way to move the base."""

    def __init__(self, controller: WholeBodyController, led: bool, n: int) -> None:
        p, rows = controller.parameters, controller.parameters.collision_rows
        self.led = led
        self.problem = QpProblem.empty(n, rows)
        self.arrays = ProblemArrays(
            *(getattr(self.problem, name) for name in ProblemArrays._fields)
        )
        self.weights = np.array(_weights(p, led, controller.dt))
        self.table = np.empty(0, dtype=np.int64)
        self.tree: StepArrays | None = None  # keeps alive what the table has the addresses of
        model = controller.model
        names = describe.input_names(model)
        variables = ("base", *model.arm_joints) if led else names
        solver = make_solver(controller.solver, n, rows, p)
        name = controller.solver if isinstance(controller.solver, str) else type(solver).__name__
        self.ladder = Ladder(solver, name, variables, model.n_arm, rows, p)


def _weights(p: WholeBodyParameters, led: bool, dt: float) -> Weights:
    holistic = p.holistic
    slack = holistic.slack_weight
    return Weights(
        linear=p.linear_weight if led else slack,
        angular=p.angular_weight if led else slack,
        damping=p.damping if led else holistic.arm_weight,
        manipulability=p.manipulability_weight if led else holistic.manipulability_weight,
        base=0.0 if led else holistic.base_weight,
        yaw=0.0 if led else holistic.yaw_weight,
        servo_gain=holistic.servo_gain,
        least_error=holistic.least_error,
        largest_error=holistic.largest_error,
        scale=p.scale_weight,
        posture=p.posture_weight,
        posture_gain=p.posture_gain,
        posture_speed=p.posture_speed,
        preferred_bound=p.preferred_bound_weight,
        preferred_bound_margin=p.preferred_bound_margin,
        pose_speed=p.pose_speed,
        pose_turn_speed=p.pose_turn_speed,
        retreat_speed=p.retreat_speed,
        held_rows=float(p.held_rows),
        dt=dt,
    )
