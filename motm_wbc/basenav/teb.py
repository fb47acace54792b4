"""The Timed Elastic Band: a local planner that optimises one trajectory, as a baseline.

Rösmann, Feiten, Wösch, Hoffmann, Bertram, "Trajectory modification considering dynamic
constraints of autonomous robots" (ROBOTIK 2012) and "Efficient trajectory optimization using a
sparse model" (ECMR 2013): poses and the durations between them are the unknowns of a weighted
least-squares problem, solved anew in every command period from the last one's answer.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.planner import GlobalPlanner, Path
from motm_wbc.basenav.staa_motion import drive_of
from motm_wbc.basenav.staa_root import check_inputs
from motm_wbc.basenav.teb_band import (
    Band,
    band_along,
    cut,
    gone_along,
    joined,
    with_goal,
)
from motm_wbc.basenav.teb_obstacles import footprint_sides
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.teb_plan import TebPlan, band_states, braking_states, pose_at_rest
from motm_wbc.basenav.teb_residuals import Ends, Terms, terms_of, ways
from motm_wbc.basenav.teb_safety import Safety, State, free_time
from motm_wbc.basenav.teb_solver import optimised
from motm_wbc.basenav.teb_world import is_same, planner_of_still, scene_of
from motm_wbc.basenav.world import World
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked
_SOON = 2.0  # [s] before which a band must be free; what it touches later, it may yet avoid
_PATIENCE = 20  # commands refused in a row after which the band is given up
_SLOW = 1.3  # times as long as the global path: a new band is tried
_WORTH = 0.8  # share of its duration for which a band is changed
_SPLITS = 2  # times as many intervals as the horizon has, at most


class _Found(NamedTuple):
    """A band, optimised.

    Attributes:
        band: it.
        cost: sum of its squared residuals.
        free: time for which it touches nothing [s], infinite if nowhere.
        whole: it ends at the goal.
    """

    band: Band
    cost: float
    free: float
    whole: bool


class TimedElasticBand:
    """A `LocalPlanner` that keeps one band from step to step.

    Attributes:
        world: the obstacles.
        limits: speed and acceleration limits of the base.
        parameters: see `TebParameters`.
        planner: the global planner whose path the band begins as.
    """

    def __init__(
        self,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        parameters: TebParameters,
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
        self.world, self.limits, self.parameters = world, limits, parameters
        moves = any(solid.moves for solid in world.solids)
        self.planner = planner_of_still(planner, world) if moves else planner
        p = parameters
        self._outline = outline_of(footprint)
        self._footprint = footprint_sides(footprint)
        self._drive = drive_of(limits, p.interval, p.command_period, p.ramp_steps)
        self._terms: Terms = terms_of(limits, p)
        self._scene = scene_of(world, self._outline, p.margin)
        self._found: _Found | None = None
        self._goal: Goal | None = None
        self._refused = 0  # commands in a row
        for _ in range(2):  # compiles what the first and what later steps call
            self.plan(np.zeros(3), 0.0, 0.0, Goal(np.array([1.0, 0.0, 0.0])))
        self._found = None

    def update(self, world: World) -> None:
        """Take another world, seen from now on; what still stands there is not done again."""
        scene = scene_of(world, self._outline, self.parameters.margin, self._scene)
        if not is_same(scene.still, scene.boundary, self._scene):
            self.planner = planner_of_still(self.planner, world)
        self.world, self._scene = world, scene

    def plan(self, pose: Array, v: float, omega: float, goal: Goal) -> TebPlan:
        """What to do in the next command period. Never raises.

        The answer depends on the arguments and on the band that the last call has left.
        """
        state, safety = self._begin(pose, v, omega)
        target = np.array(goal.pose, dtype=float)
        if safety.room < 0.0 or target.shape != (3,) or not np.isfinite(target).all():
            return self._stop(state, safety, emergency=True)
        if goal.stop and self._is_docked(state, target):
            return self._stop(state, safety, reached=True)
        if not goal.stop and self._is_past(state, target) and safety.allows((0.0, 0.0)):
            return self._answer(state, safety, (0.0, 0.0), reached=True)
        return self._follow(state, safety, Goal(target, bool(goal.stop)))

    def brake(self, pose: Array, v: float, omega: float) -> TebPlan:
        """Come to rest on the present arc, as fast as the limits allow."""
        state, safety = self._begin(pose, v, omega)
        return self._stop(state, safety, emergency=safety.room < 0.0)

    def _begin(self, pose: Array, v: float, omega: float) -> tuple[State, Safety]:
        """The state, of which nothing is assumed, and what is safe in it."""
        pose = np.array(pose, dtype=float)
        known = pose.shape == (3,) and bool(np.isfinite([*pose, v, omega]).all())
        if not known:  # nothing can be said of such a state but that the base should stand
            pose, v, omega = np.zeros(3), 0.0, 0.0
        v, omega = self.limits.clip(float(v), float(omega))
        residue = [speed if abs(speed) < _AT_REST else 0.0 for speed in (v, omega)]
        state = State(pose, v - residue[0], omega - residue[1], (residue[0], residue[1]))
        return state, Safety(
            self._drive, self._scene, self._outline, self._footprint,
            self.parameters.margin, state, known,
        )  # fmt: skip

    def _is_docked(self, state: State, target: Array) -> bool:
        """Whether braking now, or staying at rest, ends at the goal."""
        p = self.parameters
        rest = pose_at_rest(self._drive, state)
        away, turned = math.dist(rest[:2], target[:2]), abs(wrap(target[2] - rest[2]))
        if state.v == 0.0 and state.omega == 0.0:
            return away <= p.goal_distance and turned <= p.goal_angle
        return away <= p.docking_distance and turned <= p.docking_angle

    def _is_past(self, state: State, target: Array) -> bool:
        """Whether a goal to be driven through is within tolerance and no longer ahead."""
        p, (x, y, heading) = self.parameters, state.pose
        dx, dy = target[0] - x, target[1] - y
        if math.hypot(dx, dy) > p.goal_distance or abs(wrap(target[2] - heading)) > p.goal_angle:
            return False
        ahead = math.cos(heading) * dx + math.sin(heading) * dy
        return ahead * (1.0 if state.v >= 0.0 else -1.0) <= 0.0

    def _follow(self, state: State, safety: Safety, goal: Goal) -> TebPlan:
        """The first command of the best band that may be given out; else brake."""
        best, restarted = self._best(state, goal, safety)
        self._found, self._goal = best, goal
        if best is not None:
            command = safety.nearest(self._command(best.band, state))
            self._refused = 0 if command is not None else self._refused + 1
            if command is not None:
                reached = best.whole and math.isinf(best.free)
                return self._answer(
                    state, safety, command, best, restarted=restarted, reached=reached
                )
        return self._stop(state, safety, emergency=True)

    def _kept(self, state: State, goal: Goal) -> tuple[Band, bool] | None:
        """The last band from here on, led to the goal; whether it ends there."""
        p, found, last = self.parameters, self._found, self._goal
        if found is None or last is None or self._refused >= _PATIENCE:
            self._refused = 0
            return None
        moved, turned = goal.pose - last.pose, wrap(goal.pose[2] - last.pose[2])
        if math.hypot(moved[0], moved[1]) > p.restart_distance or abs(turned) > p.restart_angle:
            return None
        band = Band(*gone_along(*found.band, state.pose, self._outline.radius))
        if found.whole:
            return with_goal(band, goal.pose), True
        if band.duration > 0.5 * p.horizon:
            return band, False
        route = self.planner.route(band.poses[-1], goal.pose)
        if route is None:
            return None
        tail = self._along(route, route.backward, band.poses[-1], goal.pose)
        return self._shortened(joined(band, tail))

    def _best(self, state: State, goal: Goal, safety: Safety) -> tuple[_Found | None, bool]:
        """The band kept from the last step, or one made anew; whether it is new.

        A new one is looked for if the last one meets something soon, or takes much longer
        than the global path; one in the other gear if that meets something soon as well.
        """
        begun = self._kept(state, goal)
        kept = self._optimised(*begun, state, goal, safety) if begun else None
        route = self.planner.route(state.pose, goal.pose)
        if kept is not None:
            slow = route is not None and kept.band.duration > _SLOW * (route.time + _SOON)
            if kept.free >= _SOON and not slow:
                return kept, False
        best = kept
        for backward in self._gears(route):
            band, whole = self._shortened(self._along(route, backward, state.pose, goal.pose))
            fresh = self._optimised(band, whole, state, goal, safety)
            if best is None or _is_better(fresh, best):
                best = fresh
            if best.free >= _SOON:
                break
        return best, best is not kept

    def _gears(self, route: Path | None) -> tuple[bool, ...]:
        """In which a path can be driven, its own first; none without a path."""
        if route is None:
            return ()
        if self.limits.v_reverse == 0.0:
            return (False,)
        return route.backward, not route.backward

    def _along(self, route: Path, backward: bool, begin: Array, goal: Array) -> Band:
        interval = self.parameters.interval
        return band_along(route.points, backward, begin, goal, self.limits, interval)

    def _shortened(self, band: Band) -> tuple[Band, bool]:
        short = cut(band, self.parameters.horizon)
        return short, len(short.intervals) == len(band.intervals)

    def _optimised(
        self, band: Band, whole: bool, state: State, goal: Goal, safety: Safety
    ) -> _Found:
        p = self.parameters
        ends = Ends(state.v, state.omega, goal.stop and whole)
        most = _SPLITS * math.ceil(p.horizon / p.interval)
        band, cost = optimised(
            band, self._terms, ends, self._footprint, self._scene.parts, self._outline.radius,
            outer=p.outer_iterations, inner=p.inner_iterations, growth=p.obstacle_growth,
            interval=p.interval, slack=p.interval_slack, most=most,
        )  # fmt: skip
        free = free_time(self._scene.edges, self._outline, safety.room, *band)
        return _Found(band, cost, free, whole)

    def _command(self, band: Band, state: State) -> tuple[float, float]:
        """Accelerations of the band's beginning, within all limits."""
        limits, period = self.limits, self._drive.period
        v, omega = ways(band.poses[:2])[0] / band.intervals[0]
        lead = max(period, 0.5 * float(band.intervals[0]))  # the mean holds at half the interval
        a = _within(float(v - state.v) / lead, limits.a_max)
        alpha = _within(float(omega - state.omega) / lead, limits.alpha_max)
        v, omega = limits.clip(state.v + a * period, state.omega + alpha * period)
        return (
            _within((v - state.v) / period, limits.a_max),
            _within((omega - state.omega) / period, limits.alpha_max),
        )

    def _stop(
        self, state: State, safety: Safety, *, emergency: bool = False, reached: bool = False
    ) -> TebPlan:
        return self._answer(state, safety, safety.brake, emergency=emergency, reached=reached)

    def _answer(
        self,
        state: State,
        safety: Safety,
        command: tuple[float, float],
        found: _Found | None = None,
        *,
        reached: bool = False,
        emergency: bool = False,
        restarted: bool = False,
    ) -> TebPlan:
        period = self._drive.period
        braking = braking_states(self._drive, self._outline.radius, state, command)
        if found is None:
            states = np.vstack([[0.0, *state.pose, state.v, state.omega], braking])
        else:
            states = band_states(found.band, state)
        a, alpha = command
        return TebPlan(
            acceleration=(
                _within(a - state.residue[0] / period, self.limits.a_max),
                _within(alpha - state.residue[1] / period, self.limits.alpha_max),
            ),
            poses=states[:, :4],
            velocities=states[:, 4:],
            braking=braking[:, 1:4],
            reached=reached,
            emergency=emergency,
            restarted=restarted,
        )


def _is_better(fresh: _Found, kept: _Found) -> bool:
    """Whether a band is worth changing to: nothing soon in the way, or clearly sooner there."""
    if min(fresh.free, _SOON) != min(kept.free, _SOON):
        return fresh.free > kept.free
    return math.isinf(fresh.free) and fresh.band.duration < _WORTH * kept.band.duration


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
