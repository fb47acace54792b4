"""DAQP, a dual active-set method: exact and quick, and the judge of what is feasible."""

from __future__ import annotations

import daqp
import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.qp.problem import QpProblem

_EXACT, _LOOSER = 1e-10, 1e-6  # violations, in rows of unit length in the metric of the cost
_FINAL = 1, 2, -1  # solved, solved with soft limits passed, infeasible
_SOFT = 8  # daqp's mark of a limit that may be passed
_SOFTNESS = 1e-6  # small beside the unit metric of x, so the limits are passed least


class DaqpSolver:
    """DAQP, from scratch at every step: an answer depends on its problem alone.

    Arnstroem, Bemporad and Axehill, "A Dual Active-Set Solver for Embedded Quadratic
    Programming Using Recursive LDL^T Updates", 2022.
    """

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum (n,), or None where there is none. Never raises."""
        try:
            return _solve(problem.H, problem.f, problem.A, problem.lower, problem.upper)
        except Exception:  # whatever it is, the caller has to go on without this answer
            return None


def solve_exactly(H: Array, f: Array, A: Array, lower: Array, upper: Array) -> Array | None:
    """The optimum (n,) of one problem by daqp, or None: infeasible, or no numbers.

    Args:
        H: (n, n) positive definite.
        f: (n,).
        A: (k, n) in C order.
        lower: (n + k,) of the box, then of the rows.
        upper: (n + k,).
    """
    try:
        x = _solve(H, f, A, lower, upper)
    except Exception:  # whatever it is, the caller has to go on without this answer
        return None
    return x if x is not None and np.isfinite(x).all() else None


def _solve(H: Array, f: Array, A: Array, lower: Array, upper: Array) -> Array | None:
    x, _, flag, _ = daqp.solve(H, f, A, upper, lower, primal_tol=_EXACT)
    if flag not in _FINAL:  # the exact tolerance ends in a cycle, now and then
        x, _, flag, _ = daqp.solve(H, f, A, upper, lower, primal_tol=_LOOSER)
    return x if flag > 0 else None


def contradiction(A: Array, lower: Array, upper: Array) -> Array | None:
    """Multipliers (n + k,) of limits that cannot all be kept, at the least sum of squares.

    At the point that passes the limits least, what they are passed by is a certificate that
    they contradict each other (Farkas): only limits with a multiplier have a part in that.
    None where daqp fails, as with a box whose bounds are crossed.

    Args:
        A: (k, n) in C order.
        lower: (n + k,) of the box, then of the rows.
        upper: (n + k,).
    """
    n, soft = A.shape[1], np.full(len(upper), _SOFT, dtype=np.int32)
    try:
        _, _, flag, info = daqp.solve(
            np.eye(n), np.zeros(n), A, upper, lower, soft, rho_soft=_SOFTNESS
        )
    except Exception:  # whatever it is, the caller has to go on without this answer
        return None
    return np.array(info["lam"]) if flag > 0 else None
