"""The nearest thing to an answer: bounds that may give way, no more than needed."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.daqp_solver import solve_exactly
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import NO_BOUND, QpProblem

_STIFFNESS = 1.0  # quadratic part of a penalty, for a unique answer


class ElasticProblem:
    """A QP in which acceleration limits and, if wanted, collision rows may give way.

    Each bound that may give way has a variable of its own with an exact penalty (Kerrigan and
    Maciejowski, "Soft constraints and exact penalty functions in model predictive control",
    2000): it stays zero wherever the bound can be kept.

    Args:
        n: number of variables.
        n_arm: how many of them, the last ones, are the arm's.
        k: number of collision rows.
        parameters: penalties.
        soft_rows: collision rows may give way, too.
    """

    def __init__(
        self, n: int, n_arm: int, k: int, parameters: WholeBodyParameters, *, soft_rows: bool
    ) -> None:
        total = n + n_arm + (k if soft_rows else 0)
        self._H, self._f = _STIFFNESS * np.eye(total), np.empty(total)
        self._f[n : n + n_arm] = parameters.acceleration_penalty
        self._f[n + n_arm :] = parameters.collision_penalty
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
        _fill(
            problem.H,
            problem.f,
            problem.A,
            problem.lower,
            problem.upper,
            problem.hard_lower,
            problem.hard_upper,
            self._n_arm,
            self._H,
            self._f,
            self._A,
            self._lower,
            self._upper,
        )
        z = solve_exactly(self._H, self._f, self._A, self._lower, self._upper)
        return None if z is None else problem.clip_hard(z[: len(problem.f)])


@kernel
def _fill(
    H: Array,
    f: Array,
    A: Array,
    lower: Array,
    upper: Array,
    hard_lower: Array,
    hard_upper: Array,
    n_arm: int,
    big_H: Array,
    big_f: Array,
    big_A: Array,
    big_lower: Array,
    big_upper: Array,
) -> None:
    """Write a problem's numbers into the larger one; the structure there is fixed."""
    n, k, total = len(f), len(A), len(big_f)
    for i in range(n):
        big_f[i], big_lower[i], big_upper[i] = f[i], hard_lower[i], hard_upper[i]
        for j in range(n):
            big_H[i, j] = H[i, j]
    for i in range(n_arm):
        big_upper[total + i] = upper[n - n_arm + i]
        big_upper[total + n_arm + i] = -lower[n - n_arm + i]
    for i in range(k):
        big_upper[total + 2 * n_arm + i] = upper[n + i]
        for j in range(n):
            big_A[2 * n_arm + i, j] = A[i, j]
