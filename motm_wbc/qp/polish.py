"""The exact optimum of a QP, once it is known which of its constraints hold it."""

from __future__ import annotations

import math

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import kernel

_DEPENDENT = 1e-7  # share of a row that is new beside the others, below which it is left out
_FEASIBLE = 1e-9  # largest violation of an exact answer
_TRIES = 8  # changes of the guess before more iterations of the solver are worth it
_OPTIMAL = 1e-9  # largest multiplier of the wrong sign, per largest multiplier


@kernel
def polish(
    H: Array,
    f: Array,
    A: Array,
    lower: Array,
    upper: Array,
    guess: Array,
    x: Array,
    y: Array,
    L: Array,
    Q: Array,
    R: Array,
    work: Array,
    active: IntArray,
) -> bool:
    """Solve for the active constraints that `guess` suggests; True if that is the optimum.

    The answer counts if it keeps all constraints and all multipliers have the right sign
    (Karush, Kuhn and Tucker): then it is the optimum, wherever the guess came from. If not,
    the worst constraint leaves or enters, and it is tried again a few times.

    Args:
        H: (n, n) positive definite.
        f: (n,).
        A: (k, n) rows after the box.
        lower: (n + k,).
        upper: (n + k,).
        guess: (n + k,) multipliers, positive where `upper` is active, zero where nothing is;
            is overwritten with the last guess.
        x: (n,) is overwritten with the answer.
        y: (n + k,) is overwritten with its multipliers; both are valid only if True.
        L: (n, n) workspace.
        Q: (n, n) workspace.
        R: (n, n) workspace.
        work: (3, n) workspace.
        active: (n,) workspace.
    """
    if not _cholesky(H, L):
        return False
    for _ in range(_TRIES):
        count = _solve_active(f, A, lower, upper, guess, x, y, L, Q, R, work, active)
        row = _worst_multiplier(lower, upper, guess, y, active, count)
        if row >= 0:
            guess[row] = 0.0
            continue
        row, sign = _worst_violation(A, lower, upper, x)
        if row < 0:
            return bool(sign == 0.0)
        if guess[row] != 0.0:  # it is active already, but the others leave it no room
            return False
        guess[row] = sign
    return False


@kernel
def _solve_active(
    f: Array,
    A: Array,
    lower: Array,
    upper: Array,
    guess: Array,
    x: Array,
    y: Array,
    L: Array,
    Q: Array,
    R: Array,
    work: Array,
    active: IntArray,
) -> int:
    """Write the optimum with the guessed constraints as equations; return how many count.

    With H = L L^T and z = L^T x the optimum without constraints is z0 = -L^-1 f, and the
    active rows L^-1 c are made orthogonal by Gram and Schmidt's method (a range-space
    method: Nocedal and Wright, "Numerical Optimization", 2006, section 16.2). A row that
    the others imply is left out.
    """
    n = len(f)
    z, w = work[0], work[1]
    for i in range(n):
        z[i] = -f[i]
    _solve_lower(L, z)
    count = 0
    for i in range(len(guess)):
        y[i] = 0.0
        if guess[i] != 0.0 and count < n:
            count = _append(i, A, L, Q, R, active, count, work[2])
    for i in range(count):  # R^T w = b, where the active rows are R^T Q^T
        row = active[i]
        total = upper[row] if guess[row] > 0.0 else lower[row]
        for j in range(i):
            total -= R[j, i] * w[j]
        w[i] = total / R[i, i]
    _move(Q, z, w, count)
    for i in range(n - 1, -1, -1):  # L^T x = z
        total = z[i]
        for j in range(i + 1, n):
            total -= L[j, i] * x[j]
        x[i] = total / L[i, i]
    for i in range(count - 1, -1, -1):  # R lambda = -w
        total = -w[i]
        for j in range(i + 1, count):
            total -= R[i, j] * y[active[j]]
        y[active[i]] = total / R[i, i]
    return count


@kernel
def _solve_lower(L: Array, v: Array) -> None:
    """Replace `v` (n,) by L^-1 v."""
    for i in range(len(v)):
        for j in range(i):
            v[i] -= L[i, j] * v[j]
        v[i] /= L[i, i]


@kernel
def _move(Q: Array, z: Array, w: Array, count: int) -> None:
    """Move `z` (n,) to the values `w` along the directions in `Q`; `w` becomes the way."""
    for i in range(count):
        for j in range(len(z)):
            w[i] -= Q[i, j] * z[j]
    for i in range(count):
        for j in range(len(z)):
            z[j] += Q[i, j] * w[i]


@kernel
def _worst_multiplier(
    lower: Array, upper: Array, guess: Array, y: Array, active: IntArray, count: int
) -> int:
    """The active inequality whose multiplier is wrong by most; -1 if none is wrong."""
    greatest = 1.0
    for i in range(count):
        greatest = max(greatest, abs(y[active[i]]))
    worst, which = _OPTIMAL * greatest, -1
    for i in range(count):
        row = active[i]
        wrong = -y[row] if guess[row] > 0.0 else y[row]
        if wrong > worst and lower[row] < upper[row]:
            worst, which = wrong, row
    return which


@kernel
def _worst_violation(A: Array, lower: Array, upper: Array, x: Array) -> tuple[int, float]:
    """The constraint that `x` (n,) violates by most, and the sign of its multiplier.

    It is (-1, 0.0) if there is none, (-1, 1.0) if `x` is not finite.
    """
    n = len(x)
    worst, which, sign = _FEASIBLE, -1, 0.0
    for i in range(len(lower)):
        value = x[i] if i < n else 0.0
        if i >= n:
            for j in range(n):
                value += A[i - n, j] * x[j]
        if not math.isfinite(value):
            return -1, 1.0
        if value - upper[i] > worst:
            worst, which, sign = value - upper[i], i, 1.0
        if lower[i] - value > worst:
            worst, which, sign = lower[i] - value, i, -1.0
    return which, sign


@kernel
def _cholesky(H: Array, L: Array) -> bool:
    """Write the lower factor of `H` to `L`; False if it is not positive definite."""
    for i in range(len(H)):
        for j in range(i + 1):
            total = H[i, j]
            for p in range(j):
                total -= L[i, p] * L[j, p]
            if i > j:
                L[i, j] = total / L[j, j]
            elif total > 0.0:
                L[i, i] = math.sqrt(total)
            else:
                return False
    return True


@kernel
def _append(
    row: int,
    A: Array,
    L: Array,
    Q: Array,
    R: Array,
    active: IntArray,
    count: int,
    v: Array,
) -> int:
    """Add a constraint to the orthogonal active ones if it is new; return their number."""
    n = len(v)
    for i in range(n):
        v[i] = A[row - n, i] if row >= n else (1.0 if i == row else 0.0)
    _solve_lower(L, v)
    size = 0.0
    for i in range(n):
        size += v[i] * v[i]
    for p in range(count):
        along = 0.0
        for i in range(n):
            along += Q[p, i] * v[i]
        R[p, count] = along
        for i in range(n):
            v[i] -= along * Q[p, i]
    rest = 0.0
    for i in range(n):
        rest += v[i] * v[i]
    if not rest > _DEPENDENT * _DEPENDENT * size:
        return count
    R[count, count] = math.sqrt(rest)
    for i in range(n):
        Q[count, i] = v[i] / R[count, count]
    active[count] = row
    return count + 1
