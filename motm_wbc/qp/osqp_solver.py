"""OSQP on one workspace: a few iterations find the active constraints, algebra the rest."""

from __future__ import annotations

import math

import numpy as np
import osqp
from scipy import sparse

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.daqp_solver import solve_exactly
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.polish import polish
from motm_wbc.qp.problem import NO_BOUND, ROUNDING, QpProblem

_ROUND = 10  # iterations before the active set is tried
_STEPS = 0.2, 1.0, 10.0, 100.0  # OSQP's rho, by turns, for variables and rows of unit length
_TURN = 2  # rounds with one of them
_DOUBT = 3  # rounds after which daqp is asked whether there is an answer at all
_SOLVED = 1
_INFEASIBLE = 3, 4  # primal infeasible, surely or nearly so
_ZERO = 1e-9  # multipliers below are rounding


class OsqpSolver:
    """OSQP with a polish of our own after every few iterations.

    Stellato et al., "OSQP: An Operator Splitting Solver for Quadratic Programs", 2020.
    The sparsity is fixed: the box, then the rows with all their entries, zeros included.
    Variables are scaled to a Hessian with unit diagonal and rows to unit length, so one
    step size does for nearly all problems. The few that want another get it by turns, counted
    and not timed: the same run gives the same answer.
    It is slow to see that a problem is infeasible, so daqp is asked that in case of doubt.
    The last answer and its multipliers are the start of the next solve; keep a pair in its
    slot to gain by that. OSQP's own scaling, polish and Python layer are left out, as each
    takes longer than its iterations.

    Args:
        n: number of variables.
        k: number of collision rows.
        parameters: tolerance and iterations.
    """

    def __init__(self, n: int, k: int, parameters: WholeBodyParameters) -> None:
        columns, rows = np.tril_indices(n)  # the upper triangle, column by column
        pattern = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        self._P = np.array(np.eye(n)[rows, columns])
        pattern.data[:] = self._P
        indices = np.concatenate([[j, *range(n, n + k)] for j in range(n)])
        self._A = np.ones(n * (1 + k))
        constraints = sparse.csc_matrix(
            (self._A.copy(), indices, np.arange(n + 1) * (1 + k)), shape=(n + k, n)
        )
        self._q, self._start = np.zeros(n), np.zeros(n)
        self._low, self._high = np.full(n + k, -NO_BOUND), np.full(n + k, NO_BOUND)
        self._duals, self._scale = np.zeros(n + k), np.ones(n + k)
        self._x, self._y = np.zeros(n), np.zeros(n + k)
        self._guess, self._multipliers = np.zeros(n + k), np.zeros(n + k)
        self._work = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((3, n))
        self._active = np.empty(n, np.intp)
        self._rounds = math.ceil(parameters.solver_iterations / _ROUND)
        model = osqp.OSQP()
        model.setup(
            P=pattern,
            q=self._q,
            A=constraints,
            l=self._low,
            u=self._high,
            verbose=False,
            eps_abs=parameters.solver_tolerance,
            eps_rel=0.0,
            eps_prim_inf=parameters.solver_tolerance,
            eps_dual_inf=parameters.solver_tolerance,
            max_iter=_ROUND,
            check_termination=0,  # at the end of each round only
            rho=_STEPS[0],
            rho_is_vec=False,
            adaptive_rho=False,
            scaling=0,
            warm_starting=True,
            polishing=False,
        )
        self._solver = model._solver  # the bare extension
        self._step = _STEPS[0]
        self.iterations = 0
        """Iterations of the last solve."""

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum (n,), exact in nearly all cases, else to the tolerance; or None."""
        self.iterations = 0
        try:
            return self._iterate(problem) if self._load(problem) else None
        except Exception:  # whatever it is, the caller has to go on without this answer
            return None

    def _load(self, problem: QpProblem) -> bool:
        """Hand a problem to OSQP, with where to start; whether it takes it."""
        solver = self._solver
        numbers = _scaled(
            problem.H, problem.f, problem.A, problem.lower, problem.upper, self._x, self._y,
            self._P, self._A, self._q, self._low, self._high, self._start, self._duals,
            self._scale,
        )  # fmt: skip
        if not numbers:
            return False
        self._set_step(_STEPS[0])
        if solver.update_data_vec(q=self._q, l=self._low, u=self._high):
            return False
        if solver.update_data_mat(P_x=self._P, P_i=None, A_x=self._A, A_i=None):
            return False
        solver.warm_start(self._start, self._duals)
        return True

    def _iterate(self, problem: QpProblem) -> Array | None:
        """Rounds of a few iterations and a polish, until there is an answer."""
        H, f, A, lower, upper = problem.H, problem.f, problem.A, problem.lower, problem.upper
        solver, x = self._solver, np.empty(len(f))
        for turn in range(self._rounds):
            if turn == _DOUBT and solve_exactly(H, f, A, lower, upper) is None:
                break  # there is no answer to be found
            self._set_step(_STEPS[turn // _TURN % len(_STEPS)])
            solver.solve()
            self.iterations += _ROUND
            status = solver.info.status_val
            if status in _INFEASIBLE:
                break
            solution = solver.solution
            duals = solution.y
            _unscaled(duals, self._scale, self._guess)
            exact = polish(
                H, f, A, lower, upper, self._guess, x, self._multipliers, *self._work,
                self._active,
            )  # fmt: skip
            if exact:
                self._x[:], self._y[:] = x, self._multipliers
                return x
            if status == _SOLVED:
                np.divide(solution.x, self._scale[: len(x)], out=self._x)
                _unscaled(duals, self._scale, self._y)
                return self._x.copy()
        return None

    def _set_step(self, step: float) -> None:
        """Change OSQP's rho; that costs a factorisation, so only if it is another one."""
        if step != self._step:
            self._solver.update_rho(step)
            self._step = step


@kernel
def _unscaled(duals: Array, scale: Array, y: Array) -> None:
    """Write OSQP's multipliers in the problem's own scale to `y`; rounding becomes zero."""
    for i in range(len(y)):
        y[i] = duals[i] * scale[i] if abs(duals[i]) > _ZERO else 0.0


@kernel
def _scaled(
    H: Array,
    f: Array,
    A: Array,
    lower: Array,
    upper: Array,
    x: Array,
    y: Array,
    P_data: Array,
    A_data: Array,
    q: Array,
    low: Array,
    high: Array,
    start: Array,
    duals: Array,
    scale: Array,
) -> bool:
    """Write the scaled problem and start in OSQP's layout; False where it has none.

    Variables become x_i sqrt(H_ii) and collision rows are divided by their length in these.

    Args:
        H: (n, n).
        f: (n,).
        A: (k, n).
        lower: (n + k,).
        upper: (n + k,).
        x: (n,) to start from.
        y: (n + k,) multipliers to start from.
        P_data: (n (n + 1) / 2,) is overwritten: upper triangle column by column.
        A_data: (n (1 + k),) is overwritten: column by column, the box's one, then the rows.
        q: (n,) is overwritten.
        low: (n + k,) is overwritten; never above `high`.
        high: (n + k,) is overwritten.
        start: (n,) is overwritten with the scaled `x`.
        duals: (n + k,) is overwritten with the scaled `y`.
        scale: (n + k,) is overwritten: factors of the constraints.
    """
    n, k = len(f), len(A)
    total = 0.0
    for i in range(n):
        if not 0.0 < H[i, i] < NO_BOUND:
            return False
        scale[i] = math.sqrt(H[i, i])
        q[i] = f[i] / scale[i]
        start[i] = x[i] * scale[i]
        total += q[i]
    position = 0
    for j in range(n):
        for i in range(j + 1):
            P_data[position] = H[i, j] / (scale[i] * scale[j])
            total += P_data[position]
            position += 1
    for i in range(k):
        square = 0.0
        for j in range(n):
            value = A[i, j] / scale[j]
            square += value * value
        scale[n + i] = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
        total += square
    for j in range(n):
        A_data[j * (1 + k)] = 1.0
        for i in range(k):
            A_data[j * (1 + k) + 1 + i] = A[i, j] / scale[j] * scale[n + i]
    for i in range(n + k):
        high[i] = min(upper[i] * scale[i], NO_BOUND)
        low[i] = min(max(lower[i] * scale[i], -NO_BOUND), high[i])
        duals[i] = y[i] / scale[i]
        if not lower[i] <= upper[i] + ROUNDING:
            return False
    return math.isfinite(total)
