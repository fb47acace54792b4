"""A search that a base which is stuck makes while it stands, going on from step to step.

A step has time for some hundred expansions; the way out of a local minimum of the cost-to-go
may take thousands. While the base stands, the root of the search stays where it is, so its
nodes stay valid: the same search goes on at each step until it has found something.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.staa_answer import Answers
from motm_wbc.basenav.staa_follow import DURATION
from motm_wbc.basenav.staa_plan import StaaPlan
from motm_wbc.basenav.staa_root import Root
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.basenav.staa_solver import Solver, Way
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array

_STAYED = 0.005  # [m] and [rad] that a base at rest may seem to have moved


class WideSearch:
    """All its state is here: the caller keeps it from step to step, or drops it.

    Obstacles that move are left out, as nobody knows when the base will set off. The plan is
    checked against them, like all that is left of a previous plan, when it is gone on with.

    Attributes:
        goal: where to.
        done: there is no more to find.
    """

    def __init__(
        self,
        solver: Solver,
        problem: Problem,
        root: Root,
        goal: Goal,
        left: float,
        answers: Answers,
    ) -> None:
        """Begin.

        Args:
            solver: of its own.
            problem: what to plan, from rest.
            root: where from.
            goal: the problem's.
            left: time to it from the root [s].
            answers: writes plans.
        """
        self.goal = goal
        self.done = False
        self._solver = solver
        self._problem = problem
        self._root = root
        self._answers = answers
        self._left = left
        self._enough = math.inf  # cost-to-go of a leaf that is worth going to [s]
        solver.start(problem, root)

    def is_at(self, pose: Array, goal: Goal) -> bool:
        """Whether it is about a pose (3,), and the same goal."""
        ahead = np.asarray(pose) - self._root.pose
        moved = max(abs(ahead[0]), abs(ahead[1]), abs(wrap(float(ahead[2]))))
        return bool(moved <= _STAYED) and self.goal.is_same(goal)

    def go_on(self, began: float) -> StaaPlan:
        """Spend a step's expansions.

        Args:
            began: when the time began that the clock guards [s].

        Returns:
            To stand for a command period; after that, what was found, to be given as
            `previous` to the next `plan`. It has no goal while nothing is found.
        """
        p, solver = self._solver.parameters, self._solver
        first = self._enough == math.inf
        until = p.expansions if first else solver.effort.expansions + p.wide_step
        ended = solver.go_on(self._problem, until, began)
        if first:  # what a usual search finds is no way out: it is measured by that
            self._enough = solver.least - p.wide_gain
        gained = not first and solver.least <= self._enough
        self.done = ended or gained
        way = solver.way(self._problem, self._root) if self.done else None
        if way is not None and way.action >= 0 and (way.reached or gained):
            return self._then(way)
        plan = self._answers.once(self._root, None, self._root.brake, effort=solver.effort)
        return replace(plan, cost_to_go=self._left)

    def _then(self, way: Way) -> StaaPlan:
        """To stand for a period, then to go a way."""
        root, period = self._root, self._answers.period
        stand = [[*root.table[root.brake, :DURATION], period]]
        states = way.states.copy()
        states[:, 0] += period
        plan = self._answers.whole(
            root,
            self.goal,
            root.brake,
            np.vstack([stand, way.actions]),
            np.vstack([way.states[:1], states]),
            reached=way.reached,
            effort=way.effort,
        )
        return replace(plan, cost_to_go=self._left, detour=True)
