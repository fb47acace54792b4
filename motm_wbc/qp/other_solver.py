"""Any other solver that qpsolvers knows."""

from __future__ import annotations

import warnings

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.qp.problem import NO_BOUND, QpProblem

_OPTIONS: dict[str, dict[str, float]] = {
    # as shipped, it is loose, and takes a second to find a problem infeasible
    "proxqp": {"eps_abs": 1e-9, "max_iter": 1000},
}


class OtherSolver:
    """A solver of qpsolvers; builds its workspace anew at every call.

    Args:
        name: as qpsolvers lists it.
    """

    def __init__(self, name: str) -> None:
        self._name, self._options = name, _OPTIONS.get(name, {})
        # the first call imports: that shall not count as a slow solve
        self.solve(QpProblem.empty(1, 1))

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum (n,), or None: infeasible, or failed. Never raises."""
        import qpsolvers

        data = problem.H, problem.f, problem.A, problem.lower, problem.upper
        if not all(np.isfinite(numbers).all() for numbers in data):
            return None  # some solvers take seconds over what is no number
        used = problem.bound < NO_BOUND
        rows = bool(used.any())
        lower, upper = problem.box_lower.copy(), problem.box_upper.copy()
        lower[lower <= -NO_BOUND] = -np.inf
        upper[upper >= NO_BOUND] = np.inf
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # on conversions and on infeasible problems
                x = qpsolvers.solve_qp(
                    problem.H,
                    problem.f,
                    problem.A[used] if rows else None,
                    problem.bound[used] if rows else None,
                    lb=lower,
                    ub=upper,
                    solver=self._name,
                    **self._options,
                )
        except Exception:  # whatever it is, the caller has to go on without this answer
            return None
        return None if x is None else np.asarray(x, dtype=float)
