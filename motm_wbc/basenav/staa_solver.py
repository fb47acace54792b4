"""The search of the local planner, run until the goal, the expansions or the clock ends it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.staa_answer import Answers
from motm_wbc.basenav.staa_follow import follow
from motm_wbc.basenav.staa_kernel import actions_to, advance, start
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import Effort
from motm_wbc.basenav.staa_root import Root
from motm_wbc.basenav.staa_search import (
    BEST,
    BEST_H,
    CHILDREN,
    EXPANSIONS,
    GOAL,
    OMEGA,
    ROOT,
    Problem,
    V,
    memory_for,
)
from motm_wbc.geometry.arrays import Array

_CHUNK = 50  # expansions between two looks at the clock
_NO_ACTIONS = np.zeros((0, 5))


@dataclass(frozen=True)
class Way:
    """What was found.

    Attributes:
        action: index of the first action, -1 if there is none.
        actions: (k, 5) the actions.
        states: (n, 6) along them.
        cost: of the way and of what is left to the goal from its end [s].
        reached: it leads to the goal.
        effort: what the search took.
        kept: it is what was left of the previous plan.
    """

    action: int
    actions: Array
    states: Array
    cost: float
    reached: bool
    effort: Effort
    kept: bool = False


class Solver:
    """A search, its memory and its parameters."""

    def __init__(self, parameters: StaaParameters, answers: Answers, expansions: int) -> None:
        """Take room for a search.

        Args:
            parameters: of the planner.
            answers: writes plans.
            expansions: as many as the search may ever make.
        """
        p = self.parameters = parameters
        self._answers = answers
        self._memory = memory_for(expansions, p.linear_actions, p.angular_actions, p.checks)
        self._most = expansions

    def better(
        self, problem: Problem, root: Root, kept: Array, *, detour: bool, began: float
    ) -> Way:
        """The better of a new plan and what is left (k, 5) of the previous one.

        One that reaches the goal is better than one that does not, then the cheaper one. A
        detour has been found to lead out of where all that is cheaper leads nowhere: it is
        gone on with until something reaches the goal.

        Args:
            problem: what to plan.
            root: where from; the last but one of its actions is the first of `kept`.
            kept: actions.
            detour: they are of a detour.
            began: when the time began that the clock guards [s].
        """
        self.start(problem, root)
        self.go_on(problem, self._most, began)
        new = self.way(problem, root)
        if len(kept) == 0 or not root.admissible[root.brake - 1]:
            return new
        # Between the poses that a search checks the base may come nearer than the margin.
        loose = problem._replace(margin=min(problem.margin, 0.5 * self.parameters.margin))
        states, cost, reached = self._follow(loose, root, kept)
        old = Way(root.brake - 1, kept, states, cost, reached, new.effort, kept=True)
        if cost == math.inf or (new.reached and not reached):
            return new
        cheaper = cost <= new.cost or (reached and not new.reached)
        return old if cheaper or (detour and not new.reached) else new

    def start(self, problem: Problem, root: Root) -> None:
        """Begin a search."""
        start(problem, self._memory, root.pose[2], root.v, root.omega, root.table, root.admissible)
        self._done = self._fired = False

    def go_on(self, problem: Problem, until: int, began: float) -> bool:
        """Go on with the search until its end, or that of the expansions or of the time.

        Args:
            problem: with which it was begun.
            until: expansions that are made in all then.
            began: when the time began that the clock guards [s].

        Returns:
            Whether there is no more to do: the goal is found, nothing is left to expand, or
            all expansions are made.
        """
        memory, guard = self._memory, self.parameters.clock_guard
        made, until = self.effort.expansions, min(until, self._most)
        self._fired = False
        while not (self._done or self._fired) and made < until:
            made = min(made + _CHUNK, until)
            self._done = advance(problem, memory, made)
            self._fired = not self._done and time.thread_time() - began > guard
        return self._done or made >= self._most

    @property
    def least(self) -> float:
        """Least cost-to-go that was found [s]."""
        return float(self._memory.values[BEST_H])

    @property
    def effort(self) -> Effort:
        """What the search has taken so far."""
        counters = self._memory.counters
        return Effort(int(counters[EXPANSIONS]), int(counters[CHILDREN]), self._fired)

    def way(self, problem: Problem, root: Root) -> Way:
        """The way to the goal, or to the node of the least cost-to-go."""
        memory, counters = self._memory, self._memory.counters
        leaf = int(counters[GOAL if counters[GOAL] >= 0 else BEST])
        if leaf < 0:
            return Way(-1, _NO_ACTIONS, np.zeros((0, 6)), math.inf, False, self.effort)
        actions = actions_to(problem, memory, leaf, root.table)
        if problem.stop and counters[GOAL] >= 0:
            actions = self._answers.with_braking(actions, *memory.nodes[leaf, V : OMEGA + 1])
        states, cost, reached = self._follow(problem, root, actions)
        return Way(int(memory.links[leaf, ROOT]), actions, states, cost, reached, self.effort)

    def _follow(self, problem: Problem, root: Root, actions: Array) -> tuple[Array, float, bool]:
        return follow(problem, root.pose[2], root.v, root.omega, actions, self.parameters.checks)
