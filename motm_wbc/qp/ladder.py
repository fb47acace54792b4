"""What is given up, in order, when not everything can be kept.

`full`: nothing. `no_acceleration`: the arm's acceleration limits, no more than needed.
`soft_collision`: the collision rows as well, no more than needed. Position and velocity limits
and the base's limits hold on every rung. Where no solver answers, the caller brakes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem
from motm_wbc.qp.result import Rung
from motm_wbc.qp.solvers import QpSolver, solve_exactly

_NOTABLE = 1e-4  # excess of a limit that is worth naming [m/s, rad/s]
_NAMED = 4  # culprits that a reason names
_STIFFNESS = 1.0  # quadratic part of a penalty, for a unique answer


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What the ladder came to.

    Attributes:
        x: (n,) inside all limits that the rung keeps; None: brake.
        rung: where it came from.
        reason: what gave way, by name; empty for `full`.
        solver_fallback: the chosen solver failed, daqp did not.
        solve_time: wall time [s].
    """

    x: Array | None
    rung: Rung
    reason: str
    solver_fallback: bool
    solve_time: float


class Ladder:
    """Climbs down until a problem has an answer.

    Args:
        solver: the one to ask first.
        joints: names of the arm's joints, the last variables of every problem.
        parameters: tolerance and penalties.
    """

    def __init__(
        self, solver: QpSolver, joints: Sequence[str], parameters: WholeBodyParameters
    ) -> None:
        self._solver = solver
        self._joints = tuple(joints)
        self._parameters = parameters

    def solve(self, problem: QpProblem, row_name: Callable[[int], str]) -> Answer:
        """The best command that the first feasible rung has.

        Args:
            problem: of this step.
            row_name: name of the pair in a collision row's slot.
        """
        start = time.perf_counter()
        x, rung, reason, fallback = self._descend(problem, row_name)
        return Answer(x, rung, reason, fallback, time.perf_counter() - start)

    def _descend(
        self, problem: QpProblem, row_name: Callable[[int], str]
    ) -> tuple[Array | None, Rung, str, bool]:
        x = self._accepted(problem, self._solver.solve(problem))
        if x is not None:
            return x, "full", "", False
        exact = solve_exactly(
            problem.H, problem.f, problem.A, problem.bound, problem.lower, problem.upper
        )
        x = self._accepted(problem, exact)
        if x is not None:
            return x, "full", "", True
        rungs: tuple[Rung, Rung] = ("no_acceleration", "soft_collision")
        for rung in rungs:
            found = self._elastic(problem, soft_rows=rung == "soft_collision")
            if found is not None:
                x, over_joints, over_rows = found
                return x, rung, self._reason(problem, x, over_joints, over_rows, row_name), False
        return None, "brake", "no solver found an answer", False

    def _accepted(self, problem: QpProblem, x: Array | None) -> Array | None:
        """The answer clipped to its box, if it is one and keeps the collision rows."""
        if x is None or not np.isfinite(x).all():
            return None
        clipped = problem.clip(x)
        return clipped if problem.excess(clipped) <= self._parameters.row_tolerance else None

    def _elastic(self, problem: QpProblem, *, soft_rows: bool) -> tuple[Array, Array, Array] | None:
        """Answer, excess of each joint's acceleration bound, excess of each row in use.

        Each bound that may give way has a variable of its own with an exact penalty (Kerrigan
        and Maciejowski, "Soft constraints and exact penalty functions in MPC", 2000): it stays
        zero wherever the bound can be kept.
        """
        n, n_arm = len(problem.f), len(self._joints)
        rows = np.flatnonzero(np.isfinite(problem.bound))
        n_rows = len(rows) if soft_rows else 0
        total = n + n_arm + n_rows
        H, f = _STIFFNESS * np.eye(total), np.empty(total)
        H[:n, :n], f[:n] = problem.H, problem.f
        f[n : n + n_arm] = self._parameters.acceleration_penalty
        f[n + n_arm :] = self._parameters.collision_penalty
        A = np.zeros((2 * n_arm + len(rows), total))
        joint = np.arange(n_arm)
        A[joint, n - n_arm + joint], A[joint, n + joint] = 1.0, -1.0
        A[n_arm + joint, n - n_arm + joint], A[n_arm + joint, n + joint] = -1.0, -1.0
        A[2 * n_arm :, :n] = problem.A[rows]
        if soft_rows:
            A[2 * n_arm + np.arange(n_rows), n + n_arm + np.arange(n_rows)] = -1.0
        bound = np.concatenate(
            (problem.upper[n - n_arm :], -problem.lower[n - n_arm :], problem.bound[rows])
        )
        lower, upper = np.zeros(total), np.full(total, np.inf)
        lower[:n], upper[:n] = problem.hard_lower, problem.hard_upper
        z = solve_exactly(H, f, A, bound, lower, upper)
        if z is None:
            return None
        x = problem.clip_hard(z[:n])
        if not soft_rows and problem.excess(x) > self._parameters.row_tolerance:
            return None
        return x, *self._excesses(problem, x, rows)

    def _excesses(self, problem: QpProblem, x: Array, rows: IntArray) -> tuple[Array, Array]:
        arm = slice(len(x) - len(self._joints), None)
        over = np.maximum(x - problem.upper, problem.lower - x)[arm]
        passed = np.full(len(problem.bound), -np.inf)
        passed[rows] = problem.A[rows] @ x - problem.bound[rows]
        return over, passed

    def _reason(
        self,
        problem: QpProblem,
        x: Array,
        over_joints: Array,
        over_rows: Array,
        row_name: Callable[[int], str],
    ) -> str:
        """What gave way, worst first, and against what."""
        gave = [
            (float(over_rows[slot]), f"{row_name(slot)} by {over_rows[slot]:.2g} m/s")
            for slot in np.flatnonzero(over_rows > _NOTABLE).tolist()
        ]
        gave += [
            (float(over), f"acceleration of {name} by {over:.2g} rad/s")
            for name, over in zip(self._joints, over_joints.tolist(), strict=True)
            if over > _NOTABLE
        ]
        gave.sort(key=lambda item: -item[0])
        tight = np.flatnonzero(np.abs(problem.A @ x - problem.bound) <= _NOTABLE).tolist()
        kept = [row_name(slot) for slot in tight]
        text = "gave way: " + ("; ".join(name for _, name in gave[:_NAMED]) or "rounding only")
        return text + (f"; held against {', '.join(kept[:_NAMED])}" if kept else "")
