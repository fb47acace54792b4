"""The whole-body velocity controller: tasks and the world in, one command out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import Configuration, RobotModel
from motm_wbc.qp import describe
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.check import usable, what_is_unusable
from motm_wbc.qp.ladder import Answer, Ladder
from motm_wbc.qp.limits import BaseBounds, JointBox, JointLimits
from motm_wbc.qp.nearby import Neighbourhood
from motm_wbc.qp.objective import holistic_objective, led_objective
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem
from motm_wbc.qp.result import WholeBodyResult
from motm_wbc.qp.rows import CollisionRows, RowBuilder
from motm_wbc.qp.solvers import make_solver
from motm_wbc.qp.tasks import BaseTask, HeldObject, PostureTask, ToolTask

_UNSCALED = 1e-3  # a factor this near to a bound counts as being at it
_DEFAULT = WholeBodyParameters()


class WholeBodyController:
    """Whole-body velocity control by one QP a step.

    The variables are the arm's joint velocities and either one factor that scales the base
    inputs of navigation, so that the base stays on its arc, or the base inputs themselves
    (Haviland et al., "A Holistic Approach to Reactive Mobile Manipulation", 2022).

    Args:
        model: the robot.
        dt: control step [s].
        parameters: weights, gains and safety.
        solver: `osqp`, `daqp`, or any other solver that qpsolvers finds installed.

    Raises:
        UnknownName: there is no such solver.
    """

    def __init__(
        self,
        model: RobotModel,
        dt: float,
        parameters: WholeBodyParameters = _DEFAULT,
        solver: str = "osqp",
    ) -> None:
        self.model = model
        self.dt = dt
        self.parameters = parameters
        self.solver = solver
        self._joints = JointLimits.of(model, dt, parameters.recovery_speed)
        self._base = BaseBounds(model.base_limits, model.n_base, dt)
        self.reset()

    def reset(self) -> None:
        """Forget all that was carried over from earlier steps."""
        model, parameters = self.model, self.parameters
        self._neighbourhood = Neighbourhood(model, parameters)
        self._rows = RowBuilder(model, self._neighbourhood, self.dt, parameters)
        k = parameters.collision_rows
        self._led, self._free = (
            Ladder(make_solver(self.solver, n, k, parameters), model.arm_joints, parameters)
            for n in (1 + model.n_arm, model.n_base + model.n_arm)
        )

    def limits_summary(self) -> str:
        """The bounds of every degree of freedom, base included, and of every class of pairs."""
        return describe.limits_summary(self.model, self.dt, self.parameters)

    def step(
        self,
        *,
        base_pose: Array,
        q: Array,
        previous: tuple[Array, Array],
        tool: ToolTask | None,
        base: BaseTask,
        posture: PostureTask | None = None,
        bodies: Sequence[Body] = (),
        target_object: str | None = None,
        held: HeldObject | None = None,
        gripper_width: float | None = None,
    ) -> WholeBodyResult:
        """The command for one control step. Never raises: unusable input makes it brake.

        Args:
            base_pose: (3,) x [m], y [m], heading [rad].
            q: (n_arm,) joint positions [rad or m].
            previous: base inputs and joint velocities that were commanded last.
            tool: what the tool shall do, or None.
            base: what the base shall do.
            posture: where the arm's redundancy shall lead, or None.
            bodies: the solids of the scene; pass the same instances on where nothing moved.
            target_object: name of the body that the fingers may touch.
            held: the object in the gripper, or None.
            gripper_width: distance of the fingers [m]; None: fully open.
        """
        start = time.perf_counter()
        state = base_pose, q, previous
        unusable = what_is_unusable(self.model, state, tool, base, posture, held, gripper_width)
        if unusable:
            return self._brake(unusable, q, previous, start)
        configuration = self.model.configuration(base_pose, q, gripper_width)
        if self._neighbourhood.update(bodies, base_pose, target_object, held):
            self._rows.renumber()
        if not self._neighbourhood.shapes.finite:
            return self._brake("a body has a place that is not finite", q, previous, start)
        case = _Case(
            configuration,
            self._rows.build(configuration, base.reference if base.follow else previous[0]),
            self._joints.box(q, previous[1]),
            previous[0],
            tool,
            posture,
        )
        choice = self._led_by(base.reference, case) if base.follow else self._free_base(case)
        if choice is None:
            return self._brake("no solver found an answer", q, previous, start)
        return self._result(case, choice, start)

    def _led_by(self, reference: Array, case: _Case) -> _Choice | None:
        """Navigation leads: its inputs are scaled by one factor."""
        interval = self._base.scale_interval(reference, case.last_base)
        lead = reference if interval is not None else self._base.braked(case.last_base)
        least, most = interval if interval is not None else (1.0, 1.0)
        H, f = led_objective(case.configuration, lead, case.tool, case.posture, self.parameters)
        n_base = self.model.n_base
        A = np.empty((len(case.rows.bound), len(f)))
        A[:, 0] = case.rows.A[:, :n_base] @ lead
        A[:, 1:] = case.rows.A[:, n_base:]
        problem = _problem(H, f, A, (np.array([least]), np.array([most])), case)
        answer = self._led.solve(problem, lambda slot: self._row_name(case.rows, slot))
        if answer.x is None:
            return None
        scale = float(answer.x[0])
        if scale > most - 10.0 * self.parameters.solver_tolerance:
            scale = most  # not by a solver's rounding off what navigation asked for
        active = []
        if interval is None:
            active.append("base acceleration, brakes on its arc")
        elif scale < 1.0 - _UNSCALED and scale >= most - _UNSCALED:
            active.append("base speed or acceleration")
        command = scale * lead + 0.0  # no negative zeros
        return _Choice(answer, problem, command, 0.0 if interval is None else scale, active)

    def _free_base(self, case: _Case) -> _Choice | None:
        """The base's inputs are variables like the arm's velocities."""
        H, f = holistic_objective(case.configuration, case.tool, case.posture, self.parameters)
        bounds = self._base.box(case.last_base)
        problem = _problem(H, f, case.rows.A, bounds, case)
        answer = self._free.solve(problem, lambda slot: self._row_name(case.rows, slot))
        if answer.x is None:
            return None
        command = answer.x[: self.model.n_base]
        held = np.flatnonzero((command <= bounds[0]) | (command >= bounds[1])).tolist()
        inputs = self.model.base_kind.inputs
        active = [f"base {inputs[index]}" for index in held]
        return _Choice(answer, problem, command + 0.0, 1.0, active)

    def _row_name(self, rows: CollisionRows, slot: int) -> str:
        return self._rows.name((int(rows.first[slot]), int(rows.second[slot])))

    def _result(self, case: _Case, choice: _Choice, start: float) -> WholeBodyResult:
        answer = choice.answer
        assert answer.x is not None
        arm = answer.x[-self.model.n_arm :]
        active = [
            *choice.active,
            *describe.active_joints(arm, case.box, self._joints, self.model.arm_joints),
            *describe.active_rows(
                answer.x, choice.problem, lambda slot: self._row_name(case.rows, slot)
            ),
        ]
        slack = np.zeros(6)
        if case.tool is not None:
            J = case.configuration.J_tool
            n_base = self.model.n_base
            slack = case.tool.twist - J[:, :n_base] @ choice.base - J[:, n_base:] @ arm
        closest = case.rows.closest
        return WholeBodyResult(
            base=choice.base,
            arm=arm.copy(),
            rung=answer.rung,
            reason=answer.reason,
            active=tuple(active),
            scale=choice.scale,
            slack=slack,
            clearance=case.rows.clearance,
            clearance_pair="" if closest is None else self._rows.name(closest),
            solve_time=answer.solve_time,
            step_time=time.perf_counter() - start,
            solver_fallback=answer.solver_fallback,
            configuration=case.configuration,
        )

    def _brake(
        self, reason: str, q: Array, previous: tuple[Array, Array], start: float
    ) -> WholeBodyResult:
        """Everything brakes as its limits allow; what was no number counts as at rest."""
        n_base, n_arm = self.model.n_base, self.model.n_arm
        last_base = np.asarray(previous[0]) if usable(previous[0], n_base) else np.zeros(n_base)
        last_arm = np.asarray(previous[1]) if usable(previous[1], n_arm) else np.zeros(n_arm)
        arm = self._joints.braked(last_arm)
        if usable(q, n_arm):
            box = self._joints.box(np.asarray(q), last_arm)
            arm = np.minimum(np.maximum(arm, box.hard_lower), box.hard_upper)
        return WholeBodyResult(
            base=self._base.braked(last_base) + 0.0,
            arm=arm,
            rung="brake",
            reason=reason,
            active=(),
            scale=0.0,
            slack=np.zeros(6),
            clearance=np.inf,
            clearance_pair="",
            solve_time=0.0,
            step_time=time.perf_counter() - start,
            solver_fallback=False,
            configuration=None,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """What a step starts from."""

    configuration: Configuration
    rows: CollisionRows
    box: JointBox
    last_base: Array
    tool: ToolTask | None
    posture: PostureTask | None


@dataclass(frozen=True, slots=True, eq=False)
class _Choice:
    """What a step comes to."""

    answer: Answer
    problem: QpProblem
    base: Array
    scale: float
    active: list[str]


def _problem(
    H: Array, f: Array, A: Array, base_bounds: tuple[Array, Array], case: _Case
) -> QpProblem:
    """The QP whose variables are the base's, with the given bounds, then the arm's."""
    low, high = base_bounds
    box = case.box
    return QpProblem(
        H=H,
        f=f,
        A=A,
        bound=case.rows.bound,
        lower=np.concatenate((low, box.lower)),
        upper=np.concatenate((high, box.upper)),
        hard_lower=np.concatenate((low, box.hard_lower)),
        hard_upper=np.concatenate((high, box.hard_upper)),
    )
