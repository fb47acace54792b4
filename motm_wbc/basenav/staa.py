"""The local planner: what the base shall do next on its way to a pose."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav import checks
from motm_wbc.basenav.cost_tiles import tiled_cost_to_go
from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.movers import movers_of
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.proximity import sample_outline
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_admissible import Keep, first_actions, margin_left
from motm_wbc.basenav.staa_answer import Answers
from motm_wbc.basenav.staa_arrival import arrival_action
from motm_wbc.basenav.staa_escape import WaysOut, lasts, longest_ways
from motm_wbc.basenav.staa_follow import DURATION, remaining_actions
from motm_wbc.basenav.staa_motion import drive_of
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import NO_ACTIONS, Effort, StaaPlan
from motm_wbc.basenav.staa_root import NOWHERE, Root, keep_of, with_direction
from motm_wbc.basenav.staa_search import Problem
from motm_wbc.basenav.staa_solver import Solver
from motm_wbc.basenav.staa_surroundings import Surroundings
from motm_wbc.basenav.wide_search import WideSearch
from motm_wbc.basenav.window import local_target
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError, NoPath
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

__all__ = ["Goal", "StaaPlan", "StaaStar"]

AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked
_IMMINENT = 1.0  # [s] until a contact, below which no margin is kept from what moves


class StaaStar:
    """Modified STAA* (Missura et al. 2109.07775, with the changes of 2305.08351).

    Attributes:
        limits: speed and acceleration limits of the base.
        parameters: see `StaaParameters`.
    """

    def __init__(
        self,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        parameters: StaaParameters,
        planner: GlobalPlanner,
    ) -> None:
        """Prepare for a world; compiles the kernels if that is still to do.

        Args:
            world: obstacles.
            footprint: (n, 2) convex outline in the base frame [m], any winding.
            limits: speeds and accelerations, > 0 but for `v_reverse` >= 0.
            parameters: of the planner.
            planner: global planner of the same world. From now on it plans in what rests.

        Raises:
            InputError: the footprint or a limit can't be used.
        """
        p = parameters
        self.limits = checks.limits(limits)
        self.parameters = parameters
        self._outline = outline_of(checks.footprint(footprint))
        self._around = Surroundings(world, self._outline, parameters, planner)
        self._samples = sample_outline(self._outline)
        self._drive = drive_of(limits, p.step, p.command_period, p.ramp_steps)
        self._answers = Answers(self._drive, limits, self._outline.radius)
        self._solver = Solver(p, self._answers, p.expansions)
        self._compile()

    @property
    def world(self) -> World:
        """The obstacles, as seen last."""
        return self._around.world

    @property
    def planner(self) -> GlobalPlanner:
        """The global planner whose cost-to-go guides the search: without what moves."""
        return self._around.planner

    def update(self, world: World) -> None:
        """Take the world as it is seen now; call it at each step if something moves.

        Only what has changed is computed anew: where only moving obstacles have moved, that
        is next to nothing.
        """
        self._around.update(world)

    def plan(
        self,
        pose: Array,
        v: float,
        omega: float,
        goal: Goal,
        *,
        keep_in: ReachRegion | None = None,
        object_xy: Array | None = None,
        previous: StaaPlan | None = None,
    ) -> StaaPlan:
        """What to do in the next command period. Never raises.

        The answer depends on the arguments only.

        Args:
            pose: (3,) of the base [m, m, rad].
            v: its speed [m/s].
            omega: its turn rate [rad/s].
            goal: where to go.
            keep_in: once the base is in this region, it stays able to come to rest there.
            object_xy: (2,) the object that the region is about [m].
            previous: the plan of one command period ago, if it was obeyed. Where it was for
                the same goal, it is gone on with unless the search finds a better one: so
                the base doesn't waver, and once a plan reaches the goal, the time that is
                left never grows.
        """
        began = time.thread_time()
        kept = self._what_is_left(previous, goal)
        keep = keep_of(keep_in, object_xy)
        escape = self._way_out_left(previous)
        root, margin = self._root(pose, v, omega, keep, kept, escape)
        if margin < 0.0 or not np.isfinite(goal.pose).all() or not root.admissible.any():
            return self._give_up(root, goal)
        try:
            problem = self._problem(root.pose, goal, margin)
        except (NoPath, InputError):
            return self._give_up(root, goal)
        left = self._cost_to_go(problem, root, goal)
        arrival = arrival_action(problem, root, self.parameters)
        if arrival is not None:
            plan = self._answers.once(root, goal, arrival, reached=True)
            return replace(plan, cost_to_go=left, way_out=self._out(root, arrival))
        detour = previous is not None and previous.detour
        way = self._solver.better(problem, root, kept, detour=detour, began=began)
        if way.action < 0:
            return replace(self._give_up(root, goal, way.effort), cost_to_go=left)
        plan = self._answers.whole(
            root, goal, way.action, way.actions, way.states,
            reached=way.reached, effort=way.effort,
        )  # fmt: skip
        out, safe = self._out(root, way.action, way.actions), self._can_stand(root, way.action)
        return replace(
            plan, cost_to_go=left, detour=way.kept and detour, way_out=out, emergency=not safe
        )

    def _can_stand(self, root: Root, action: int) -> bool:
        """Whether nothing that moves would hit the base soon if it braked after an action."""
        standing = self.parameters.standing
        return root.ways is None or bool(root.ways.can_stand(standing)[action])

    def wide_search(self, pose: Array, goal: Goal) -> WideSearch | None:
        """Begin a search for a base that is stuck, and stands; None: there is no way at all.

        It holds while the base stands there and what rests (`planner.world`) is the same.

        Args:
            pose: (3,) of the base [m, m, rad].
            goal: where to go.
        """
        p = self.parameters
        root, margin = self._root(pose, 0.0, 0.0, NOWHERE, NO_ACTIONS, NO_ACTIONS)
        if margin < 0.0 or not np.isfinite(goal.pose).all() or not root.admissible.any():
            return None
        try:
            problem = self._problem(root.pose, goal, margin)
        except (NoPath, InputError):
            return None
        left = self._cost_to_go(problem, root, goal)
        if left == math.inf:
            return None
        solver = Solver(p, self._answers, p.wide_expansions)
        problem = problem._replace(movers=movers_of(()))
        return WideSearch(solver, problem, root, goal, left, self._answers)

    def _cost_to_go(self, problem: Problem, root: Root, goal: Goal) -> float:
        """Exact time from the base to its goal [s]."""
        x, y, heading = (float(value) for value in root.pose)
        if np.array_equal(problem.goal, goal.pose):
            return float(tiled_cost_to_go(problem.tiles, x, y, heading))
        return float(cost_to_go(self.planner.goal_field(goal.pose, near=root.pose), x, y, heading))

    def brake(self, pose: Array, v: float, omega: float) -> StaaPlan:
        """Come to rest on the present arc, as fast as the limits allow.

        If something that moves would hit the base then, it drives out of its way instead.
        """
        root, margin = self._root(pose, v, omega, NOWHERE, NO_ACTIONS, NO_ACTIONS)
        if margin < 0.0 or not root.admissible[root.brake]:
            return self._give_up(root, None)
        return self._answers.once(root, None, root.brake)

    def _what_is_left(self, previous: StaaPlan | None, goal: Goal) -> Array:
        """(k, 5) actions of a plan that led to the same goal, after one period of it."""
        if previous is None or previous.goal is None:
            return NO_ACTIONS
        if previous.emergency and not previous.reached:
            return NO_ACTIONS
        if not previous.goal.is_same(goal):
            return NO_ACTIONS
        return remaining_actions(previous.actions, self._drive.period)

    def _way_out_left(self, previous: StaaPlan | None) -> Array:
        """(k, 5) what is left of the previous plan's way out, while something moves."""
        if previous is None or len(self._around.movers.discs) == 0:
            return NO_ACTIONS
        return remaining_actions(previous.way_out, self._drive.period)

    def _root(
        self,
        pose: Array,
        v: float,
        omega: float,
        keep: Keep,
        kept: Array,
        escape: Array,
    ) -> tuple[Root, float]:
        """First actions, and the distance that can be kept; negative: the way is blocked."""
        p, pose = self.parameters, np.array(pose, dtype=float)
        known = bool(np.isfinite(pose).all() and math.isfinite(v) and math.isfinite(omega))
        if not known:  # nothing can be said of such a state but that the base should stand
            pose, v, omega = np.nan_to_num(pose, posinf=0.0, neginf=0.0), 0.0, 0.0
        v, omega = self.limits.clip(float(v), float(omega))
        residue = tuple(speed if abs(speed) < AT_REST else 0.0 for speed in (v, omega))
        v, omega = v - residue[0], omega - residue[1]
        edges = self._around.edges
        margin = margin_left(
            self._drive, edges, self._outline, p.margin, with_direction(pose), v, omega
        )
        room = max(margin, 0.0)
        table, clear, admissible, rests = first_actions(
            self._drive,
            edges,
            self._outline,
            keep,
            p.linear_actions,
            p.angular_actions,
            room,
            pose,
            v,
            omega,
            np.vstack([escape[:1], kept[:1]]),
            max(room - 0.5 * p.margin, 0.0),
        )
        ways = None
        if len(self._around.movers.discs):
            first = p.linear_actions * p.angular_actions if len(escape) else -1
            ways = self._ways_out(pose, v, omega, room, table, clear, escape, first)
            admissible &= ways.safe(p.standing, p.lasting)
        root = Root(pose, v, omega, residue, room, table, clear, admissible, ways, rests)
        return root, margin if known else -1.0

    def _ways_out(
        self,
        pose: Array,
        v: float,
        omega: float,
        margin: float,
        table: Array,
        clear: NDArray[np.bool_],
        escape: Array,
        first: int,
    ) -> WaysOut:
        """The longest way out that begins with each first action.

        That of the last step, `escape` (k, 5), begins with the action of index `first`.
        """
        p, around, place = self.parameters, self._around, with_direction(pose)
        for kept, growth in ((margin, 1.0), (0.5 * margin, 0.5), (0.0, 0.0)):
            ways = WaysOut(
                *longest_ways(
                    self._drive, around.edges, around.movers, self._outline, kept, growth,
                    p.escape_horizon, place, v, omega, table, clear, escape, first,
                ),
                escape,
            )  # fmt: skip
            if ways.times.max() > _IMMINENT:
                break  # else something is within the margin: it may not be touched
        return ways

    def _problem(self, pose: Array, goal: Goal, margin: float) -> Problem:
        p = self.parameters
        target, stop = np.array(goal.pose, dtype=float), bool(goal.stop)
        if p.local_target == "window":
            target, is_goal = local_target(self.planner, pose, target, p.window, p.window_ahead)
            stop = stop and is_goal
        tiles = self._around.tiles_about(pose, target)
        ahead = tiled_cost_to_go(tiles, float(pose[0]), float(pose[1]), float(pose[2]))
        share = max(p.proximity_floor, min(ahead / p.proximity_horizon, 1.0))
        return Problem(
            drive=self._drive,
            world=self._around.edges,
            outline=self._outline,
            grid=self._around.grid_about(pose),
            samples=self._samples,
            tiles=tiles,
            movers=self._around.movers,
            moving=p.moving_weight,
            start=np.array(with_direction(pose)),
            goal=target,
            stop=stop,
            goal_distance=p.goal_distance,
            goal_angle=p.goal_angle,
            docking=p.docking_accuracy,
            margin=margin,
            proximity=share * p.proximity_weight,
            weight=p.heuristic_weight,
            cell=p.cell,
            headings=p.headings,
            half_window=0.5 * p.window,
            window_ahead=p.window_ahead,
        )

    def _give_up(self, root: Root, goal: Goal | None, effort: Effort | None = None) -> StaaPlan:
        """Brake; if something that moves would hit the base then, the way out that is best."""
        action = self._best_way_out(root, goal)
        plan = self._answers.once(root, goal, action, emergency=True, effort=effort)
        return replace(plan, way_out=self._out(root, action))

    def _best_way_out(self, root: Root, goal: Goal | None) -> int:
        """The brake; if something that moves would hit the base then, what avoids it."""
        p = self.parameters
        if root.ways is None:
            return root.brake
        left = self._left_after(root.ways.ends, goal)
        return root.ways.best(p.standing, p.lasting, left)

    def _left_after(self, poses: Array, goal: Goal | None) -> Array:
        """(n,) exact time from poses (n, 3) to the goal [s], 0 if there is none."""
        if goal is None or not np.isfinite(goal.pose).all():
            return np.zeros(len(poses))
        try:
            field = self.planner.goal_field(goal.pose)
        except NoPath:
            return np.zeros(len(poses))
        return np.array([cost_to_go(field, *pose) for pose in poses.tolist()])

    def _out(self, root: Root, action: int, planned: Array = NO_ACTIONS) -> Array:
        """(k, 5) way out after an action: what is planned (k, 5), if it lasts."""
        if root.ways is None:
            return NO_ACTIONS
        if len(planned) == 0 or self._time_of(root, planned) < math.inf:
            return root.ways.actions(self._drive, root.table, action)
        return planned

    def _time_of(self, root: Root, actions: Array) -> float:
        """How long actions (k, 5), braking and standing meet nothing that moves [s]."""
        around, pose = self._around, with_direction(root.pose)
        return float(
            lasts(
                self._drive, around.edges, around.movers, self._outline, root.margin,
                self.parameters.escape_horizon, pose, root.v, root.omega, actions,
            )
        )  # fmt: skip

    def _compile(self) -> None:
        """Run every kernel once, so that no later call has to wait for the compiler."""
        pose = np.zeros(3)
        root, _ = self._root(pose, 0.0, 0.0, NOWHERE, NO_ACTIONS, NO_ACTIONS)
        try:
            problem = self._problem(pose, Goal(pose, stop=True), 0.0)
        except (NoPath, InputError):
            return
        root.admissible[:] = True
        ways = self._ways_out(pose, 0.0, 0.0, 0.0, root.table, root.clear, NO_ACTIONS, -1)
        self._out(replace(root, ways=ways), root.brake, np.zeros((1, 5)))
        arrival_action(problem, root, self.parameters)
        stand = np.zeros((1, 5))
        stand[0, DURATION] = self._drive.period
        self._solver.better(problem, root, stand, detour=False, began=time.thread_time())
