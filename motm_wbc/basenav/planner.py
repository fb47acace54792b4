"""The global planner: the fastest path of a disc, turning included, exactly."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from shapely.geometry import Point, Polygon

from motm_wbc.basenav.checks import PoseLike, not_negative, pose_of, positive
from motm_wbc.basenav.field_solver import GoalRoutes, solve_field
from motm_wbc.basenav.goal_field import GoalField
from motm_wbc.basenav.inflated import Inflated
from motm_wbc.basenav.outlines import EVERYWHERE
from motm_wbc.basenav.pathrtr import BACKWARD, Speeds, path_time
from motm_wbc.basenav.rooms import may_be_joined
from motm_wbc.basenav.tracing import trace
from motm_wbc.basenav.visibility import push_out
from motm_wbc.basenav.walls import TOUCH
from motm_wbc.basenav.world import World, checked_radius
from motm_wbc.errors import NoPath
from motm_wbc.geometry.arrays import Array

_FieldKey: TypeAlias = tuple[float, float, float, Inflated]
_KEPT_FIELDS = 32
_DETOUR = 1.05  # length of the first ellipse over the distance of its foci
_MANY_CORNERS = 1000  # from which on the graph takes longer than uniting the whole world
_ENDLESS = 1e9  # [m] from which length on the whole world is asked for
_GROWTH = 1.5  # least growth of an ellipse that was too short


@dataclass(frozen=True)
class Path:
    """A polyline that the base can drive.

    Attributes:
        points: (k, 2) from start to goal [m]; one point if they are one place.
        length: [m].
        time: PathRTR [s]; what was pushed out counts with its distance at full speed.
        backward: it is driven in reverse.
        start_push: distance from the start to the nearest free point, where the start lies
            inside an inflated obstacle; else 0 [m].
        goal_push: the same of the goal [m].
    """

    points: Array
    length: float
    time: float
    backward: bool
    start_push: float = 0.0
    goal_push: float = 0.0


class GlobalPlanner:
    """Exact PathRTR paths of a disc over the tangent visibility graph.

    A path is searched among what meets an ellipse about its ends (`World.near`), which is
    enlarged until the path is no longer than it allows: then it is the whole world's. The
    lengths grow by half at least, up to all that there is; that bounds the time. Before a
    large graph is built, places in different rooms are told apart without one.

    Attributes:
        world: the world planned in.
        speeds: speeds of the base.
    """

    def __init__(
        self,
        world: World,
        v_max: float,
        omega_max: float,
        inflation: float = 0.0,
        v_reverse: float = 0.0,
    ) -> None:
        """Prepare the planner; graphs are built when they are first needed.

        Args:
            world: obstacles.
            v_max: forward speed, > 0 [m/s].
            omega_max: turn rate, > 0 [rad/s].
            inflation: radius of the disc, >= 0 [m].
            v_reverse: speed in reverse, >= 0 [m/s]; 0 forbids reversing.

        Raises:
            InputError: a number is not in its range.
        """
        self.world = world
        self.speeds = Speeds(
            forward=positive(v_max, "v_max"),
            backward=not_negative(v_reverse, "v_reverse"),
            turning=positive(omega_max, "omega_max"),
        )
        self._inflation = checked_radius(inflation)
        self._fields: OrderedDict[_FieldKey, tuple[GoalField, GoalRoutes]] = OrderedDict()

    @property
    def inflated(self) -> Inflated:
        """The whole free space of a disc of radius `inflation`."""
        return self.world.inflated(self._inflation)

    def update(self, world: World) -> None:
        """Plan in another world from now on.

        If it was made from the one before (`World.after`, `World.transformed`), what was
        solved where nothing has moved is kept.
        """
        self.world = world

    def goal_field(
        self, goal: PoseLike, near: PoseLike | None = None, reach: float = 0.0
    ) -> GoalField:
        """Times from everywhere to a goal, for `cost_to_go`; kept for the next call.

        A goal inside an inflated obstacle is pushed out to the nearest free point, the
        distance counting at full speed.

        With a pose `near`, the times are those of what meets an ellipse about it and the
        goal. They are exact from `near`, and from every pose within `reach` of it from
        which the path found is longer by `reach` at most: the ellipse allows the length of
        the path from `near` and two reaches more, one for that path, one for the way
        between the two poses. Beyond, and where there is no path from `near`, they are lower
        bounds; see `cost_to_go` for poses inside inflated obstacles. A time is infinite only
        if the whole world has no path.

        Args:
            goal: x, y [m], heading [rad], None or NaN: free.
            near: the same; None: everywhere.
            reach: [m].

        Raises:
            InputError: a pose is not finite, or the reach is negative or not finite.
        """
        end = pose_of(goal, "goal")
        if near is None:
            return self._solved(end, self.inflated)[0]
        spare = 2.0 * not_negative(reach, "reach")
        inflated, _ = self._search(pose_of(near, "near"), end, spare)
        return self._solved(end, inflated)[0]

    def plan(self, start: PoseLike, goal: PoseLike) -> Path:
        """The fastest path.

        Start and goal may lie inside an inflated obstacle, but neither inside an obstacle nor
        outside the boundary: they are then pushed out to the nearest free point, and the path
        says so.

        Args:
            start: x, y [m], heading [rad], None or NaN: free.
            goal: the same.

        Raises:
            InputError: start or goal is not finite.
            NoPath: there is none.
        """
        begin, end = pose_of(start, "start"), pose_of(goal, "goal")
        for name, pose in (("start", begin), ("goal", end)):
            if self._is_in_obstacle(pose):
                where = "outside the boundary" if self._is_outside(pose) else "inside an obstacle"
                raise NoPath(f"the {name} {_text(pose)} lies {where}")
        path = self.route(begin, end)
        if path is None:
            raise NoPath(f"there is no path from {_text(begin)} to {_text(end)}")
        return path

    def route(self, start: Array, goal: Array) -> Path | None:
        """As `plan`, but None if there is no path, and from inside obstacles as well.

        Args:
            start: (3,) finite, heading NaN: free.
            goal: the same.
        """
        return self._search(start, goal, 0.0)[1]

    def _search(self, start: Array, goal: Array, spare: float) -> tuple[Inflated, Path | None]:
        """The fastest path, and the part of the world it was found in.

        It is right for paths that are longer by `spare` [m]. If there is no path, it is the
        largest part that was searched for one.
        """
        searched: Inflated | None = None
        apart = math.dist(start[:2], goal[:2])
        length = _rung(_DETOUR * apart + 4.0 * self._inflation + spare)
        while True:
            inflated = self.world.near(self._inflation, start[:2], goal[:2], length)
            corners = len(inflated.walls.corners)
            if corners > _MANY_CORNERS and not may_be_joined(self.inflated.walls, start, goal):
                return searched or inflated, None
            field, routes = self._solved(goal, inflated)
            path = self._path(field, routes, inflated, start, goal)
            if path is None:  # for good, if the goal is where it would be in the whole world
                entry = field.goals[0, :2]
                needed = math.dist(start[:2], entry) + math.dist(entry, goal[:2])
            else:
                needed = path.length + spare
            if inflated.covers(start, goal, needed):
                return inflated, path
            searched = inflated
            length = _rung(max(needed, _GROWTH * length))

    def _path(
        self,
        field: GoalField,
        routes: GoalRoutes,
        inflated: Inflated,
        start: Array,
        goal: Array,
    ) -> Path | None:
        """The fastest path in a part of the world."""
        inner, gear, start_push = trace(field, routes, inflated.graph, *start)
        if len(inner) == 0:
            return None
        inner = _distinct(inner)
        backward = gear == BACKWARD
        time = path_time(inner, _heading(start), _heading(goal), self.speeds, backward)
        goal_push = float(math.dist(goal[:2], field.goals[0, :2]))
        whole = [inner]
        if start_push > 0.0:
            whole.insert(0, start[None, :2])
        if goal_push > 0.0:
            whole.append(goal[None, :2])
        line = np.vstack(whole)
        steps = np.diff(line, axis=0)
        return Path(
            points=line,
            length=float(np.hypot(steps[:, 0], steps[:, 1]).sum()),
            time=time + (start_push + goal_push) / self.speeds.forward,
            backward=backward,
            start_push=start_push,
            goal_push=goal_push,
        )

    def _is_in_obstacle(self, pose: Array) -> bool:
        """Whether a place lies inside an obstacle itself, or outside the boundary."""
        walls = self.world.near(0.0, pose, pose, 0.0).walls
        return bool(push_out(walls, pose[0], pose[1], np.empty(2)) > TOUCH)

    def _is_outside(self, pose: Array) -> bool:
        boundary = self.world.boundary
        return boundary is not None and not Polygon(boundary).contains(Point(pose[:2]))

    def _solved(self, goal: Array, inflated: Inflated) -> tuple[GoalField, GoalRoutes]:
        x, y, heading = goal.tolist()
        key = (x, y, math.inf if math.isnan(heading) else heading, inflated)
        if key in self._fields:
            self._fields.move_to_end(key)
            return self._fields[key]
        solved = self.solve(goal[None], inflated)
        self._fields[key] = solved
        if len(self._fields) > _KEPT_FIELDS:
            self._fields.popitem(last=False)
        return solved

    def solve(self, goals: Array, inflated: Inflated | None = None) -> tuple[GoalField, GoalRoutes]:
        """Field of the time to the best of some goals (g, 3); not kept.

        Goals inside inflated obstacles are pushed out to the nearest free point.

        Args:
            goals: (g, 3) finite, heading NaN: free.
            inflated: part of the world's free space (`World.near`); None: all of it.
        """
        space = self.inflated if inflated is None else inflated
        rows = np.empty((goals.shape[0], 4))
        for row, pose in zip(rows, goals, strict=True):
            push = push_out(space.walls, pose[0], pose[1], row)
            if push <= TOUCH or math.isinf(push):
                row[:2] = pose[:2]
            row[2] = pose[2]
            row[3] = push / self.speeds.forward if push > TOUCH else 0.0
        solved: tuple[GoalField, GoalRoutes] = solve_field(
            space.walls,
            space.graph,
            rows,
            self.speeds,
            EVERYWHERE if space.ellipse is None else space.ellipse,
        )
        return solved


def _rung(length: float) -> float:
    """The next of few lengths [m], so that near places share what is derived."""
    if not 0.0 < length < _ENDLESS:
        return 0.0 if length <= 0.0 else math.inf
    return float(2.0 ** (math.ceil(8.0 * math.log2(length)) / 8.0))


def _heading(pose: Array) -> float | None:
    return None if math.isnan(pose[2]) else float(pose[2])


def _text(pose: Array) -> str:
    return f"({pose[0]:g}, {pose[1]:g})"


def _distinct(points: Array) -> Array:
    """Points without those that repeat the one before."""
    steps = np.diff(points, axis=0)
    moved = np.hypot(steps[:, 0], steps[:, 1]) > TOUCH
    return np.asarray(points[np.concatenate([[True], moved])])
