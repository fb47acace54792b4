"""The nearest thing to an answer: bounds that may give way, no more than needed."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.daqp_solver import solve_exactly
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import NO_BOUND, QpProblem

_STIFFNESS = 1.0  # quadratic part of a price, for a unique answer
_AT_EASE = 1e-3  # weight of the variables where only the excess counts
_ROUNDING = 1e-8  # [m/s, rad/s] that an excess may be larger than the least one


class ElasticProblem:
    """A QP in which acceleration limits and, if wanted, collision rows may give way.

    Each bound that may give way has a variable of its own, its excess. First these are made
    as small as they can be, by their prices; then the tasks are served with what is left. So
    no task, whatever its weight, makes a bound give way that could be kept. (Kerrigan and
    Maciejowski, "Soft constraints and exact penalty functions in model predictive control",
    2000, on the prices; to solve one after the other needs no bound on the tasks.)

    Args:
        n: number of variables.
        n_arm: how many of them, the last ones, are the arm's.
        k: number of collision rows.
        parameters: prices.
        soft_rows: collision rows may give way, too.
    """

    def __init__(
        self, n: int, n_arm: int, k: int, parameters: WholeBodyParameters, *, soft_rows: bool
    ) -> None:
        total = n + n_arm + (k if soft_rows else 0)
        self._H, self._f = _STIFFNESS * np.eye(total), np.empty(total)
        self._prices = np.full(total - n, parameters.collision_penalty)
        self._prices[:n_arm] = parameters.acceleration_penalty
        self._A = np.zeros((2 * n_arm + k, total))
        joint, row = np.arange(n_arm), np.arange(k)
        self._A[joint, n - n_arm + joint], self._A[joint, n + joint] = 1.0, -1.0
        self._A[n_arm + joint, n - n_arm + joint], self._A[n_arm + joint, n + joint] = -1.0, -1.0
        if soft_rows:
            self._A[2 * n_arm + row, n + n_arm + row] = -1.0
        count = total + len(self._A)
        self._lower, self._upper = np.full(count, -NO_BOUND), np.full(count, NO_BOUND)
        self._lower[n:total] = 0.0
        self._n_arm = n_arm

    def solve(self, problem: QpProblem) -> Array | None:
        """The answer (n,) inside the hard limits; None where even these have none."""
        if not np.isfinite(problem.H).all() or not np.isfinite(problem.f).all():
            return None
        _fill(
            problem.A,
            problem.lower,
            problem.upper,
            problem.hard_lower,
            problem.hard_upper,
            self._n_arm,
            self._A,
            self._lower,
            self._upper,
        )
        n, total = len(problem.f), len(self._f)
        self._H[:n, :n], self._f[:n] = _AT_EASE * np.eye(n), 0.0
        self._f[n:], self._upper[n:total] = self._prices, NO_BOUND
        least = solve_exactly(self._H, self._f, self._A, self._lower, self._upper)
        if least is None:
            return None
        self._H[:n, :n], self._f[:n] = problem.H, problem.f
        self._f[n:], self._upper[n:total] = 0.0, np.maximum(least[n:], 0.0) + _ROUNDING
        best = solve_exactly(self._H, self._f, self._A, self._lower, self._upper)
        return problem.clip_hard((least if best is None else best)[:n])


@kernel
def _fill(
    A: Array,
    lower: Array,
    upper: Array,
    hard_lower: Array,
    hard_upper: Array,
    n_arm: int,
    big_A: Array,
    big_lower: Array,
    big_upper: Array,
) -> None:
    """Write a problem's limits into the larger one; the structure there is fixed."""
    k, n = A.shape
    total = big_A.shape[1]
    for i in range(n):
        big_lower[i], big_upper[i] = hard_lower[i], hard_upper[i]
    for i in range(n_arm):
        big_upper[total + i] = upper[n - n_arm + i]
        big_upper[total + n_arm + i] = -lower[n - n_arm + i]
    for i in range(k):
        big_upper[total + 2 * n_arm + i] = upper[n + i]
        for j in range(n):
            big_A[2 * n_arm + i, j] = A[i, j]
