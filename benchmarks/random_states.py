"""Random states through the whole-body controller: is every one answered as it should be?

Joints near and beyond their limits, at full speed and locked, bodies near and in contact, limits
that contradict each other. Whether a state is feasible is decided by a linear program (HiGHS) on
the numbers of the step's QP, apart from all that the controller does with them.

    python -m benchmarks.random_states [--states 20000] [--solver osqp --solver daqp] [--seed 0]
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from scipy.optimize import linprog

from motm_wbc import load_robot
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import (
    Body,
    FreeBase,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    WholeBodyResult,
)
from motm_wbc.qp.problem import NO_BOUND, QpProblem

DT = 1.0 / 120.0
UNDECIDED = 1e-7
"""Margin to the boundary of feasibility below which the linear program does not say."""
WORLD = 500
"""States in one world of bodies."""


@dataclass
class Report:
    """What came of the states, for one solver.

    Attributes:
        solver: its name.
        states: how many.
        feasible: so says the linear program.
        infeasible: so it says, too.
        undecided: within `UNDECIDED` of the boundary.
        rungs: how often each rung answered.
        lower_rung: feasible, but not answered by `full`; has to be zero.
        full_without_ground: infeasible, but answered by `full`; has to be zero.
        fallbacks: another solver than the chosen one answered on `full`.
        violation: worst violation of a box or a row on `full` [m/s, rad/s].
        hard_violation: worst violation of a limit that holds in every case.
        unnamed: answered by a lower rung without a conflict's name.
        infeasible_times: of a whole step on an infeasible state, of the processor [s].
        full_times: of a whole step on `full`, of the processor [s].
        solve_times: of the solvers in a feasible state [s].
        reasons: a sample of what was named.
    """

    solver: str
    states: int = 0
    feasible: int = 0
    infeasible: int = 0
    undecided: int = 0
    rungs: Counter[str] = field(default_factory=Counter)
    lower_rung: int = 0
    full_without_ground: int = 0
    fallbacks: int = 0
    violation: float = 0.0
    hard_violation: float = 0.0
    unnamed: int = 0
    infeasible_times: list[float] = field(default_factory=list)
    full_times: list[float] = field(default_factory=list)
    solve_times: list[float] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        lines = []
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, list) and value and isinstance(value[0], float):
                middle, late = np.quantile(value, [0.5, 0.99]) * 1e6
                value = f"median {middle:.0f} us, p99 {late:.0f} us, {len(value)} of them"
            elif isinstance(value, list):
                value = "".join(f"\n    {text}" for text in value[:12])
            elif isinstance(value, Counter):
                value = ", ".join(f"{key} {count}" for key, count in sorted(value.items()))
            lines.append(f"{item.name:>20}  {value}")
        return "\n".join(lines)


def random_world(rng: np.random.Generator, count: int = 8) -> tuple[Body, ...]:
    """Boxes around the origin, on the floor and in the air."""
    return tuple(
        Body(
            name=f"box{index}",
            role=SolidRole.OBSTACLE,
            outlines=(polygons.rectangle(*rng.uniform(0.1, 0.5, 2)),),
            radius=None,
            bottom=(bottom := float(rng.choice([0.0, rng.uniform(0.2, 1.2)]))),
            top=bottom + float(rng.uniform(0.1, 0.8)),
            pose=np.array([*(rng.uniform(0.6, 1.6) * _direction(rng)), rng.uniform(-3, 3)]),
            velocity=np.zeros(3),
        )
        for index in range(count)
    )


def _direction(rng: np.random.Generator) -> Array:
    angle = rng.uniform(-np.pi, np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def random_step(rng: np.random.Generator, model: RobotModel) -> dict[str, Any]:
    """Arguments of `WholeBodyController.step`, but for the bodies."""
    n = model.n_arm
    low, high = np.maximum(model.q_lower, -np.pi), np.minimum(model.q_upper, np.pi)
    q = rng.uniform(low, high)
    edge = rng.random(n) < rng.choice([0.0, 0.2, 0.6])
    nearness = rng.choice([1e-9, 1e-4, 1e-2, 0.1], n) * rng.choice([1.0, 1.0, -0.3], n)
    q = np.where(edge, np.where(rng.random(n) < 0.5, low + nearness, high - nearness), q)
    speed = rng.choice([0.0, 0.3, 1.0, 1.05]) * rng.choice([-1.0, 1.0], n)
    velocities = speed * model.v_max * np.where(rng.random(n) < 0.5, 1.0, rng.uniform(0, 1, n))
    limits = model.base_limits
    fastest = np.array([limits.v_max] * (model.n_base - 1) + [limits.omega_max])
    inputs = rng.choice([0.0, 0.5, 1.0]) * rng.uniform(-1, 1, model.n_base) * fastest
    inputs[0] = max(inputs[0], -limits.v_reverse)
    change = np.array([limits.a_max] * (model.n_base - 1) + [limits.alpha_max]) * DT
    reference = inputs + rng.choice([0.0, 1.0, 3.0]) * rng.uniform(-1, 1, model.n_base) * change
    locked = tuple(np.array(model.arm_joints)[rng.random(n) < rng.choice([0.0, 0.0, 0.2])])
    return {
        "base_pose": np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(-np.pi, np.pi)]),
        "q": q,
        "previous": (inputs, velocities),
        "tools": (ToolTask(twist=rng.normal(size=6) * rng.choice([0.0, 0.3, 2.0])),),
        "base": FreeBase() if rng.random() < 0.5 else NavigatedBase(reference),
        "posture": PostureTask(model.home, np.full(n, 0.1)) if rng.random() < 0.5 else None,
        "locked": locked,
    }


def box_of(problem: QpProblem, model: RobotModel, velocities: Array) -> tuple[Array, Array]:
    """Bounds of the variables, the arm's accelerations taken from the robot itself.

    Where these contradict a position limit the QP's box is without them, and the lower bound
    here is above the upper one.
    """
    lower, upper, change = problem.box_lower.copy(), problem.box_upper.copy(), model.a_max * DT
    arm = slice(len(lower) - model.n_arm, None)
    lower[arm] = np.maximum(lower[arm], velocities - change)
    upper[arm] = np.minimum(upper[arm], velocities + change)
    return lower, upper


def margin(problem: QpProblem, lower: Array, upper: Array) -> float:
    """Least violation that the QP's limits leave, in rows of unit length; negative inside.

    A variable whose bounds coincide has no inside, and counts by the rows alone.
    """
    n = len(problem.f)
    width = upper - lower
    rows = np.vstack((np.eye(n), -np.eye(n), problem.A))
    bounds = np.concatenate((upper, -lower, problem.bound))
    give = np.linalg.norm(rows, axis=1)
    give[: 2 * n][np.tile(np.abs(width) <= 4.0 * UNDECIDED, 2)] = 0.0
    used = bounds < NO_BOUND
    found = linprog(
        c=np.eye(n + 1)[n],
        A_ub=np.column_stack((rows, -give))[used],
        b_ub=bounds[used],
        bounds=[(None, None)] * n + [(-1.0, None)],
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return np.inf if found.x is None else float(found.x[n])


def answer_of(problem: QpProblem, result: WholeBodyResult, base: object) -> Array:
    """(n,) the variables of the QP that a result came from."""
    if not isinstance(base, NavigatedBase):
        return np.concatenate((result.base, result.arm))
    braking = problem.box_lower[0] == problem.box_upper[0]
    scale = problem.box_upper[0] if braking else result.scale
    return np.concatenate(([scale], result.arm))


def run(solver: str, states: int, seed: int = 0, robot: str = "frankie") -> Report:
    """Put random states through one controller."""
    model = load_robot(robot)
    controller = WholeBodyController(model, DT, solver=solver)
    report = Report(solver)
    rng = np.random.default_rng(seed)
    bodies: tuple[Body, ...] = ()
    for index in range(states):
        if index % WORLD == 0:
            bodies = random_world(rng)
        arguments = random_step(rng, model)
        if index == 0:
            controller.step(**arguments, bodies=bodies)  # compiles
        start = time.thread_time()
        result = controller.step(**arguments, bodies=bodies)
        elapsed = time.thread_time() - start
        _judge(report, model, controller.problem, arguments, result, elapsed)
    return report


def _judge(
    report: Report,
    model: RobotModel,
    problem: QpProblem,
    arguments: dict[str, Any],
    result: WholeBodyResult,
    elapsed: float,
) -> None:
    """Add one state to the report."""
    lower, upper = box_of(problem, model, arguments["previous"][1])
    least = margin(problem, lower, upper)
    report.states += 1
    report.rungs[result.rung] += 1
    x = answer_of(problem, result, arguments["base"])
    if least < -UNDECIDED:
        report.feasible += 1
        report.lower_rung += result.rung != "full"
        report.solve_times.append(result.solve_time)
    elif least > UNDECIDED:
        report.infeasible += 1
        report.full_without_ground += result.rung == "full"
        report.infeasible_times.append(elapsed)
    else:
        report.undecided += 1
    if result.rung == "full":
        report.fallbacks += result.solver_fallback
        report.full_times.append(elapsed)
        values = np.concatenate((x, problem.A @ x))
        n = len(x)
        over = np.maximum(
            np.concatenate((lower, problem.lower[n:])) - values,
            values - np.concatenate((upper, problem.upper[n:])),
        )
        report.violation = max(report.violation, float(over.max()))
    elif " against " not in result.reason:
        report.unnamed += 1
    elif len(report.reasons) < 200:
        report.reasons.append(f"{result.rung}: {result.reason}")
    report.hard_violation = max(
        report.hard_violation,
        float(np.max(np.maximum(problem.hard_lower - x, x - problem.hard_upper))),
        hard_violation(model, arguments, result),
    )


def hard_violation(model: RobotModel, arguments: dict[str, Any], result: WholeBodyResult) -> float:
    """How far a command passes the model's own limits, which the QP's numbers are not asked for.

    Joint speeds, positions after the step (a joint outside may not go further out), base speeds
    (a base that is too fast may not become faster).
    """
    q, after = np.asarray(arguments["q"]), np.asarray(arguments["q"]) + result.arm * DT
    base = model.base_limits
    fastest = np.array([base.v_max] * (model.n_base - 1) + [base.omega_max])
    return float(
        max(
            np.max(np.abs(result.arm) - model.v_max),
            np.max(after - np.maximum(model.q_upper, q)),
            np.max(np.minimum(model.q_lower, q) - after),
            np.max(np.abs(result.base) - fastest),
            -result.base[0] - base.v_reverse,
        )
    )


def main() -> None:
    """Run for each solver and print the reports."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--states", type=int, default=20_000)
    parser.add_argument("--solver", action="append")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for solver in options.solver or ["osqp", "daqp"]:
        print(run(solver, options.states, options.seed), flush=True)


if __name__ == "__main__":
    main()
