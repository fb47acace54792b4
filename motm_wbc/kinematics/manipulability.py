"""Manipulability and its exact gradient, from a Jacobian alone; compiled."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_ROUNDING = 1e-14  # share of a diagonal element below which a pivot is rounding error
_SINGULAR = 1e-12  # below, the measure counts as zero and its gradient is not defined


@kernel
def manipulability(J: Array) -> float:
    """Volume of the velocity ellipsoid: product of the singular values of J.

    sqrt(det(J J^T)) with at least as many joints as rows (Yoshikawa, "Manipulability of
    robotic mechanisms", IJRR 1985), else sqrt(det(J^T J)).

    Args:
        J: (rows, n).

    Returns:
        The measure; zero where the smallest singular value is lost in rounding.
    """
    return _factor_gram(J)[1]


@kernel
def manipulability_gradient(J: Array, gradient: Array) -> float:
    """Derivative of `manipulability(J)` for each joint of a serial chain.

    dm/dq_i = m trace(J^+ H_i) = m vec(J H_i^T)^T vec((J J^T)^-1), H_i = dJ/dq_i (Haviland
    and Corke, "NEO", RA-L 2021, eq. 18). In a serial chain of revolute and prismatic joints
    H_i follows from the columns of J: with column k = (v_k, w_k), its derivative is
    (w_i x v_k, w_i x w_k) for i <= k and (w_k x v_i, 0) for i > k. So the sum over k is two
    running sums and no Hessian is formed.

    Args:
        J: (6, n) linear rows, then angular, at the tool's origin; joints from mount to tool.
        gradient: (n,), is written; zero at a singularity, where the measure has no
            derivative.

    Returns:
        The measure.
    """
    gradient[:] = 0.0
    factor, m = _factor_gram(J)
    if m < _SINGULAR:
        return m
    pseudo = _pseudoinverse(J, factor)
    n = J.shape[1]
    sum0, sum1, sum2 = 0.0, 0.0, 0.0
    for k in range(n):
        v, w, a = J[:3, k], J[3:, k], pseudo[:3, k]
        gradient[k] = m * (v[0] * sum0 + v[1] * sum1 + v[2] * sum2)
        sum0 += a[1] * w[2] - a[2] * w[1]
        sum1 += a[2] * w[0] - a[0] * w[2]
        sum2 += a[0] * w[1] - a[1] * w[0]
    sum0, sum1, sum2 = 0.0, 0.0, 0.0
    for k in range(n - 1, -1, -1):
        v, w, a, b = J[:3, k], J[3:, k], pseudo[:3, k], pseudo[3:, k]
        sum0 += v[1] * a[2] - v[2] * a[1] + w[1] * b[2] - w[2] * b[1]
        sum1 += v[2] * a[0] - v[0] * a[2] + w[2] * b[0] - w[0] * b[2]
        sum2 += v[0] * a[1] - v[1] * a[0] + w[0] * b[1] - w[1] * b[0]
        gradient[k] += m * (w[0] * sum0 + w[1] * sum1 + w[2] * sum2)
    return m


@kernel
def _factor_gram(J: Array) -> tuple[Array, float]:
    """Cholesky factor L of the smaller of J J^T and J^T J, and the product of its diagonal.

    Written out, as LAPACK's calls take longer than the arithmetic on matrices this small.
    """
    rows, n = J.shape
    wide = rows <= n
    size, terms = (rows, n) if wide else (n, rows)
    L = np.empty((size, size))
    volume = 1.0
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(terms):
                total += J[i, k] * J[j, k] if wide else J[k, i] * J[k, j]
            least = _ROUNDING * total
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if j < i:
                L[i, j] = total / L[j, j]
            elif total <= least:
                return L, 0.0
            else:
                L[i, i] = math.sqrt(total)
                volume *= L[i, i]
    return L, volume


@kernel
def _pseudoinverse(J: Array, factor: Array) -> Array:
    """(rows, n) transpose of the pseudoinverse of J, from the factor of its gram matrix."""
    pseudo = J.copy()
    if J.shape[0] <= J.shape[1]:
        for k in range(J.shape[1]):
            _solve(factor, pseudo[:, k])
    else:
        for k in range(J.shape[0]):
            _solve(factor, pseudo[k])
    return pseudo


@kernel
def _solve(L: Array, x: Array) -> None:
    """Solve L L^T y = x in place."""
    n = len(x)
    for i in range(n):
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
