"""The Timed Elastic Band: a local planner that optimises one trajectory, as a baseline.

Rösmann, Feiten, Wösch, Hoffmann, Bertram, "Trajectory modification considering dynamic
constraints of autonomous robots" (ROBOTIK 2012) and "Efficient trajectory optimization using a
sparse model" (ECMR 2013): poses and the durations between them are the unknowns of a weighted
least-squares problem, solved anew in every command period from the last one's answer.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav import checks
from motm_wbc.basenav.footprint_check import outline_of
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.obstacle import Disc
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa_motion import drive_of
from motm_wbc.basenav.teb_band import Band
from motm_wbc.basenav.teb_keeper import BandKeeper
from motm_wbc.basenav.teb_obstacles import footprint_sides
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.teb_plan import TebPlan, band_states, braking_states, pose_at_rest
from motm_wbc.basenav.teb_residuals import ways
from motm_wbc.basenav.teb_safety import Safety, State
from motm_wbc.basenav.teb_world import planner_of_still, scene_of, still_world
from motm_wbc.basenav.world import World
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked


class TimedElasticBand:
    """A `LocalPlanner` that keeps one band from step to step.

    Attributes:
        world: the obstacles.
        limits: speed and acceleration limits of the base.
        parameters: see `TebParameters`.
        planner: its own global planner, of what stands still, whose path the band begins as.
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
            planner: global planner of the same world; its speeds and inflation are taken over.

        Raises:
            InputError: the footprint or a limit can't be used.
        """
        footprint, limits = checks.footprint(footprint), checks.limits(limits)
        self.world, self.limits, self.parameters = world, limits, parameters
        p = parameters
        self._outline = outline_of(footprint)
        self._footprint = footprint_sides(footprint)
        self._drive = drive_of(limits, p.interval, p.command_period, p.ramp_steps)
        self._bands = BandKeeper(limits, p, self._footprint, self._outline)
        self._compile(planner)
        self.planner = planner_of_still(planner, world)
        self._scene = scene_of(world, self._outline, p.margin)

    def _compile(self, planner: GlobalPlanner) -> None:
        """Run every kernel once, so that no later call has to wait for the compiler."""
        example = World([Disc((100.0, 0.0), 1.0, (0.0, 0.1))])
        self.planner = planner_of_still(planner, example)
        self._scene = scene_of(example, self._outline, self.parameters.margin)
        for _ in range(2):  # with a band made anew, and with one kept
            self.plan(np.zeros(3), 0.0, 0.0, Goal(np.array([1.0, 0.0, 0.0])))
        self._bands.forget()

    def update(self, world: World) -> None:
        """Take another world, seen from now on; what still stands there is not done again."""
        scene = scene_of(world, self._outline, self.parameters.margin, self._scene)
        if scene.edges is not self._scene.edges:
            self.planner.update(still_world(world))
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
            pose = np.zeros(3)
            v, omega = (speed if math.isfinite(speed) else 0.0 for speed in (v, omega))
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
        return bool(ahead * (1.0 if state.v >= 0.0 else -1.0) <= 0.0)

    def _follow(self, state: State, safety: Safety, goal: Goal) -> TebPlan:
        """The first command of the best band that may be given out; else brake."""
        best, restarted = self._bands.best(state, goal, self._scene, safety.room, self.planner)
        if best is not None:
            command = safety.nearest(self._command(best.band, state))
            self._bands.note(obeyed=command is not None)
            if command is not None:
                reached = best.whole and math.isinf(best.free)
                return self._answer(
                    state, safety, command, best.band, restarted=restarted, reached=reached
                )
        return self._stop(state, safety, emergency=True)

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
        band: Band | None = None,
        *,
        reached: bool = False,
        emergency: bool = False,
        restarted: bool = False,
    ) -> TebPlan:
        period = self._drive.period
        braking = braking_states(self._drive, self._outline.radius, state, command)
        if band is None:
            states = np.vstack([[0.0, *state.pose, state.v, state.omega], braking])
        else:
            states = band_states(band, state)
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


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
