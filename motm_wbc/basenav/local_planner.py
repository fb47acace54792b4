"""What all local planners have in common: a goal in, the next acceleration out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True)
class Goal:
    """A pose that the base is driven to.

    Attributes:
        pose: (3,) x [m], y [m], heading [rad].
        stop: come to rest there; else drive through it at speed.
    """

    pose: Array
    stop: bool = False

    def is_same(self, other: Goal) -> bool:
        """Whether the other goal is the same pose, to be reached in the same way."""
        return self.stop == other.stop and np.array_equal(self.pose, other.pose)


class LocalPlan(Protocol):
    """What a local planner answers."""

    @property
    def acceleration(self) -> tuple[float, float]:
        """A [m/s^2] and alpha [rad/s^2], to be applied over the next command period."""

    @property
    def poses(self) -> Array:
        """(k, 4) time from now [s], x [m], y [m], heading [rad] along the plan."""

    @property
    def velocities(self) -> Array:
        """(k, 2) v [m/s], omega [rad/s] at these poses."""

    @property
    def braking(self) -> Array:
        """(b, 3) the braking arc from the state that the command leads to."""

    @property
    def reached(self) -> bool:
        """The plan leads to the goal, its last pose is there."""

    @property
    def emergency(self) -> bool:
        """Nothing but braking (or standing still) was possible."""


class LocalPlanner(Protocol):
    """Drives the base to a pose, step by step. No method but `update` ever raises."""

    def plan(self, pose: Array, v: float, omega: float, goal: Goal) -> LocalPlan:
        """What to do in the next command period."""

    def brake(self, pose: Array, v: float, omega: float) -> LocalPlan:
        """Come to rest on the present arc, as fast as the limits allow."""

    def update(self, world: World) -> None:
        """Take another world, seen from now on; obstacles may have moved, come or gone."""
