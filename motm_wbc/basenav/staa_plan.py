"""What the local planner is asked, and what it answers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from motm_wbc.basenav.local_planner import Goal
from motm_wbc.geometry.arrays import Array

NO_ACTIONS = np.zeros((0, 5))


@dataclass(frozen=True)
class Effort:
    """What a search took.

    Attributes:
        expansions: nodes expanded.
        children: nodes generated, those in collision included.
        clock_guard_fired: it was ended by the clock.
    """

    expansions: int = 0
    children: int = 0
    clock_guard_fired: bool = False


@dataclass(frozen=True)
class StaaPlan:
    """The answer of the local planner.

    Attributes:
        acceleration: a [m/s^2] and alpha [rad/s^2], to be applied over the next command
            period.
        poses: (k, 4) time from now [s], x [m], y [m], heading [rad] along the plan.
        velocities: (k, 2) v [m/s], omega [rad/s] at these poses.
        reached: the plan leads to the goal, its last pose is there.
        braking: (b, 3) the braking arc from the state that the command leads to.
        actions: (m, 5) what the plan consists of: rate and target of v and of omega, duration.
        goal: what was asked for, or None.
        emergency: nothing but braking (or standing still) was possible, or the base drives out
            of the way of something that would hit it soon if it braked.
        effort: what the search took.
        cost_to_go: exact time to the goal by PathRTR, as the search knows it [s].
        detour: found by a `WideSearch`; it may lead away from the goal at first.
        way_out: (k, 5) actions that keep the base out of the way of what moves, from now on.
    """

    acceleration: tuple[float, float]
    poses: Array
    velocities: Array
    reached: bool
    braking: Array
    actions: Array
    goal: Goal | None
    emergency: bool = False
    effort: Effort = Effort()
    cost_to_go: float = math.inf
    detour: bool = False
    way_out: Array = field(default_factory=NO_ACTIONS.copy)

    @property
    def expansions(self) -> int:
        """Nodes expanded."""
        return self.effort.expansions

    @property
    def clock_guard_fired(self) -> bool:
        """Whether the search was ended by the clock."""
        return self.effort.clock_guard_fired
