"""QP solvers behind one call. Each keeps its workspace from step to step."""

from __future__ import annotations

from typing import Protocol

import daqp
import numpy as np
import osqp

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem

_DAQP_INFINITY = 1e30
_OSQP_SOLVED = 1


class QpSolver(Protocol):
    """Something that solves problems of one size."""

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum (n,), or None: infeasible, or failed. Never raises."""


def make_solver(name: str, n: int, k: int, parameters: WholeBodyParameters) -> QpSolver:
    """The solver of that name for n variables and k collision rows.

    Raises:
        UnknownName: neither osqp nor daqp, nor a solver that qpsolvers finds installed.
    """
    if name == "osqp":
        return OsqpSolver(n, k, parameters)
    if name == "daqp":
        return DaqpSolver()
    import qpsolvers

    if name not in qpsolvers.available_solvers:
        raise UnknownName("solver", name, {"osqp", "daqp", *qpsolvers.available_solvers})
    return OtherSolver(name)


class OsqpSolver:
    """OSQP on one workspace of fixed sparsity (Stellato et al., 2020).

    The rows are the box, then the collision rows with all their entries, zeros included, so
    an update never changes the pattern. The last primal and dual answer is the start of the
    next solve; OSQP forgets it by itself after an infeasible problem.

    Args:
        n: number of variables.
        k: number of collision rows.
        parameters: tolerance and iterations.
    """

    def __init__(self, n: int, k: int, parameters: WholeBodyParameters) -> None:
        from scipy import sparse

        self._n = n
        # upper triangle, column by column
        columns, rows = np.tril_indices(n)
        self._upper = rows * n + columns
        pattern = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        pattern.data[:] = np.eye(n).reshape(-1)[self._upper]
        self._A = np.ones((n, 1 + k))  # column by column: the box's one, then the rows
        indices = np.concatenate([[j, *range(n, n + k)] for j in range(n)])
        constraints = sparse.csc_matrix(
            (self._A.reshape(-1).copy(), indices, np.arange(n + 1) * (1 + k)), shape=(n + k, n)
        )
        self._low, self._high = np.full(n + k, -1e30), np.full(n + k, 1e30)
        self._solver = osqp.OSQP()
        self._solver.setup(
            P=pattern,
            q=np.zeros(n),
            A=constraints,
            l=self._low,
            u=self._high,
            verbose=False,
            eps_abs=parameters.solver_tolerance,
            eps_rel=0.0,
            eps_prim_inf=parameters.solver_tolerance,
            eps_dual_inf=parameters.solver_tolerance,
            max_iter=parameters.solver_iterations,
            check_termination=10,
            adaptive_rho_interval=50,  # counted, not timed: the same run gives the same answer
            warm_starting=True,
            polishing=False,
        )

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum to the tolerance, or None."""
        n = self._n
        self._A[:, 1:] = problem.A.T
        self._low[:n], self._high[:n] = problem.lower, problem.upper
        np.minimum(problem.bound, 1e30, out=self._high[n:])
        self._solver.update(
            Px=problem.H.reshape(-1)[self._upper],
            q=problem.f,
            Ax=self._A.reshape(-1),
            l=self._low,
            u=self._high,
        )
        result = self._solver.solve(raise_error=False)
        if result.info.status_val != _OSQP_SOLVED:
            return None
        return np.array(result.x)


class DaqpSolver:
    """DAQP, a dual active-set method (Arnstroem, Bemporad and Axehill, 2022): exact and quick."""

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum, or None where there is none."""
        return solve_exactly(
            problem.H, problem.f, problem.A, problem.bound, problem.lower, problem.upper
        )


class OtherSolver:
    """Any solver that qpsolvers knows; builds its workspace anew at every call.

    Args:
        name: as qpsolvers lists it.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum, or None."""
        import qpsolvers

        used = np.isfinite(problem.bound)
        try:
            x = qpsolvers.solve_qp(
                problem.H,
                problem.f,
                problem.A[used] if used.any() else None,
                problem.bound[used] if used.any() else None,
                lb=problem.lower,
                ub=problem.upper,
                solver=self._name,
            )
        except (qpsolvers.exceptions.QPError, ArithmeticError, ValueError):
            return None
        return None if x is None else np.asarray(x)


def solve_exactly(
    H: Array, f: Array, A: Array, bound: Array, lower: Array, upper: Array
) -> Array | None:
    """One problem by daqp, rows with infinite bounds left out; None where it is infeasible."""
    used = np.flatnonzero(np.isfinite(bound))
    high = np.concatenate((upper, bound[used]))
    low = np.concatenate((lower, np.full(len(used), -_DAQP_INFINITY)))
    np.minimum(high, _DAQP_INFINITY, out=high)
    x, _, flag, _ = daqp.solve(H, f, np.ascontiguousarray(A[used]), high, low)
    return np.array(x) if flag > 0 and np.isfinite(x).all() else None
