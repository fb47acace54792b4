"""Base placement: where the base should stand, or pass, to work on an object.

Burgess-Limerick et al., "Enabling Failure Recovery for On-The-Move Mobile Manipulation"
(2305.08351): candidates on a circle about the object, tangential, each with the cost

    C_i = C(robot -> i) + w C(i -> next target)

of two global plans; w after "Reactive Base Control for On-The-Move Mobile Manipulation in
Dynamic Environments" (2309.09393).
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from shapely import intersects_xy
from shapely.geometry import Polygon

from motm_wbc.basenav.choice import select
from motm_wbc.basenav.departure import departure_time, departure_times
from motm_wbc.basenav.footprint_check import EdgeMap, Outline, edge_map, outline_of
from motm_wbc.basenav.goal_field import GoalField, enter
from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.planner import GlobalPlanner, Path
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.ring import (
    COLLISION,
    FREE,
    OUT_OF_REACH,
    REASONS,
    UNREACHABLE,
    Ring,
    clear_poses,
    ring_poses,
    tangent_fans,
    times_from,
    times_to,
)
from motm_wbc.basenav.waiting import Wait, time_until_leaving
from motm_wbc.basenav.walls import Indices
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

__all__ = ["REASONS", "BasePlacement", "PlacementResult"]

_KEPT = 8
_NO_WAIT = Wait()
Kept = TypeVar("Kept")
Key: TypeAlias = tuple[float, ...]
SupportOf: TypeAlias = Callable[[Array], Sequence[int]]


@dataclass(frozen=True)
class PlacementResult:
    """All candidates with their costs, and what was chosen.

    Attributes:
        candidates: (m, 3) poses, m = 2 x count.
        leg1: (m,) time from the robot to each [s], infinite where rejected.
        leg2: (m,) time from each to the next target [s], zero without one.
        costs: (m,) leg1 + w leg2 [s], infinite where rejected.
        rejections: (m,) index into `REASONS`, 0 where a candidate is legal.
        selected: the chosen candidate, -1 if none is, or the robot shall stop here.
        stop_here: the robot shall brake to a stop where it can.
        stop_cost: cost of that [s], infinite where it is not offered.
        path: from the robot to the goal; None without a goal.
        goal: (3,) the chosen candidate or the pose at rest, None if there is neither.
        next_reachable: the next target can be reached from a candidate; else leg 2 was left
            out of the choice.
        robot_push: distance from the robot to the nearest free point, where it stands
            inside an inflated obstacle; else 0 [m].
    """

    candidates: Array
    leg1: Array
    leg2: Array
    costs: Array
    rejections: Indices
    selected: int
    stop_here: bool
    stop_cost: float
    path: Path | None
    goal: Array | None
    next_reachable: bool
    robot_push: float


class BasePlacement:
    """Ranks the candidates about an object at every base step.

    What depends on the objects only (collisions, reach, corners in sight, the way on to the
    next target) is kept from step to step; a step then costs one search from the robot.

    Attributes:
        planner: the global planner for the inflated world.
        parameters: parameters.
    """

    def __init__(
        self,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        parameters: PlacementParameters | None = None,
        support_of: SupportOf | None = None,
    ) -> None:
        """Prepare for a world.

        Args:
            world: obstacles, supports among them.
            footprint: (n, 2) convex outline of the base in its frame [m].
            limits: speeds of the base.
            parameters: None: defaults.
            support_of: indices into `world.solids` of what a target (2,) stands on, for
                the literal form; None: the obstacles that it lies in.
        """
        self.parameters = parameters or PlacementParameters()
        self._limits = limits
        self.planner = self._planner(world)
        self._outline: Outline = outline_of(footprint)
        margin = self.parameters.footprint_margin
        reach = self._outline.radius + 2.0 * margin  # a right angle's corner grows by 1.42
        self._edges: EdgeMap = edge_map(world.rings, world.bounded, reach)
        self._support_of = support_of or self._obstacles_at
        self._rings: OrderedDict[Key, Ring] = OrderedDict()
        self._fields: OrderedDict[Key, GoalField | None] = OrderedDict()
        self._starts: OrderedDict[Key, Array] = OrderedDict()
        self._onward: OrderedDict[Key, Array] = OrderedDict()

    def evaluate(
        self,
        pose: Array,
        object_xy: Array,
        next_xy: Array | None,
        *,
        previous: Array | None = None,
        stop_pose: Array | None = None,
        stop_time: float = 0.0,
        region: ReachRegion | None = None,
        wait: Wait = _NO_WAIT,
    ) -> PlacementResult:
        """Cost of every candidate, and the choice.

        Args:
            pose: (3,) the robot's.
            object_xy: (2,) object to be worked on [m].
            next_xy: (2,) next target [m], None if there is none.
            previous: (3,) goal chosen at the last step, for the hysteresis.
            stop_pose: (3,) pose at rest of the braking arc from here, only if the object is
                then in reach.
            stop_time: time that braking takes [s].
            region: where the arm can work; None: everywhere.
            wait: how long the robot is needed here; only where there is a next target.

        Returns:
            Costs and choice; never raises for finite arguments.
        """
        ring = self._ring(object_xy, region)
        leg1, robot_push = self._leg1(ring, pose)
        leg2 = self._leg2(ring, object_xy, next_xy, region)
        rejections = ring.rejections.copy()
        rejections[(rejections == FREE) & np.isinf(leg1)] = UNREACHABLE
        legal = rejections == FREE
        next_reachable = bool(np.isfinite(leg2[legal]).any()) or not legal.any()
        if next_reachable:
            rejections[legal & np.isinf(leg2)] = UNREACHABLE
            legal = rejections == FREE
        weighed = self.parameters.weight * leg2 if next_reachable else np.zeros_like(leg2)
        if next_xy is None or not self.parameters.price_wait:
            wait = _NO_WAIT
            restarts = np.zeros(len(leg1))
        else:
            restarts = wait.restart + self._standing_starts(ring, object_xy, next_xy, region, leg2)
        reached = time_until_leaving(np.where(legal, leg1, 0.0), wait, restarts)
        costs = np.where(legal, reached + np.where(legal, weighed, 0.0), math.inf)
        selected = select(ring.poses, costs, leg2, previous, self.parameters)
        stop_cost = math.inf
        if stop_pose is not None and self.parameters.stop_here:
            rested = max(stop_time, wait.expected) + wait.restart
            stop_cost = rested + self._stop_leg2(stop_pose, next_xy, region)
        stops = bool(stop_cost < costs.min())
        goal = stop_pose if stops else (ring.poses[selected].copy() if selected >= 0 else None)
        return PlacementResult(
            candidates=ring.poses,
            leg1=np.where(legal, leg1, math.inf),
            leg2=leg2,
            costs=costs,
            rejections=rejections,
            selected=-1 if stops else selected,
            stop_here=stops,
            stop_cost=stop_cost,
            path=None if goal is None else self.planner.route(pose, goal),
            goal=goal,
            next_reachable=next_reachable,
            robot_push=robot_push,
        )

    def _leg1(self, ring: Ring, pose: Array) -> tuple[Array, float]:
        """Times from the robot, and how far it was pushed out."""
        place = np.empty(2)
        turned = np.array([[pose[0], pose[1], pose[2] + math.pi]])
        field, _ = self.planner.solve(turned)
        times: Array = times_from(field, ring.fans, ring.poses)
        push = float(field.goals[0, 3]) * self._limits.v_max
        free = ring.rejections == FREE
        if push > 0.0 and free.any() and np.isinf(times[free]).all():
            # the nearest free point is a pocket with no way out: the nearest one with a way
            toward, _ = self.planner.solve(ring.poses[free])
            push = enter(toward, pose[0], pose[1], pose[2], place)
            field, _ = self.planner.solve(np.array([[place[0], place[1], pose[2] + math.pi]]))
            times = times_from(field, ring.fans, ring.poses) + push / self._limits.v_max
        return times, push

    def _leg2(
        self, ring: Ring, object_xy: Array, next_xy: Array | None, region: ReachRegion | None
    ) -> Array:
        """Times from the candidates to the next target."""
        if next_xy is None:
            return np.zeros(len(ring.poses))

        def build() -> Array:
            field = self._next_field(next_xy, region)
            if field is None:
                return np.full(len(ring.poses), math.inf)
            times: Array = times_to(field, ring.poses)
            return times

        key = (*object_xy[:2].tolist(), *next_xy[:2].tolist(), *_region_key(region))
        return _kept(self._onward, key, build)

    def _stop_leg2(
        self, stop_pose: Array, next_xy: Array | None, region: ReachRegion | None
    ) -> float:
        """Weighed time on from a stop [s], infinite if the base can't get away from there."""
        if next_xy is None:
            return 0.0
        field = self._next_field(next_xy, region)
        if field is None:
            return math.inf
        x, y, heading = (float(value) for value in stop_pose)
        margin = self.parameters.footprint_margin
        alpha = self._limits.alpha_max
        return self.parameters.weight * departure_time(
            field, self._edges, self._outline, x, y, heading, margin, alpha
        )

    def _standing_starts(
        self,
        ring: Ring,
        object_xy: Array,
        next_xy: Array,
        region: ReachRegion | None,
        leg2: Array,
    ) -> Array:
        """(m,) what setting out from rest costs at each candidate beside driving through [s]."""

        def build() -> Array:
            field = self._next_field(next_xy, region)
            if field is None:
                return np.zeros(len(leg2))
            margin, alpha = self.parameters.footprint_margin, self._limits.alpha_max
            times: Array = departure_times(
                field, self._edges, self._outline, ring.poses, margin, alpha
            )
            later = np.subtract(times, leg2, out=np.zeros(len(leg2)), where=np.isfinite(leg2))
            return np.maximum(later, 0.0)

        key = (*object_xy[:2].tolist(), *next_xy[:2].tolist(), *_region_key(region))
        return _kept(self._starts, key, build)

    def _next_field(self, next_xy: Array, region: ReachRegion | None) -> GoalField | None:
        """Field of the next target; None if no pose about it is free."""

        def build() -> GoalField | None:
            if not self.parameters.next_ring:
                target = np.array([[next_xy[0], next_xy[1], math.nan]])
                return self._without_support(next_xy).solve(target)[0]
            ring = self._ring(next_xy, region)
            free = ring.poses[ring.rejections == FREE]
            return self.planner.solve(free)[0] if len(free) else None

        return _kept(self._fields, (*next_xy[:2].tolist(), *_region_key(region)), build)

    def _ring(self, target_xy: Array, region: ReachRegion | None) -> Ring:
        def build() -> Ring:
            p = self.parameters
            poses = ring_poses(target_xy, p.count, p.radius)
            clear = clear_poses(self._edges, self._outline, poses, p.footprint_margin)
            rejections = np.where(clear == 1, FREE, COLLISION).astype(np.int64)
            if region is not None:
                within = region.contains_each(poses, target_xy)
                rejections[~within & (rejections == FREE)] = OUT_OF_REACH
            positions = np.ascontiguousarray(poses[::2, :2])
            return Ring(poses, rejections, tangent_fans(self.planner.inflated.walls, positions))

        return _kept(self._rings, (*target_xy[:2].tolist(), *_region_key(region)), build)

    def _planner(self, world: World) -> GlobalPlanner:
        limits = self._limits
        return GlobalPlanner(
            world,
            limits.v_max,
            limits.omega_max,
            inflation=self.parameters.inflation,
            v_reverse=limits.v_reverse,
        )

    def _without_support(self, target_xy: Array) -> GlobalPlanner:
        world = self.planner.world
        ignored = set(self._support_of(target_xy))
        kept = (solid for index, solid in enumerate(world.solids) if index not in ignored)
        return self._planner(world.with_solids(kept))

    def _obstacles_at(self, target_xy: Array) -> list[int]:
        """Obstacles that a place lies in or on the edge of."""
        x, y = float(target_xy[0]), float(target_xy[1])
        obstacles = self.planner.world.obstacles
        return [
            index for index, points in enumerate(obstacles) if intersects_xy(Polygon(points), x, y)
        ]


def _region_key(region: ReachRegion | None) -> Key:
    if region is None:
        return ()
    return (*region.arm_xy.tolist(), region.radius, region.bearing)


def _kept(store: OrderedDict[Key, Kept], key: Key, build: Callable[[], Kept]) -> Kept:
    """The stored value of a key, built when it is not there; the oldest ones are dropped."""
    if key not in store:
        store[key] = build()
        if len(store) > _KEPT:
            store.popitem(last=False)
    store.move_to_end(key)
    return store[key]
