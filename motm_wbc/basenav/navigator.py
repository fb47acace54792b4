"""The navigator: one call a command period, from what is known now to what to do next."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.local_planner import Goal, LocalPlan
from motm_wbc.basenav.local_planners import make_local_planner
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_progress import ProgressMonitor
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.world import World
from motm_wbc.geometry import se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked


class NavStatus(enum.StrEnum):
    """How it stands."""

    DRIVING = "driving"
    REACHED = "reached"
    STUCK = "stuck"
    """Not at the goal, and no nearer to it for some seconds."""
    BLOCKED = "blocked"
    """Nothing but braking, or standing still, is safe or leads on."""
    REFUSED = "refused"
    """What was given can't be used: the base brakes."""


@dataclass(frozen=True, slots=True)
class NavStep:
    """The answer of one step.

    Attributes:
        acceleration: a [m/s^2] and alpha [rad/s^2], for the next command period only.
        plan: what the local planner has in mind, with its braking arc.
        status: how it stands.
        message: why, in words; empty while all is well.
    """

    acceleration: tuple[float, float]
    plan: LocalPlan
    status: NavStatus
    message: str = ""


class Navigator:
    """Drives a base from pose to pose: global planner, local planner and the checks between.

    Attributes:
        inflation: radius of the disc that the global planner plans for [m].
        tolerance: distance [m] and angle [rad] at which a goal counts as reached.
    """

    def __init__(
        self,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        *,
        planner: str = "staa",
        inflation: float | None = None,
        tolerance: tuple[float, float] = (0.10, 0.35),
        staa: StaaParameters | None = None,
        teb: TebParameters | None = None,
    ) -> None:
        """Set up; compiles the kernels if that is still to do.

        Args:
            world: obstacles.
            footprint: (n, 2) convex outline in the base frame [m].
            limits: speeds and accelerations.
            planner: name of the local planner.
            inflation: [m]; None: see `disc_radius`.
            tolerance: [m], [rad].
            staa: parameters of STAA*.
            teb: parameters of the Timed Elastic Band. The `command_period` of the planner
                that is used is that of the steps.

        Raises:
            InputError: something given can't be used.
        """
        staa, teb = staa or StaaParameters(), teb or TebParameters()
        self.inflation = disc_radius(footprint) if inflation is None else inflation
        self.tolerance = tolerance
        self._period = (teb if planner == "teb" else staa).command_period
        self._planner = make_local_planner(
            planner, world, footprint, limits, self.inflation, staa, teb
        )
        self._progress = ProgressMonitor()
        self._time = -math.inf
        self._state = np.zeros(5)  # believed in: what the last command leads to
        self._goal: Goal | None = None
        self._reached = False

    def step(
        self,
        time: float,
        pose: Array,
        v: float,
        omega: float,
        goal: Goal,
        world: World | None = None,
    ) -> NavStep:
        """What to do in the command period that begins now. Never raises.

        Args:
            time: of the state; it has to grow from step to step [s].
            pose: (3,) x [m], y [m], heading [rad].
            v: speed [m/s].
            omega: turn rate [rad/s].
            goal: where to go. Once it is reached, the base brakes until there is another.
            world: as it is seen now; None: as before.
        """
        try:
            step = self._step(time, np.asarray(pose, dtype=float), v, omega, goal, world)
        except Exception as error:
            step = self._refuse(v, omega, f"{type(error).__name__}: {error}")
        self._foresee(step.acceleration)
        return step

    def _step(
        self, time: float, pose: Array, v: float, omega: float, goal: Goal, world: World | None
    ) -> NavStep:
        if pose.shape != (3,) or not np.isfinite([*pose, v, omega, time]).all():
            return self._refuse(v, omega, "the state has a number that is NaN or infinite")
        if time <= self._time:
            message = f"the state is stale: its time {time:g} s is not after {self._time:g} s"
            return self._refuse(math.nan, math.nan, message)
        self._time = time
        self._state = np.array([*pose, v, omega])
        wrong = _other_than(Goal, goal) or (_other_than(World, world) if world is not None else "")
        if wrong:
            return self._refuse(v, omega, wrong)
        if world is not None:
            self._planner.update(world)
        if np.shape(goal.pose) != (3,) or not np.isfinite(goal.pose).all():
            return self._refuse(v, omega, "the goal must be three finite numbers")
        return self._toward(pose, v, omega, goal)

    def _toward(self, pose: Array, v: float, omega: float, goal: Goal) -> NavStep:
        if self._goal is None or not goal.is_same(self._goal):
            self._goal, self._reached = goal, False
            self._progress.restart()
        if self._reached and not goal.stop:
            plan = self._planner.brake(pose, v, omega)
            return NavStep(plan.acceleration, plan, NavStatus.REACHED, "waits for another goal")
        plan = self._planner.plan(pose, v, omega, goal)
        if self._reached or at_goal(pose, v, omega, goal, self.tolerance):
            self._reached = True
            return NavStep(plan.acceleration, plan, NavStatus.REACHED)
        status, message = self._standing(pose, goal, plan.emergency)
        return NavStep(plan.acceleration, plan, status, message)

    def _standing(self, pose: Array, goal: Goal, emergency: bool) -> tuple[NavStatus, str]:
        """How it stands with a goal that is not reached."""
        path = self._planner.planner.route(pose, goal.pose)
        standing = self._progress.update(self._time, math.inf if path is None else path.time)
        if standing.stuck:
            return NavStatus.STUCK, f"no nearer to the goal for {standing.stalled:.1f} s"
        if path is None:
            return NavStatus.BLOCKED, "there is no path to the goal"
        if emergency:
            return NavStatus.BLOCKED, "nothing but braking is safe"
        return NavStatus.DRIVING, ""

    def _refuse(self, v: float, omega: float, message: str) -> NavStep:
        """Brake from the state that is believed in, with the speeds where they make sense."""
        for index, speed in ((3, v), (4, omega)):
            if isinstance(speed, int | float) and math.isfinite(speed):
                self._state[index] = speed
        plan = self._planner.brake(self._state[:3], *self._state[3:].tolist())
        return NavStep(plan.acceleration, plan, NavStatus.REFUSED, message)

    def _foresee(self, acceleration: tuple[float, float]) -> None:
        """Believe in the state that the command leads to, until a better one is told."""
        *pose, v, omega = self._state.tolist()
        after = np.array([v, omega]) + np.array(acceleration) * self._period
        mean = 0.5 * (np.array([v, omega]) + after)
        there = se2.integrate_twist(np.array(pose), mean[0], 0.0, mean[1], self._period)
        self._state = np.array([*there, *after])


def _other_than(kind: type, given: object) -> str:
    """What to say of an argument of another kind; empty if it is of this one."""
    if isinstance(given, kind):
        return ""
    return f"a {kind.__name__} is needed, got {type(given).__name__}"


def at_goal(
    pose: Array, v: float, omega: float, goal: Goal, tolerance: tuple[float, float]
) -> bool:
    """Whether a goal is reached: near enough, turned enough, and at rest if it is a stop."""
    if math.hypot(goal.pose[0] - pose[0], goal.pose[1] - pose[1]) > tolerance[0]:
        return False
    if abs(wrap(float(goal.pose[2] - pose[2]))) > tolerance[1]:
        return False
    return not goal.stop or max(abs(v), abs(omega)) <= _AT_REST


def half_width(footprint: Array) -> float:
    """Radius of the largest disc about the origin that passes wherever the footprint does [m].

    The base drives along its heading, so what counts is how far it reaches to each side: not
    how far behind its origin, which may lie near its rear edge.

    Args:
        footprint: (n, 2) convex outline in the base frame [m].
    """
    return max(float(min(footprint[:, 1].max(), -footprint[:, 1].min())), 0.0)


def disc_radius(footprint: Array) -> float:
    """Radius of the disc that the global planner takes for a footprint (n, 2) [m].

    A third of the way from half the width to the outer radius: straight on, the footprint
    passes wherever a disc of its width does, but needs room to turn; the local planner checks
    it as it is.
    """
    half, outer = half_width(footprint), float(np.hypot(*footprint.T).max())
    return half + (outer - half) / 3.0


def fitting_inflation(
    world: World,
    footprint: Array,
    limits: BaseLimits,
    start: Array,
    goal: Array,
    margin: float = 0.0,
) -> float:
    """`disc_radius`, or half the width and the margin where only that lets a path pass [m].

    Where that doesn't either, a local planner that keeps the margin can't pass.

    Args:
        world: obstacles.
        footprint: (n, 2) convex outline [m].
        limits: speeds.
        start: (3,) pose.
        goal: (3,) pose.
        margin: that the local planner keeps from obstacles [m].
    """
    wanted, least = disc_radius(footprint), half_width(footprint) + margin
    if wanted <= least:
        return least
    planner = GlobalPlanner(world, limits.v_max, limits.omega_max, wanted, limits.v_reverse)
    return wanted if planner.route(start, goal) is not None else least
