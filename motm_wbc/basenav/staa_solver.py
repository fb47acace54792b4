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
        cost: to the goal [s]; infinite if they don't lead there.
        effort: what the search took.
    """

    action: int
    actions: Array
    states: Array
    cost: float
    effort: Effort


class Solver:
    """Memory of a search, and its parameters."""

    def __init__(self, parameters: StaaParameters, answers: Answers) -> None:
        p = self.parameters = parameters
        self._answers = answers
        self._memory = memory_for(p.expansions, p.linear_actions, p.angular_actions, p.checks)

    def better(self, problem: Problem, root: Root, kept: Array, began: float) -> Way:
        """The better of a new plan and what is left (k, 5) of the previous one.

        Args:
            problem: what to plan.
            root: where from; the last but one of its actions is the first of `kept`.
            kept: actions.
            began: when the time began that the clock guards [s].
        """
        action, actions, effort = self.search(problem, root, began)
        states, cost = self.follow(problem, root, actions)
        if len(kept) and root.admissible[root.brake - 1]:
            kept_states, kept_cost = self.follow(problem, root, kept)
            if kept_cost < math.inf and kept_cost <= cost:
                return Way(root.brake - 1, kept, kept_states, kept_cost, effort)
        return Way(action, actions, states, cost, effort)

    def search(self, problem: Problem, root: Root, began: float) -> tuple[int, Array, Effort]:
        """Search until the goal, the number of expansions or the clock ends it.

        Returns:
            Index of the first action, -1 if there is none; (k, 5) actions; effort.
        """
        memory, p = self._memory, self.parameters
        start(problem, memory, root.pose[2], root.v, root.omega, root.table, root.admissible)
        done, fired, until = False, False, 1
        while not (done or fired) and until < p.expansions:
            until = min(until + _CHUNK, p.expansions)
            done = advance(problem, memory, until)
            fired = not done and time.thread_time() - began > p.clock_guard
        counters = memory.counters
        effort = Effort(int(counters[EXPANSIONS]), int(counters[CHILDREN]), fired)
        leaf = int(counters[GOAL if counters[GOAL] >= 0 else BEST])
        if leaf < 0:
            return -1, _NO_ACTIONS, effort
        actions = actions_to(problem, memory, leaf, root.table)
        if problem.stop and counters[GOAL] >= 0:
            actions = self._answers.with_braking(actions, *memory.nodes[leaf, V : OMEGA + 1])
        return int(memory.links[leaf, ROOT]), actions, effort

    def follow(self, problem: Problem, root: Root, actions: Array) -> tuple[Array, float]:
        """States (n, 6) along a sequence of actions, and its cost to the goal [s]."""
        return follow(problem, root.pose[2], root.v, root.omega, actions, self.parameters.checks)
