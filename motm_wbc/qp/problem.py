"""A quadratic program of fixed size, and what an answer to it is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class QpProblem:
    """Minimise 1/2 x^T H x + f^T x with A x <= bound and lower <= x <= upper.

    Attributes:
        H: (n, n) positive definite.
        f: (n,).
        A: (k, n) collision rows; zero in a slot that is not in use.
        bound: (k,); infinite in a slot that is not in use.
        lower: (n,) all limits.
        upper: (n,).
        hard_lower: (n,) limits without the arm's acceleration.
        hard_upper: (n,).
    """

    H: Array
    f: Array
    A: Array
    bound: Array
    lower: Array
    upper: Array
    hard_lower: Array
    hard_upper: Array

    def clip(self, x: Array) -> Array:
        """The nearest point inside all limits."""
        return np.asarray(np.minimum(np.maximum(x, self.lower), self.upper))

    def clip_hard(self, x: Array) -> Array:
        """The nearest point inside the limits that hold in every case."""
        return np.asarray(np.minimum(np.maximum(x, self.hard_lower), self.hard_upper))

    def excess(self, x: Array) -> float:
        """How far the worst collision row is passed; negative inside [m/s]."""
        return float(np.max(self.A @ x - self.bound))
