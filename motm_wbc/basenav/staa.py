"""The local planner: what the base shall do next on its way to a pose."""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.cost_tiles import tiled_cost_to_go
from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.movers import meets_mover
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.proximity import sample_outline
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_admissible import ACCELERATION, ALPHA, Keep, first_actions, margin_left
from motm_wbc.basenav.staa_answer import Answers
from motm_wbc.basenav.staa_escape import contact_times, escape
from motm_wbc.basenav.staa_follow import follow, remaining_actions
from motm_wbc.basenav.staa_goal import remaining_error
from motm_wbc.basenav.staa_kernel import actions_to, advance, start
from motm_wbc.basenav.staa_motion import drive_of, stopping_duration
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import Effort, StaaPlan
from motm_wbc.basenav.staa_root import NOWHERE, Root, check_inputs, keep_of, with_direction
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
from motm_wbc.basenav.staa_surroundings import Surroundings
from motm_wbc.basenav.window import local_target
from motm_wbc.basenav.world import World
from motm_wbc.errors import NoPath
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

__all__ = ["Goal", "StaaPlan", "StaaStar"]

_AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked
_CHUNK = 50  # expansions between two looks at the clock
_NO_ACTIONS = np.zeros((0, 5))


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
            planner: global planner of the same world.

        Raises:
            InputError: the footprint or a limit can't be used.
        """
        check_inputs(footprint, limits)
        p = parameters
        self.limits = limits
        self.parameters = parameters
        self._outline = outline_of(footprint)
        self._around = Surroundings(world, self._outline, parameters, planner)
        self._samples = sample_outline(self._outline)
        self._drive = drive_of(limits, p.step, p.command_period, p.ramp_steps)
        self._answers = Answers(self._drive, limits, self._outline.radius)
        self._memory = memory_for(p.expansions, p.linear_actions, p.angular_actions, p.checks)
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
            previous: the plan of one command period ago, if it was obeyed. Where it led to
                the same goal, it is gone on with unless the search finds a cheaper one: so
                the time that is left never grows from plan to plan.
        """
        began = time.thread_time()
        kept = self._what_is_left(previous, goal)
        root, margin = self._root(pose, v, omega, keep_of(keep_in, object_xy), kept[:1])
        if margin < 0.0 or not np.isfinite(goal.pose).all() or not root.admissible.any():
            return self._give_up(root, goal)
        try:
            problem = self._problem(root.pose, goal, margin)
        except NoPath:
            return self._give_up(root, goal)
        if problem.stop:
            docking = self._docking_action(problem, root)
            if docking is not None:
                return self._answers.once(root, goal, docking, reached=True)
        elif self._is_past(root, problem.goal):
            holding = self._holding_action(root)
            if holding is not None:
                return self._answers.once(root, goal, holding, reached=True)
        return self._best_plan(problem, root, goal, kept, began)

    def brake(self, pose: Array, v: float, omega: float) -> StaaPlan:
        """Come to rest on the present arc, as fast as the limits allow.

        If something that moves would hit the base then, it drives out of its way instead.
        """
        root, margin = self._root(pose, v, omega, NOWHERE, _NO_ACTIONS)
        if margin < 0.0 or not root.admissible[root.brake]:
            return self._give_up(root, None)
        return self._answers.once(root, None, root.brake)

    def _what_is_left(self, previous: StaaPlan | None, goal: Goal) -> Array:
        """(k, 5) actions of a plan that led to the same goal, after one period of it."""
        if previous is None or previous.goal is None or not previous.reached:
            return _NO_ACTIONS
        same = previous.goal.stop == goal.stop and np.array_equal(previous.goal.pose, goal.pose)
        return remaining_actions(previous.actions, self._drive.period) if same else _NO_ACTIONS

    def _root(
        self, pose: Array, v: float, omega: float, keep: Keep, extra: Array
    ) -> tuple[Root, float]:
        """First actions, and the distance that can be kept; negative: the way is blocked."""
        p = self.parameters
        pose = np.array(pose, dtype=float)
        known = bool(np.isfinite(pose).all() and math.isfinite(v) and math.isfinite(omega))
        if not known:  # nothing can be said of such a state but that the base should stand
            pose, v, omega = np.nan_to_num(pose, posinf=0.0, neginf=0.0), 0.0, 0.0
        v, omega = self.limits.clip(float(v), float(omega))
        residue = tuple(speed if abs(speed) < _AT_REST else 0.0 for speed in (v, omega))
        v, omega = v - residue[0], omega - residue[1]
        edges = self._around.edges
        margin = margin_left(
            self._drive, edges, self._outline, p.margin, with_direction(pose), v, omega
        )
        table, clear, admissible, rests = first_actions(
            self._drive,
            edges,
            self._outline,
            keep,
            p.linear_actions,
            p.angular_actions,
            max(margin, 0.0),
            pose,
            v,
            omega,
            extra,
        )
        if len(self._around.movers.discs):
            admissible &= self._meets_nothing(pose, v, omega, table)
        kept = max(margin, 0.0)
        root = Root(pose, v, omega, residue, kept, table, clear, admissible, rests)
        return root, margin if known else -1.0

    def _meets_nothing(
        self, pose: Array, v: float, omega: float, table: Array
    ) -> NDArray[np.bool_]:
        """(n,) whether the base can brake and stand after an action, for all that moves."""
        movers, outline, place = self._around.movers, self._outline, with_direction(pose)
        margin = self.parameters.margin
        if meets_mover(movers, outline, margin, *place, 0.0):
            margin = 0.0  # inside the margin it may go on, but not be touched
        times = contact_times(
            self._drive, movers, outline, margin, self.parameters.standing, place, v, omega, table
        )
        return np.asarray(times == math.inf)

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

    def _best_plan(
        self, problem: Problem, root: Root, goal: Goal, kept: Array, began: float
    ) -> StaaPlan:
        """The better of a new plan and what is left of the previous one."""
        action, actions, effort = self._search(problem, root, began)
        states, cost = self._follow(problem, root, actions)
        if len(kept) and root.admissible[root.brake - 1]:
            kept_states, kept_cost = self._follow(problem, root, kept)
            if kept_cost < math.inf and kept_cost <= cost:
                action, actions, states, cost = root.brake - 1, kept, kept_states, kept_cost
        if action < 0:
            return self._give_up(root, goal, effort)
        return self._answers.whole(
            root, goal, action, actions, states, reached=cost < math.inf, effort=effort
        )

    def _search(self, problem: Problem, root: Root, began: float) -> tuple[int, Array, Effort]:
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

    def _follow(self, problem: Problem, root: Root, actions: Array) -> tuple[Array, float]:
        return follow(problem, root.pose[2], root.v, root.omega, actions, self.parameters.checks)

    def _docking_action(self, problem: Problem, root: Root) -> int | None:
        """What to do if braking now would end at the goal: brake, or come nearer first.

        The step of the search is too coarse to stop at a point; here commands are compared
        by the error that is left when the base brakes after them. At rest it stays.
        """
        x, y, heading = (float(value) for value in root.pose)
        error, duration = remaining_error(problem, 1.0, x, y, heading, root.v, root.omega)
        if math.isinf(error) or not root.admissible[root.brake]:
            return None
        best, least = root.brake, problem.docking * error + duration
        if root.v == 0.0 and root.omega == 0.0:
            return best
        period = self._drive.period
        for index in np.flatnonzero(root.admissible[:-1]):
            x, y, heading = (float(value) for value in root.rests[index])
            error, _ = remaining_error(problem, 1.0, x, y, heading, 0.0, 0.0)
            a, alpha = root.table[index, ACCELERATION], root.table[index, ALPHA]
            after = stopping_duration(self._drive, root.v + a * period, root.omega + alpha * period)
            cost = problem.docking * error + period + after
            if cost < least:
                best, least = int(index), cost
        return best

    def _is_past(self, root: Root, goal: Array) -> bool:
        """Whether a goal to be driven through is within tolerance and no longer ahead."""
        p = self.parameters
        offset = goal[:2] - root.pose[:2]
        if math.hypot(*offset) > p.goal_distance:
            return False
        if abs(wrap(goal[2] - root.pose[2])) > p.goal_angle:
            return False
        direction = np.array([math.cos(root.pose[2]), math.sin(root.pose[2])])
        return float(offset @ direction) * (1.0 if root.v >= 0.0 else -1.0) <= 0.0

    def _holding_action(self, root: Root) -> int | None:
        """Keep the velocity, if that is safe: a goal driven through is no reason to slow."""
        p = self.parameters
        hold = (p.linear_actions // 2) * p.angular_actions + p.angular_actions // 2
        return next((action for action in (hold, root.brake) if root.admissible[action]), None)

    def _give_up(self, root: Root, goal: Goal | None, effort: Effort | None = None) -> StaaPlan:
        """Brake; if something that moves would hit the base then, what delays it longest."""
        stops = root.admissible[root.brake]
        action = root.brake if stops else self._way_out(root)
        return self._answers.once(root, goal, action, emergency=True, effort=effort)

    def _way_out(self, root: Root) -> int:
        """What delays a contact with something that moves longest."""
        edges, movers, outline = self._around.edges, self._around.movers, self._outline
        pose, horizon = with_direction(root.pose), self.parameters.escape_horizon
        return int(
            escape(
                self._drive, edges, movers, outline, root.margin, horizon, pose, root.v, root.omega,
                root.table, root.clear,
            )
        )  # fmt: skip

    def _compile(self) -> None:
        """Run every kernel once, so that no later call has to wait for the compiler."""
        pose = np.zeros(3)
        root, _ = self._root(pose, 0.0, 0.0, NOWHERE, _NO_ACTIONS)
        try:
            problem = self._problem(pose, Goal(pose, stop=True), 0.0)
        except NoPath:
            return
        root.admissible[:] = True
        self._meets_nothing(pose, 0.0, 0.0, root.table)
        self._way_out(root)
        self._docking_action(problem, root)
        self._follow(problem, root, self._search(problem, root, time.thread_time())[1])
