"""A base driven to a pose in a world that may move: exact motion, every step audited."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.navigator import Navigator, NavStatus, NavStep, at_goal, fitting_inflation
from motm_wbc.basenav.planner import GlobalPlanner, Path
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.staa_plan import StaaPlan
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.experiments.metrics import spread_ms
from motm_wbc.experiments.nav.contacts import ContactAudit
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits, VelocityRamp

TOLERANCE = 0.10, 0.35  # [m], [rad]
_AT_REST = 1e-6  # [m/s] or [rad/s]
_EXCUSE = 1.0  # [s] at rest, after which what runs into the base is to blame
_STUCK = 5.0, 0.1  # who moved less than this [m] in the last seconds [s] was stuck
_HOPELESS = 10.0  # [s] at rest in a world at rest: nothing will change any more
_LONGEST = 3600.0  # [s], of a drive that was given no time limit
_ROUNDING = 1e-9  # share of a limit; below it is the arithmetic's


@dataclass(frozen=True, slots=True)
class Moment:
    """A base step, for who watches a drive.

    Attributes:
        time: [s].
        state: (5,) x [m], y [m], heading [rad], v [m/s], omega [rad/s].
        world: as it was then.
        step: what the navigator answered.
        compute_time: what that took [s].
        clearance: least distance of the footprint from anything so far [m].
    """

    time: float
    state: Array
    world: World
    step: NavStep
    compute_time: float
    clearance: float


Observer = Callable[[Moment], None]


@dataclass(frozen=True, slots=True)
class Course:
    """What is driven, and how; see `drive`."""

    world: World
    footprint: Array
    limits: BaseLimits
    start: Array
    goal: Goal
    velocity: tuple[float, float]
    period: float
    ramp_steps: int
    tolerance: tuple[float, float]
    noise: tuple[float, float]
    seed: int


def drive(
    world: World,
    footprint: Array,
    limits: BaseLimits,
    start: Array,
    goal: Array,
    *,
    stop: bool = False,
    planner: str = "staa",
    staa: StaaParameters | None = None,
    teb: TebParameters | None = None,
    inflation: float | None = None,
    velocity: tuple[float, float] = (0.0, 0.0),
    period: float = 0.05,
    ramp_steps: int = 6,
    time_limit: float | None = None,
    tolerance: tuple[float, float] = TOLERANCE,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
    observer: Observer | None = None,
) -> DriveResult:
    """Drive a base to a pose.

    The base carries out what it is told: in each control step its velocity is raised at the
    start, then kept, so that it moves on exact arcs. Every control step is audited.

    Args:
        world: as it is at time 0; what has a velocity moves.
        footprint: (n, 2) convex outline in the base frame [m].
        limits: speeds and accelerations.
        start: (3,) pose [m, m, rad].
        goal: (3,) pose [m, m, rad].
        stop: come to rest there; else drive through it.
        planner: name of the local planner.
        staa: parameters of STAA*; rates are taken from `period` and `ramp_steps`.
        teb: parameters of the Timed Elastic Band; the same.
        inflation: radius that the global planner plans for [m]; None: `fitting_inflation`.
        velocity: v [m/s] and omega [rad/s] at the start.
        period: of the base steps [s].
        ramp_steps: control steps in each.
        time_limit: [s]; None: four times the lower bound and 20 s, an hour
            at most.
        tolerance: distance [m] and angle [rad] at which the goal is reached.
        noise: standard deviation of the position, each axis [m], and of the heading [rad]
            that the navigator is told.
        seed: of the noise; 0: the nominal run, without any.
        observer: called at every base step.

    Raises:
        InputError: start or goal is not three finite numbers, or something else given
            can't be used.
    """
    course = Course(
        world,
        footprint,
        limits,
        _pose(start, "start"),
        Goal(_pose(goal, "goal"), stop),
        velocity,
        period,
        ramp_steps,
        tolerance,
        noise,
        seed,
    )
    ground = world.still() if any(solid.moves for solid in world.solids) else world
    staa, teb = staa or StaaParameters(), teb or TebParameters()
    if inflation is None:
        margin = (teb if planner == "teb" else staa).margin
        inflation = fitting_inflation(
            ground, footprint, limits, course.start, course.goal.pose, margin
        )
    path = _global_path(ground, limits, inflation, course)
    rates = {"command_period": period, "ramp_steps": ramp_steps}
    navigator = Navigator(
        world,
        footprint,
        limits,
        planner=planner,
        inflation=inflation,
        tolerance=tolerance,
        staa=staa.model_copy(update=rates),
        teb=teb.model_copy(update=rates),
    )
    run = _Drive(course, navigator)
    if path is None:
        run.end("no path: what stands separates start and goal")
        return run.result(None, inflation)
    if time_limit is None:
        time_limit = min(20.0 + 4.0 * (path.time + limits.v_max / limits.a_max), _LONGEST)
    while not run.ended and run.time < time_limit - 0.5 * run.dt:
        run.base_step(observer)
    return run.result(path, inflation)


class _Drive:
    """A drive under way, and what is measured of it."""

    def __init__(self, course: Course, navigator: Navigator) -> None:
        self._course = course
        self._navigator = navigator
        self._audit = ContactAudit(course.world, course.footprint)
        self._moves = any(solid.moves for solid in course.world.solids)
        self._noise = np.random.default_rng(course.seed) if course.seed else None
        self.dt = course.period / course.ramp_steps
        self._ramp = VelocityRamp(course.limits, course.period, self.dt)
        self._state = np.array([*course.start, *course.velocity], dtype=float)
        self._count = 0
        self._rows: list[Array] = []
        self._moved_at = 0.0
        self._compute_times: list[float] = []
        self._blocked, self._guards = 0, 0
        self._speed_excess, self._acceleration_excess = 0.0, 0.0
        self.ended = False
        self._reason: str | None = None
        self._collisions, self._excused = 0, 0
        self._arrive()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._count * self.dt

    def base_step(self, observer: Observer | None) -> None:
        """Ask the navigator once, and carry out its answer for one period."""
        time, state, course = self.time, self._state, self._course
        world = course.world.after(time) if self._moves else None
        seen = self._sensed(state[:3])
        v, omega = float(state[3]), float(state[4])
        began = clock.perf_counter()
        step = self._navigator.step(time, seen, v, omega, course.goal, world)
        took = clock.perf_counter() - began
        self._compute_times.append(took)
        self._count_of(step)
        if observer is not None:
            shown = course.world if world is None else world
            observer(Moment(time, state, shown, step, took, self._audit.least))
        self._ramp.start(state[3:], np.array(step.acceleration))
        for _ in range(course.ramp_steps):
            if self.ended:
                return
            self._control_step()
        if not self._moves and self.time - self._moved_at > _HOPELESS:
            self.end(f"stuck at {_at(self._state)} since {self._moved_at:.1f} s")

    def end(self, reason: str | None) -> None:
        """The drive is over: because of something, or (None) because the goal is reached."""
        if not self.ended:
            self.ended, self._reason = True, reason

    def result(self, path: Path | None, inflation: float) -> DriveResult:
        """The figures."""
        if not self.ended:
            self.end(self._late())
        rows, limits = np.array(self._rows), self._course.limits
        steps = np.diff(rows[:, 1:3], axis=0)
        success = self._reason is None
        bound = None if path is None else path.time + limits.v_max / limits.a_max
        return DriveResult(
            success=success,
            failure_reason=self._reason,
            time_s=self.time if success else None,
            collisions=self._collisions,
            excused=self._excused,
            min_clearance_m=self._audit.least if math.isfinite(self._audit.least) else None,
            path_length_m=float(np.hypot(steps[:, 0], steps[:, 1]).sum()),
            global_path_length_m=None if path is None else path.length,
            lower_bound_s=bound,
            step_ms=spread_ms(np.array(self._compute_times)),
            blocked_steps=self._blocked,
            clock_guard_firings=self._guards,
            max_speed_excess=self._speed_excess,
            max_acceleration_excess=self._acceleration_excess,
            inflation_m=inflation,
            global_path=None if path is None else path.points,
            trajectory=rows,
        )

    def _control_step(self) -> None:
        v, omega = self._ramp.advance(self._state[3:])
        pose = se2.integrate_twist(self._state[:3], v, 0.0, omega, self.dt)
        self._state = np.array([*pose, v, omega])
        self._count += 1
        if max(abs(v), abs(omega)) > _AT_REST:
            self._moved_at = self.time
        self._arrive()

    def _arrive(self) -> None:
        """Keep the state that has been got to, and see what it means."""
        time, state, course = self.time, self._state, self._course
        self._rows.append(np.array([time, *state]))
        v, omega = float(state[3]), float(state[4])
        if self._audit.look(time, state[:3], v, omega, self.dt):
            excused = self._count > 0 and time - self._moved_at >= _EXCUSE
            self._collisions, self._excused = 1, int(excused)
            what = "run into at rest at" if excused else "collision at"
            self.end(f"{what} {_at(state)} after {time:.2f} s")
        elif at_goal(state[:3], v, omega, course.goal, course.tolerance):
            self.end(None)

    def _sensed(self, pose: Array) -> Array:
        if self._noise is None:
            return pose
        position, heading = self._course.noise
        return np.asarray(pose + self._noise.normal(size=3) * [position, position, heading])

    def _count_of(self, step: NavStep) -> None:
        self._blocked += step.status is NavStatus.BLOCKED or step.plan.emergency
        self._guards += isinstance(step.plan, StaaPlan) and step.plan.clock_guard_fired
        limits, velocity = self._course.limits, self._state[3:]
        a, alpha = step.acceleration
        lead = velocity + np.array([a, alpha]) * self._course.period
        back = limits.v_reverse if lead[0] < 0.0 else limits.v_max
        speed = max((abs(lead[0]) - back) / limits.v_max, abs(lead[1]) / limits.omega_max - 1.0)
        force = max(abs(a) / limits.a_max, abs(alpha) / limits.alpha_max) - 1.0
        if speed > _ROUNDING:
            self._speed_excess = max(self._speed_excess, float(speed))
        if force > _ROUNDING:
            self._acceleration_excess = max(self._acceleration_excess, force)

    def _late(self) -> str:
        span, least = _STUCK
        recent = np.array(self._rows[-1 - round(span / self.dt) :])
        if self.time >= span and float(np.ptp(recent[:, 1:3], axis=0).max()) < least:
            return f"stuck at {_at(self._state)}: time limit of {self.time:.1f} s"
        return f"time limit of {self.time:.1f} s, at {_at(self._state)}"


def _global_path(
    ground: World, limits: BaseLimits, inflation: float, course: Course
) -> Path | None:
    planner = GlobalPlanner(ground, limits.v_max, limits.omega_max, inflation, limits.v_reverse)
    return planner.route(course.start, course.goal.pose)


def _pose(values: Array, where: str) -> Array:
    pose = np.array(values, dtype=float)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise InputError("must be three finite numbers: x, y, heading", where)
    return pose


def _at(state: Array) -> str:
    return f"({state[0]:.2f}, {state[1]:.2f})"
