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
from functools import partial
from typing import TypeAlias, TypeVar

import numpy as np
from shapely import intersects_xy
from shapely.geometry import Polygon

from motm_wbc.basenav import checks
from motm_wbc.basenav.choice import choose, rules_of
from motm_wbc.basenav.edge_patches import EdgePatches
from motm_wbc.basenav.footprint_check import EdgeMap, grown_radius, outline_of
from motm_wbc.basenav.legs import FirstLeg, SecondLeg
from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.pathrtr import Speeds
from motm_wbc.basenav.placement_result import PlacementResult
from motm_wbc.basenav.placement_task import Base, PlacementTask
from motm_wbc.basenav.planner import GlobalPlanner, Path
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.ring import REASONS, Ring, make_ring
from motm_wbc.basenav.waiting import Wait
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

__all__ = ["REASONS", "BasePlacement", "PlacementResult"]

_KEPT = 8
_NO_WAIT = Wait()
_NOWHERE = np.full(3, math.nan)
Key: TypeAlias = tuple[float, ...]
SupportOf: TypeAlias = Callable[[Array], Sequence[int]]
Kept = TypeVar("Kept")


class BasePlacement:
    """Ranks the candidates about an object at every base step.

    What depends on the objects only (collisions, reach, corners in sight, the way on to the
    next target) is kept from step to step; a step then costs one search from the robot.

    Attributes:
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

        Raises:
            InputError: the footprint or a limit can't be used.
        """
        self.parameters = parameters or PlacementParameters()
        self._rules = rules_of(self.parameters)
        self._limits = limits = checks.limits(limits)
        self._speeds = Speeds(limits.v_max, limits.v_reverse, limits.omega_max)
        margin = self.parameters.footprint_margin
        self._base = Base(outline_of(checks.footprint(footprint)), margin, limits.alpha_max)
        self._edges_near = EdgePatches(world, grown_radius(self._base.outline, margin))
        self._support_of = support_of or self._obstacles_at
        self._world, self._version = world, 0
        self._planner: GlobalPlanner | None = None
        self._rings: OrderedDict[Key, tuple[EdgeMap, Ring]] = OrderedDict()
        self._tasks: OrderedDict[Key, PlacementTask] = OrderedDict()

    @property
    def planner(self) -> GlobalPlanner:
        """The global planner for the inflated world."""
        if self._planner is None:
            self._planner = self._planner_of(self._world)
        return self._planner

    def update(self, world: World) -> None:
        """The world has changed; what is still the same about the targets is kept."""
        if world is not self._world:
            self._world, self._version = world, self._version + 1
            self._planner = None
            self._edges_near.update(world)

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

        Raises:
            InputError: a place or a pose is not finite, or has another shape.
        """
        pose = _checked(pose, 3, "pose")
        object_xy = _checked(object_xy, 2, "object_xy")
        next_xy = None if next_xy is None else _checked(next_xy, 2, "next_xy")
        previous = _NOWHERE if previous is None else _checked(previous, 3, "previous")
        stop_pose = None if stop_pose is None else _checked(stop_pose, 3, "stop_pose")
        task = self._task(object_xy, next_xy, region)
        leg1, robot_push = task.first.times(self._world, pose)
        leg2 = task.leg2()
        if next_xy is None or not self.parameters.price_wait:
            wait = _NO_WAIT
        restarts = self._restarts(task, wait)
        choice = choose(
            task.ring.poses,
            task.ring.rejections,
            leg1,
            leg2,
            restarts,
            wait.expected,
            wait.open_end,
            self._rules,
            previous,
        )
        stop_cost = math.inf
        if stop_pose is not None and self.parameters.stop_here:
            onward = self.parameters.weight * task.time_on(stop_pose, self._edges_near)
            stop_cost = max(stop_time, wait.expected) + wait.restart + onward
        stops = stop_cost < choice.least
        goal = None
        if stops:
            goal = stop_pose
        elif choice.selected >= 0:
            goal = task.ring.poses[choice.selected].copy()
        return PlacementResult(
            candidates=_shown(task.ring.poses),
            leg1=choice.leg1,
            leg2=_shown(leg2),
            costs=choice.costs,
            rejections=choice.rejections,
            selected=-1 if stops else choice.selected,
            stop_here=stops,
            stop_cost=stop_cost,
            goal=goal,
            next_reachable=choice.next_reachable,
            robot_push=robot_push,
            next_push=0.0 if task.second is None else task.second.push,
            _route=partial(self._route, self._world, pose.copy()),
        )

    def _restarts(self, task: PlacementTask, wait: Wait) -> Array:
        """(m,) what setting out from rest costs, if the base may have to wait [s]."""
        if not wait.open_end and wait.expected <= 0.0:
            return np.zeros(len(task.ring.poses))
        return np.asarray(wait.restart + task.standing_starts(self._edges_near))

    def _task(
        self, object_xy: Array, next_xy: Array | None, region: ReachRegion | None
    ) -> PlacementTask:
        """The kept task, checked against the world if that has changed."""
        after = () if next_xy is None else tuple(next_xy.tolist())
        key = (*object_xy.tolist(), *after, *_region_key(region))
        task = self._tasks.get(key)
        if task is None or task.version != self._version:
            task = self._renewed(task, object_xy, next_xy, region)
            task.version = self._version
        _keep(self._tasks, key, task)
        return task

    def _renewed(
        self,
        before: PlacementTask | None,
        object_xy: Array,
        next_xy: Array | None,
        region: ReachRegion | None,
    ) -> PlacementTask:
        """A task in the present world, with what is still right of the one `before`."""
        ring = self._ring(object_xy, region)
        onward, poses, apart = self._world, np.empty((0, 3)), 0.0
        if next_xy is not None and self.parameters.next_ring:
            poses, apart = self._ring(next_xy, region).free, self.parameters.radius
        elif next_xy is not None:
            poses = np.array([[next_xy[0], next_xy[1], math.nan]])
            onward = self._without_support(next_xy)
        same = before is not None and before.ring is ring
        if before is None or not same or not before.leads_to(poses):
            speeds, inflation = self._speeds, self.parameters.inflation
            first = before.first if before is not None and same else None
            second = None
            if next_xy is not None and len(poses) > 0:
                second = SecondLeg(ring, next_xy, poses, apart, speeds, inflation)
            first = first or FirstLeg(ring, speeds, inflation)
            before = PlacementTask(ring, first, second, self._base, next_xy is not None)
        before.onward_world = onward
        return before

    def _ring(self, target_xy: Array, region: ReachRegion | None) -> Ring:
        """The kept candidates about a target, if what lies near it has not changed."""
        p, base = self.parameters, self._base
        key = (*target_xy.tolist(), *_region_key(region))
        edges = self._edges_near.about(target_xy, p.radius)
        before = self._rings.get(key)
        if before is not None and before[0] is edges:
            return before[1]
        ring = make_ring(
            target_xy, p.radius, p.count, p.headings, edges, base.outline, base.margin, region
        )
        if before is not None and np.array_equal(ring.rejections, before[1].rejections):
            ring = before[1]
        _keep(self._rings, key, (edges, ring))
        return ring

    def _planner_of(self, world: World) -> GlobalPlanner:
        limits = self._limits
        return GlobalPlanner(
            world,
            limits.v_max,
            limits.omega_max,
            inflation=self.parameters.inflation,
            v_reverse=limits.v_reverse,
        )

    def _route(self, world: World, pose: Array, goal: Array) -> Path | None:
        """The path of a result, through the world that it was made for."""
        planner = self.planner if world is self._world else self._planner_of(world)
        return planner.route(pose, goal)

    def _without_support(self, target_xy: Array) -> World:
        ignored = set(self._support_of(target_xy))
        kept = (solid for index, solid in enumerate(self._world.solids) if index not in ignored)
        return self._world.with_solids(kept)

    def _obstacles_at(self, target_xy: Array) -> list[int]:
        """Obstacles that a place lies in or on the edge of; in a hole, it does not."""
        x, y = target_xy.tolist()
        return [
            index
            for index, solid in enumerate(self._world.solids)
            if intersects_xy(Polygon(solid.outline, solid.holes), x, y)
        ]


def _region_key(region: ReachRegion | None) -> Key:
    if region is None:
        return ()
    return (*region.arm_xy.tolist(), region.radius, region.bearing)


def _checked(values: Array, size: int, where: str) -> Array:
    """A copy of the first `size` numbers, if they are finite.

    The kernels would be compiled anew for an array that can't be written to.
    """
    numbers = np.array(values, dtype=float, order="C")
    if numbers.ndim != 1 or len(numbers) < size:
        raise InputError(f"must be {size} numbers", where)
    if not all(map(math.isfinite, numbers[:size].tolist())):
        raise InputError("must be finite numbers", where)
    return numbers if len(numbers) == size else numbers[:size]


def _shown(values: Array) -> Array:
    """What is kept for the next step, as a result shows it: not to be written to."""
    view = values.view()
    view.flags.writeable = False
    return view


def _keep(store: OrderedDict[Key, Kept], key: Key, value: Kept) -> None:
    """Store a value as the latest one; the oldest are dropped."""
    store[key] = value
    store.move_to_end(key)
    if len(store) > _KEPT:
        store.popitem(last=False)
