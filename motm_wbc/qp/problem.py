"""A quadratic program of fixed size, and what an answer to it is worth."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

NO_BOUND = 1e30
"""A bound of this size is none; finite, as solvers disagree on infinities."""

ROUNDING = 1e-9
"""A lower bound may lie above its upper one by this much: the limits still agree."""

Kinds: TypeAlias = npt.NDArray[np.int8]
"""One `Limit` for each variable."""


class Limit(IntEnum):
    """Which limit a bound of a variable stems from."""

    SPEED = 0
    POSITION = 1
    ACCELERATION = 2
    LOCK = 3


@dataclass(frozen=True, slots=True, eq=False)
class QpProblem:
    """Minimise 1/2 x^T H x + f^T x with lower <= (x, A x) <= upper.

    Made once for each mode and overwritten in place at every step. The variables are the
    base's, then the arm's. `lower > upper` in the box is legal: these limits contradict each
    other, and the ladder says so.

    Attributes:
        H: (n, n) symmetric, positive definite, in C order.
        f: (n,).
        A: (k, n) collision rows, in C order; zero in a slot that is not in use.
        lower: (n + k,) the box of x with all limits, then `-NO_BOUND` for each row.
        upper: (n + k,) the box of x, then the rows' bounds; `NO_BOUND` in a slot not in use.
        hard_lower: (n,) limits that hold in every case: all but the arm's accelerations.
        hard_upper: (n,).
        lower_kind: (n,) which `Limit` each `hard_lower` stems from. Where the arm's box is
            narrower than its hard limits, that is an acceleration and need not be said.
        upper_kind: (n,).
        box_lower: (n,) view of `lower`.
        box_upper: (n,) view of `upper`.
        bound: (k,) view of `upper`: the rows' bounds.
    """

    H: Array
    f: Array
    A: Array
    lower: Array
    upper: Array
    hard_lower: Array
    hard_upper: Array
    lower_kind: Kinds
    upper_kind: Kinds
    box_lower: Array = field(init=False)
    box_upper: Array = field(init=False)
    bound: Array = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.f)
        object.__setattr__(self, "box_lower", self.lower[:n])
        object.__setattr__(self, "box_upper", self.upper[:n])
        object.__setattr__(self, "bound", self.upper[n:])

    @classmethod
    def empty(cls, n: int, k: int) -> QpProblem:
        """Without limits and with no row in use: its optimum is zero.

        Args:
            n: number of variables.
            k: number of collision rows.
        """
        return cls(
            H=np.eye(n),
            f=np.zeros(n),
            A=np.zeros((k, n)),
            lower=np.full(n + k, -NO_BOUND),
            upper=np.full(n + k, NO_BOUND),
            hard_lower=np.full(n, -NO_BOUND),
            hard_upper=np.full(n, NO_BOUND),
            lower_kind=np.zeros(n, np.int8),
            upper_kind=np.zeros(n, np.int8),
        )

    def clip(self, x: Array) -> Array:
        """The nearest point (n,) inside all limits of single variables."""
        inside = np.empty_like(x)
        clip(x, self.box_lower, self.box_upper, inside)
        return inside

    def clip_hard(self, x: Array) -> Array:
        """The nearest point (n,) inside the limits that hold in every case."""
        inside = np.empty_like(x)
        clip(x, self.hard_lower, self.hard_upper, inside)
        return inside

    def excess(self, x: Array) -> float:
        """How far the worst collision row in use is passed; negative inside [m/s]."""
        return excess(self.A, self.bound, x)


@kernel
def clip(x: Array, lower: Array, upper: Array, inside: Array) -> None:
    """Write the nearest point to `x` (n,) in a box to `inside`; `upper` wins over `lower`."""
    for i in range(len(x)):
        inside[i] = min(max(x[i], lower[i]), upper[i])


@kernel
def excess(A: Array, bound: Array, x: Array) -> float:
    """Greatest of `A x - bound` over the rows in use; minus infinity if there is none.

    What is no number counts as infinitely far.
    """
    worst = -np.inf
    for i in range(len(bound)):
        if not bound[i] >= NO_BOUND:
            over = -bound[i]
            for j in range(len(x)):
                over += A[i, j] * x[j]
            if not over <= NO_BOUND:
                return np.inf
            worst = max(worst, over)
    return worst
