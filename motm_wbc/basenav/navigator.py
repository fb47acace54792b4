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
from motm_wbc.basenav.world import World
from motm_wbc.geometry import polygons
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_AT_REST = 1e-6  # [m/s] or [rad/s]: what rounding leaves of a speed that was braked


class NavStatus(enum.StrEnum):
    """How it stands."""

    DRIVING = "driving"
    REACHED = "reached"
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
    ) -> None:
        """Set up; compiles the kernels if that is still to do.

        Args:
            world: obstacles.
            footprint: (n, 2) convex outline in the base frame [m].
            limits: speeds and accelerations.
            planner: name of the local planner.
            inflation: [m]; None: see `disc_radius`.
            tolerance: [m], [rad].
            staa: parameters of STAA*; its `command_period` is that of the steps.

        Raises:
            InputError: something given can't be used.
        """
        parameters = staa or StaaParameters()
        self.inflation = disc_radius(footprint) if inflation is None else inflation
        self.tolerance = tolerance
        self._period = parameters.command_period
        self._limits = limits
        self._planner = make_local_planner(
            planner, world, footprint, limits, self.inflation, parameters
        )
        self._time = -math.inf
        self._state = np.zeros(5)
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
            return self._step(time, np.asarray(pose, dtype=float), v, omega, goal, world)
        except Exception as error:
            return self._refuse(v, omega, f"{type(error).__name__}: {error}")

    def _step(
        self, time: float, pose: Array, v: float, omega: float, goal: Goal, world: World | None
    ) -> NavStep:
        if pose.shape != (3,) or not np.isfinite([*pose, v, omega, time]).all():
            return self._refuse(v, omega, "the state has a number that is NaN or infinite")
        if time <= self._time:
            message = f"the state is stale: its time {time:g} s is not after {self._time:g} s"
            return self._refuse(v, omega, message)
        self._time = time
        self._state = np.array([*pose, v, omega])
        if world is not None:
            self._planner.update(world)
        if np.shape(goal.pose) != (3,) or not np.isfinite(goal.pose).all():
            return self._refuse(v, omega, "the goal must be three finite numbers")
        return self._toward(pose, v, omega, goal)

    def _toward(self, pose: Array, v: float, omega: float, goal: Goal) -> NavStep:
        if self._goal is None or not _same(goal, self._goal):
            self._goal, self._reached = goal, False
        if self._reached and not goal.stop:
            plan = self._planner.brake(pose, v, omega)
            return NavStep(plan.acceleration, plan, NavStatus.REACHED, "waits for another goal")
        plan = self._planner.plan(pose, v, omega, goal)
        if self._reached or at_goal(pose, v, omega, goal, self.tolerance):
            self._reached = True
            return NavStep(plan.acceleration, plan, NavStatus.REACHED)
        if plan.emergency:
            return NavStep(
                plan.acceleration, plan, NavStatus.BLOCKED, "nothing but braking is safe"
            )
        return NavStep(plan.acceleration, plan, NavStatus.DRIVING)

    def _refuse(self, v: float, omega: float, message: str) -> NavStep:
        """Brake from the last state that made sense, with the speeds where they do."""
        before = self._state
        v, omega = (
            float(now) if isinstance(now, int | float) and math.isfinite(now) else float(last)
            for now, last in zip((v, omega), before[3:], strict=True)
        )
        plan = self._planner.brake(before[:3], v, omega)
        return NavStep(plan.acceleration, plan, NavStatus.REFUSED, message)


def at_goal(
    pose: Array, v: float, omega: float, goal: Goal, tolerance: tuple[float, float]
) -> bool:
    """Whether a goal is reached: near enough, turned enough, and at rest if it is a stop."""
    if math.hypot(goal.pose[0] - pose[0], goal.pose[1] - pose[1]) > tolerance[0]:
        return False
    if abs(wrap(float(goal.pose[2] - pose[2]))) > tolerance[1]:
        return False
    return not goal.stop or max(abs(v), abs(omega)) <= _AT_REST


def inner_radius(footprint: Array) -> float:
    """Radius of the largest disc about the origin in a convex footprint (n, 2) [m]."""
    corners = polygons.counter_clockwise(footprint)
    along = np.roll(corners, -1, axis=0) - corners
    cross = corners[:, 0] * along[:, 1] - corners[:, 1] * along[:, 0]
    return max(float(np.min(cross / np.hypot(along[:, 0], along[:, 1]))), 0.0)


def disc_radius(footprint: Array) -> float:
    """Radius of the disc that the global planner takes for a footprint (n, 2) [m].

    A third of the way from the inner to the outer radius: the footprint passes wherever
    the inner disc does, but needs room to turn; the local planner checks it as it is.
    """
    inner, outer = inner_radius(footprint), float(np.hypot(*footprint.T).max())
    return inner + (outer - inner) / 3.0


def fitting_inflation(
    world: World, footprint: Array, limits: BaseLimits, start: Array, goal: Array
) -> float:
    """`disc_radius`, or the inner radius where only that lets a path pass [m].

    Args:
        world: obstacles.
        footprint: (n, 2) convex outline [m].
        limits: speeds.
        start: (3,) pose.
        goal: (3,) pose.
    """
    wanted = disc_radius(footprint)
    planner = GlobalPlanner(world, limits.v_max, limits.omega_max, wanted, limits.v_reverse)
    return wanted if planner.route(start, goal) is not None else inner_radius(footprint)


def _same(first: Goal, second: Goal) -> bool:
    return first.stop == second.stop and np.array_equal(first.pose, second.pose)
