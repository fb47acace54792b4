"""The two legs of a placement: from the robot to all candidates, and on to the next target.

What does not depend on the robot is kept from step to step, each with the obstacles of an
ellipse that is enlarged until the times of all candidates are exact (see `kept_vicinity`).
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from motm_wbc.basenav.approach import Approach, approach_times, prepare_approach
from motm_wbc.basenav.field_solver import GoalRoutes, free_goals, solve_field
from motm_wbc.basenav.goal_field import EXTRA, GoalField, enter
from motm_wbc.basenav.kept_vicinity import SLACK, KeptVicinity
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
        self._near = KeptVicinity(inflation)
        self._needed = 0.0  # length of the ellipse that the last times took [m]
        self._blank = True

    def times(self, world: World, pose: Array) -> tuple[Array, float]:
        """(m,) time from a pose (3,) to each candidate [s]; how far it was pushed out [m]."""
        ring, near, place = self._ring, self._near, pose[:2]
        if not near.is_of(world):
            apart = math.hypot(*(place - ring.centre))
            wanted = max(self._needed, apart + _ABOUT * ring.radius) + SLACK
            self._look(world, place, near.length_for(wanted))
        for tried in itertools.count(1):
            times, longest, push = self._solve(pose)
            self._needed = longest + ring.radius
            if near.serves(place, self._needed):
                break
            self._look(world, place, near.enlarged(self._needed, tried))
        return times, push

    def _look(self, world: World, place: Array, length: float) -> None:
        if self._near.look(world, place, self._ring.centre, length) or self._blank:
            inflated, ring = self._near.inflated, self._ring
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
        inflated, ring, place = self._near.inflated, self._ring, np.empty(2)
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
    """Times from the candidates of a ring to the best of the next target's poses.

    Attributes:
        field: of these poses, in the ellipse.
        routes: of the same solution.
    """

    field: GoalField
    routes: GoalRoutes

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
        self._near = KeptVicinity(inflation)
        self._times, self._longest = np.empty(0), 0.0
        self._needed = 0.0  # length of the ellipse that all that was asked for took [m]

    def times(self, world: World) -> Array:
        """(m,) time from each candidate [s]."""
        if not self._near.is_of(world):
            around = 0.5 * _ABOUT * (self._ring.radius + self._radius)
            wanted = max(self._needed, self._apart + around) + SLACK
            self._solve(world, self._near.length_for(wanted))
        return self._times

    def leads_to(self, poses: Array) -> bool:
        """Whether these (g, 3) are the next target's poses."""
        return np.array_equal(poses, self._poses, equal_nan=True)

    @property
    def push(self) -> float:
        """Distance from the next target's nearest pose to the nearest free point [m]."""
        return float(self.field.goals[:, EXTRA].min()) * self._speeds.forward

    def cover(self, world: World, way: float, tried: int) -> bool:
        """Whether the field is exact for ways of a length; else it is solved for them.

        Args:
            world: as before.
            way: from the object to a pose and on from there [m].
            tried: how often that has been asked before, and once.
        """
        needed = way + self._radius
        serves = self._near.serves(self._ring.centre, needed)
        if not serves:
            self._solve(world, self._near.enlarged(needed, tried))
        self._needed = max(self._needed, needed)
        return serves

    @property
    def _apart(self) -> float:
        """Distance of the target from the object [m]."""
        return math.hypot(*(self._target - self._ring.centre))

    def _solve(self, world: World, length: float) -> None:
        """Work the times out in an ellipse of at least this length [m]."""
        ring, near = self._ring, self._near
        for tried in itertools.count(1):
            if near.look(world, ring.centre, self._target, length) or len(self._times) == 0:
                walls, graph = near.inflated.walls, near.inflated.graph
                goals = free_goals(walls, self._poses, self._speeds.forward)
                self.field, self.routes = solve_field(walls, graph, goals, self._speeds, EVERYWHERE)
                self._times, self._longest = onward_times(
                    self.field, self.routes, ring.poses, ring.rejections
                )
            self._needed = max(
                self._longest + ring.radius + self._radius,
                self._apart + 2.0 * (self._radius + self._farthest_push),
            )
            if near.serves(ring.centre, self._needed):
                return
            length = near.enlarged(self._needed, tried)

    @property
    def _farthest_push(self) -> float:
        """As `push`, of the pose that is pushed farthest: each one's free point is the world's."""
        return float(self.field.goals[:, EXTRA].max()) * self._speeds.forward
