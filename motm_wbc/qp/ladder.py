"""What is given up, in order, when not everything can be kept.

`full`: nothing. `no_acceleration`: the arm's acceleration limits, no more than needed.
`soft_collision`: the collision rows as well, no more than needed. Position and velocity limits
and the base's limits hold on every rung. Where no solver answers, the caller brakes.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.conflict import Conflict
from motm_wbc.qp.daqp_solver import DaqpSolver
from motm_wbc.qp.elastic import ElasticProblem
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import NO_BOUND, ROUNDING, QpProblem, clip, excess
from motm_wbc.qp.rung import Rung
from motm_wbc.qp.solvers import QpSolver

_COUNTED = "osqp", "daqp"  # solvers that end after so many iterations in any case


@dataclass(slots=True, eq=False)
class Answer:
    """What the ladder came to.

    Attributes:
        x: (n,) inside all limits that the rung keeps; None: brake.
        rung: where it came from.
        conflict: what contradicts what; None for `full`.
        solver: name of the solver that answered.
        solver_fallback: the chosen solver failed, or is not asked any more; daqp answered.
        note: why the chosen solver is not asked any more; empty while it is.
        solve_time: wall time [s].
    """

    x: Array | None
    rung: Rung
    conflict: Conflict | None
    solver: str
    solver_fallback: bool
    note: str
    solve_time: float

    @property
    def reason(self) -> str:
        """What contradicts what and what gave way, by name; made when it is asked for."""
        if self.conflict is None:
            return ""
        unanswered = "no solver found an answer; " if self.x is None else ""
        return unanswered + self.conflict.text


class Ladder:
    """Climbs down until a problem has an answer.

    daqp judges what is feasible: it is exact, and finds out in some microseconds. So no
    failure of the chosen solver leads to a lower rung, and no solver is waited for twice.

    Args:
        solver: the one to ask first.
        name: of that solver.
        variables: name of each variable; the arm's joints are the last ones.
        n_arm: number of joints.
        k: number of collision rows.
        parameters: tolerance, penalties and the time that the solver is given.
    """

    def __init__(
        self,
        solver: QpSolver,
        name: str,
        variables: Sequence[str],
        n_arm: int,
        k: int,
        parameters: WholeBodyParameters,
    ) -> None:
        self._solver, self._name = solver, name
        self._variables, self._n_arm = tuple(variables), n_arm
        self._parameters = parameters
        n = len(self._variables)
        self._daqp = DaqpSolver()
        self._firm = ElasticProblem(n, n_arm, k, parameters, soft_rows=False)
        self._soft = ElasticProblem(n, n_arm, k, parameters, soft_rows=True)
        self._note = ""

    def warm_up(self, problem: QpProblem) -> None:
        """Compile, or load, what the lower rungs need."""
        self._firm.solve(problem)
        self._soft.solve(problem)

    def solve(self, problem: QpProblem, row_name: Callable[[int], str]) -> Answer:
        """The best command that the first feasible rung has.

        Args:
            problem: of this step.
            row_name: name of the pair in a collision row's slot that is in use. Asked only
                where not everything can be kept.
        """
        start = time.perf_counter()
        x = None
        if not self._note:
            x = self._accepted(problem, self._asked(problem))
        if x is not None:
            return self._answer(x, "full", None, start, chosen=True)
        if self._name != "daqp":
            x = self._accepted(problem, self._daqp.solve(problem))
        if x is not None:
            return self._answer(x, "full", None, start, chosen=False)
        x = self._firm.solve(problem)
        if x is not None and problem.excess(x) <= self._parameters.row_tolerance:
            rung: Rung = "no_acceleration"
        else:
            x, rung = self._soft.solve(problem), "soft_collision"
        conflict = Conflict(
            problem,
            x,
            hard=rung != "no_acceleration",
            variables=self._variables,
            rows=[
                row_name(slot) if bound < NO_BOUND else ""
                for slot, bound in enumerate(problem.bound.tolist())
            ],
            n_arm=self._n_arm,
        )
        return self._answer(x, "brake" if x is None else rung, conflict, start, chosen=True)

    def _answer(
        self, x: Array | None, rung: Rung, conflict: Conflict | None, start: float, *, chosen: bool
    ) -> Answer:
        fallback = not chosen or bool(self._note)
        name = self._name if chosen and rung == "full" else "daqp"
        elapsed = time.perf_counter() - start
        return Answer(x, rung, conflict, name, fallback, self._note, elapsed)

    def _asked(self, problem: QpProblem) -> Array | None:
        """What the chosen solver says; it is not asked again if it takes too long.

        The clock is the thread's own, so a busy machine does not count. Solvers that count
        their iterations need no clock.
        """
        if self._name in _COUNTED:
            return self._solver.solve(problem)
        start, x = time.thread_time(), None
        with contextlib.suppress(Exception):  # a solver of the user's own may do anything
            x = np.array(self._solver.solve(problem), dtype=float)
        elapsed = time.thread_time() - start
        if elapsed > self._parameters.solver_time_limit:
            self._note = f"{self._name} took {elapsed:.2g} s and is not asked any more"
        return x

    def _accepted(self, problem: QpProblem, x: Array | None) -> Array | None:
        """The answer clipped to its box, if it is one and keeps the collision rows."""
        if x is None or x.shape != problem.f.shape:
            return None
        valid = _accept(x, problem.A, problem.lower, problem.upper, self._parameters.row_tolerance)
        return x if valid else None


@kernel
def _accept(x: Array, A: Array, lower: Array, upper: Array, tolerance: float) -> bool:
    """Clip `x` (n,) to its box, in place; whether it is finite and keeps all limits."""
    n = len(x)
    for i in range(n):
        if not math.isfinite(x[i]) or not lower[i] <= upper[i] + ROUNDING:
            return False
    clip(x, lower[:n], upper[:n], x)
    return bool(excess(A, upper[n:], x) <= tolerance)
