"""Which limits contradict each other, by name."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.qp.daqp_solver import contradiction, solve_exactly
from motm_wbc.qp.problem import NO_BOUND, Limit, QpProblem

_NOTABLE = 1e-4  # excess of a limit that is worth naming [m/s, rad/s]
_GIVEN_WAY = 1e-7  # excess of a limit that counts as having given way
_PART = 1e-6  # share of the largest multiplier that a limit has to have a part in it
_NAMED = 4  # conflicts and culprits that a text names


class Conflict:
    """What could not be kept together, and what gave way for it.

    It keeps copies, and thinks only when it is asked. Limits have numbers: first the lower
    bounds of the variables, then their upper bounds, then the collision rows.

    Args:
        problem: that has no answer.
        x: (n,) what is done instead, or None.
        hard: the acceleration limits are not what it fails by: leave them out.
        variables: name of each variable.
        rows: name of each collision row; empty for a slot that is not in use.
        n_arm: how many variables, the last ones, are joints.
    """

    def __init__(
        self,
        problem: QpProblem,
        x: Array | None,
        *,
        hard: bool,
        variables: Sequence[str],
        rows: Sequence[str],
        n_arm: int,
    ) -> None:
        n = len(problem.f)
        self._variables, self._rows = tuple(variables), tuple(rows)
        self._A = problem.A.copy()
        self._full = np.concatenate((-problem.box_lower, problem.upper))
        self._hard = np.concatenate((-problem.hard_lower, problem.hard_upper, problem.bound))
        self._kinds = np.concatenate((problem.lower_kind, problem.upper_kind))
        self._arm = np.arange(2 * n) % n >= n - n_arm
        self._limits = self._hard if hard else self._full
        self._x = None if x is None else x.copy()

    @cached_property
    def excess(self) -> Array:
        """(2 n + k,) how far each limit is passed, all acceleration limits included."""
        if self._x is None:
            return np.full(len(self._full), -np.inf)
        return np.concatenate((-self._x, self._x, self._A @ self._x)) - self._full

    @cached_property
    def sets(self) -> tuple[tuple[int, ...], ...]:
        """Irreducible infeasible sets: each would be feasible with any one limit less.

        Found by the deletion filter among the limits of a certificate of infeasibility
        (Chinneck and Dravnieks, "Locating Minimal Infeasible Constraint Sets in Linear
        Programs", 1991). Then what gave way of a set is left out, and the rest is searched
        again.
        """
        used = np.flatnonzero(self._limits < NO_BOUND)
        found: list[tuple[int, ...]] = []
        while len(found) < _NAMED and not self._feasible(used):
            members = self._suspects(used)
            for limit in members.tolist():
                fewer = members[members != limit]
                if not self._feasible(fewer):
                    members = fewer
            found.append(tuple(members.tolist()))
            gone = [limit for limit in found[-1] if self.excess[limit] > _GIVEN_WAY]
            used = used[~np.isin(used, gone or list(found[-1]))]
        return tuple(found)

    @cached_property
    def text(self) -> str:
        """One line: what is against what, and what gave way by how much."""
        parts = [" against ".join(self.name(limit) for limit in members) for members in self.sets]
        parts = parts or ["no contradiction beyond rounding"]
        worst = np.argsort(-self.excess, kind="stable")[:_NAMED].tolist()
        gave = [
            f"{self.name(limit, given_way=True)} by {self.excess[limit]:.2g}"
            for limit in worst
            if self.excess[limit] > _NOTABLE
        ]
        if gave:
            parts.append("gave way: " + ", ".join(gave))
        return "; ".join(parts)

    def name(self, limit: int, *, given_way: bool = False) -> str:
        """The name of a limit, such as `acceleration of panda_joint2` or `link5 - table`.

        Args:
            limit: its number.
            given_way: it is spoken of as one that gave way, so no hard one is meant.
        """
        n = len(self._variables)
        if limit >= 2 * n:
            return self._rows[limit - 2 * n]
        limits = self._full if given_way else self._limits
        soft = self._arm[limit] and limits[limit] != self._hard[limit]
        kind = Limit.ACCELERATION if soft else Limit(int(self._kinds[limit]))
        return f"{kind.name.lower()} of {self._variables[limit % n]}"

    def _suspects(self, chosen: IntArray) -> IntArray:
        """Some of the chosen limits that contradict each other already."""
        n = len(self._variables)
        multipliers = contradiction(*self._system(chosen))
        if multipliers is None:
            return chosen
        sides = np.concatenate((-multipliers[:n], multipliers))
        suspects = chosen[sides[chosen] > _PART * np.max(np.abs(sides))]
        return chosen if self._feasible(suspects) else suspects

    def _feasible(self, chosen: IntArray) -> bool:
        """Whether something keeps all of the chosen limits."""
        n = len(self._variables)
        return solve_exactly(np.eye(n), np.zeros(n), *self._system(chosen)) is not None

    def _system(self, chosen: IntArray) -> tuple[Array, Array, Array]:
        """Rows and bounds with the chosen limits only."""
        n = len(self._variables)
        bounds = np.full(len(self._limits), NO_BOUND)
        bounds[chosen] = self._limits[chosen]
        lower = np.full(len(self._limits) - n, -NO_BOUND)
        lower[:n] = -bounds[:n]
        A = self._A.copy()
        A[bounds[2 * n :] >= NO_BOUND] = 0.0
        return A, lower, bounds[n:]
