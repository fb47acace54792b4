"""The two legs of a placement: from the robot to all candidates, and on to the next target.

What does not depend on the robot is kept from step to step, each with the obstacles of an
ellipse that is enlarged until the times of all candidates are exact (see `ellipse`).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from motm_wbc.basenav.approach import Approach, approach_times, prepare_approach
from motm_wbc.basenav.ellipse import SLACK, Ellipse
from motm_wbc.basenav.field_solver import GoalRoutes, free_goals, solve_field
from motm_wbc.basenav.goal_field import EXTRA, GoalField, enter
from motm_wbc.basenav.onward import onward_times
from motm_wbc.basenav.outlines import EVERYWHERE
from motm_wbc.basenav.pathrtr import Speeds
from motm_wbc.basenav.ring import FREE, Ring
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array

_ABOUT = 3.5  # [radii] ways to the far side of a ring, and the ring itself, on open floor


class FirstLeg:
    """Times from the robot to the candidates of a ring."""

    _approach: Approach

    def __init__(self, ring: Ring, speeds: Speeds, inflation: float) -> None:
        """Nothing is worked out yet.

        Args:
            ring: the candidates.
            speeds: speeds of the base.
            inflation: radius of the disc that is planned for [m].
        """
        self._ring, self._speeds = ring, speeds
        self._ellipse = Ellipse(inflation)
        self._blank = True

    def times(self, world: World, pose: Array) -> tuple[Array, float]:
        """(m,) time from a pose (3,) to each candidate [s]; how far it was pushed out [m]."""
        ring, ellipse, place = self._ring, self._ellipse, pose[:2]
        if not ellipse.is_of(world):
            apart = math.hypot(*(place - ring.centre))
            self._look(world, place, max(ellipse.length, apart + _ABOUT * ring.radius + SLACK))
        for tried in itertools.count(1):
            times, longest, push = self._solve(pose)
            needed = longest + ring.radius
            if ellipse.serves(place, needed):
                break
            self._look(world, place, ellipse.enlarged(needed, tried))
        return times, push

    def _look(self, world: World, place: Array, length: float) -> None:
        if self._ellipse.look(world, place, self._ring.centre, length) or self._blank:
            inflated, ring = self._ellipse.inflated, self._ring
            self._approach = prepare_approach(
                inflated.walls, inflated.graph, ring.poses, ring.rejections, ring.each, self._speeds
            )
            self._blank = False

    def _solve(self, pose: Array) -> tuple[Array, float, float]:
        """Times, the longest way and the push, in the ellipse."""
        x, y, heading = pose.tolist()
        approach, speeds = self._approach, self._speeds
        times, longest, push = approach_times(approach, speeds, x, y, heading)
        if push > 0.0:
            longest, push = self._enter_elsewhere(pose, times, longest, push)
        return times, longest, push

    def _enter_elsewhere(
        self, pose: Array, times: Array, longest: float, push: float
    ) -> tuple[float, float]:
        """Times to what the nearest free point does not lead to, by the nearest one that does.

        The robot stands inside an inflated obstacle, say in a narrow door, and may leave it
        to either side. Each round fills in at least one time.

        Args:
            pose: (3,) the robot's.
            times: (m,) to be filled in [s].
            longest: the longest way so far [m].
            push: distance to the nearest free point [m].

        Returns:
            The longest way; distance to the nearest point that leads to a candidate [m].
        """
        (x, y, heading), approach, speeds = pose.tolist(), self._approach, self._speeds
        inflated, ring, place = self._ellipse.inflated, self._ring, np.empty(2)
        missing = (ring.rejections == FREE) & np.isinf(times)
        while missing.any():
            goals = free_goals(inflated.walls, ring.poses[missing], speeds.forward)
            toward, _ = solve_field(inflated.walls, inflated.graph, goals, speeds, EVERYWHERE)
            away = enter(toward, x, y, heading, place)
            found, farthest, _ = approach_times(approach, speeds, place[0], place[1], heading)
            reached = missing & np.isfinite(found)
            if not reached.any():
                break
            if np.isinf(times).all():
                push = away
            times[reached] = found[reached] + away / speeds.forward
            longest = max(longest, farthest + away)
            missing &= ~reached
        return longest, push


class SecondLeg:
    """Times from the candidates of a ring to the best of the next target's poses."""

    field: GoalField
    _routes: GoalRoutes

    def __init__(
        self,
        ring: Ring,
        target: Array,
        poses: Array,
        radius: float,
        speeds: Speeds,
        inflation: float,
    ) -> None:
        """Nothing is worked out yet.

        Args:
            ring: the candidates.
            target: (2,) the next target [m].
            poses: (g, 3), g >= 1, poses at it, heading NaN: free.
            radius: distance of the poses from the target [m].
            speeds: speeds of the base.
            inflation: radius of the disc that is planned for [m].
        """
        self._ring, self._target, self._poses, self._radius = ring, target, poses, radius
        self._speeds = speeds
        self._ellipse = Ellipse(inflation)
        self._times, self._longest = np.empty(0), 0.0

    def times(self, world: World) -> Array:
        """(m,) time from each candidate [s]."""
        if not self._ellipse.is_of(world):
            ring = self._ring
            apart = math.hypot(*(self._target - ring.centre))
            length = apart + 0.5 * _ABOUT * (ring.radius + self._radius) + SLACK
            self.solve(world, max(self._ellipse.length, length))
        return self._times

    def leads_to(self, poses: Array) -> bool:
        """Whether these (g, 3) are the next target's poses."""
        return np.array_equal(poses, self._poses, equal_nan=True)

    @property
    def push(self) -> float:
        """Distance from the next target's nearest pose to the nearest free point [m]."""
        return float(self.field.goals[:, EXTRA].min()) * self._speeds.forward

    def solve(self, world: World, length: float) -> None:
        """Work the times out in an ellipse of at least this length [m]."""
        ring, ellipse = self._ring, self._ellipse
        for tried in itertools.count(1):
            if ellipse.look(world, ring.centre, self._target, length) or len(self._times) == 0:
                inflated = ellipse.inflated
                goals = free_goals(inflated.walls, self._poses, self._speeds.forward)
                self.field, self._routes = solve_field(
                    inflated.walls, inflated.graph, goals, self._speeds, EVERYWHERE
                )
                self._times, self._longest = onward_times(
                    self.field, self._routes, ring.poses, ring.rejections
                )
            needed = self._longest + ring.radius + self._radius
            if needed <= ellipse.length:
                return
            length = ellipse.enlarged(needed, tried)

    def cover(self, world: World, apart: Array, times: Array) -> bool:
        """Whether the field has the exact times of some poses; else it is solved for them.

        Args:
            world: as before.
            apart: (k,) distances of the poses from the object [m].
            times: (k,) what the field said [s].
        """
        reached = np.isfinite(times)
        fastest = max(self._speeds.forward, self._speeds.backward)
        way = (apart[reached] + fastest * times[reached]).max(initial=0.0)
        needed = float(way) + self._radius
        if needed <= self._ellipse.length:
            return True
        self.solve(world, needed + SLACK)
        return False
