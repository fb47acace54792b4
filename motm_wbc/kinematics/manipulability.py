"""Manipulability and its exact gradient, from a Jacobian alone."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array

_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]
_SINGULAR = 1e-12  # below, the measure counts as zero and its gradient is not defined


def manipulability(J: Array) -> float:
    """Volume of the velocity ellipsoid: product of the singular values of J.

    sqrt(det(J J^T)) with at least as many joints as rows (Yoshikawa, "Manipulability of
    robotic mechanisms", IJRR 1985), else sqrt(det(J^T J)).

    Args:
        J: (rows, n).
    """
    gram = J @ J.T if J.shape[0] <= J.shape[1] else J.T @ J
    return math.sqrt(max(float(np.linalg.det(gram)), 0.0))


def manipulability_gradient(J: Array) -> Array:
    """Derivative of `manipulability(J)` for each joint of a serial chain.

    dm/dq_i = m trace(J^+ H_i) = m vec(J H_i^T)^T vec((J J^T)^-1), H_i = dJ/dq_i (Haviland
    and Corke, "NEO", RA-L 2021, eq. 18). In a serial chain of revolute and prismatic joints
    H_i follows from the columns of J: with column k = (v_k, w_k), its derivative is
    (w_i x v_k, w_i x w_k) for i <= k and (w_k x v_i, 0) for i > k. So the sum over k is two
    running sums and no Hessian is formed.

    Args:
        J: (6, n) linear rows, then angular, at the tool's origin; joints from mount to tool.

    Returns:
        (n,); zero at a singularity, where the measure has no derivative.
    """
    m = manipulability(J)
    if m < _SINGULAR:
        return np.zeros(J.shape[1])
    wide = J.shape[0] <= J.shape[1]
    pseudo = np.linalg.solve(J @ J.T, J) if wide else np.linalg.solve(J.T @ J, J.T).T
    n = J.shape[1]
    v, w, a, b = J[:3], J[3:], pseudo[:3], pseudo[3:]
    products = _cross(np.concatenate((v, w, a), axis=1), np.concatenate((a, b, w), axis=1))
    own = products[:, :n] + products[:, n : 2 * n]
    from_here = own.sum(axis=1, keepdims=True) - own.cumsum(axis=1) + own
    before = products[:, 2 * n :].cumsum(axis=1) - products[:, 2 * n :]
    return np.asarray(m * (w * from_here + v * before).sum(axis=0))


def _cross(p: Array, q: Array) -> Array:
    """(3, n) column by column p x q; numpy's own takes several times as long on few columns."""
    return np.asarray(p[_NEXT] * q[_AFTER] - p[_AFTER] * q[_NEXT])
