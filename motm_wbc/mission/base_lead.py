"""Leading the base: the method at its own rate, its acceleration ramped in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits, VelocityRamp, braking_arc
from motm_wbc.interfaces import BaseReport, Event
from motm_wbc.mission.arrival import Arrival, arrival_in_range
from motm_wbc.mission.methods import BaseDecision, BaseMoment, Method

_SAME_GOAL = 0.02  # [m] and [rad] that a goal may move with its object and still be the same


@dataclass(frozen=True, slots=True)
class BaseStep:
    """What the base shall do in one control step.

    Attributes:
        reference: (2,) v [m/s], omega [rad/s].
        report: of the base step, where this control step had one.
        events: what happened.
    """

    reference: Array
    report: BaseReport | None
    events: tuple[Event, ...]


class BaseLead:
    """Runs the method every few control steps and keeps what it predicted."""

    def __init__(
        self, method: Method, limits: BaseLimits, divider: int, dt: float, arm_xy: Array
    ) -> None:
        """Set up.

        Args:
            method: decides at each base step.
            limits: of the base.
            divider: control steps in a base step.
            dt: control step [s].
            arm_xy: (2,) the arm's base axis in the base frame [m].
        """
        self._method = method
        self._limits = limits
        self._divider = divider
        self._dt = dt
        self._arm_xy = arm_xy
        self._ramp = VelocityRamp(limits, divider * dt, dt)
        self._count = 0
        self._decision: BaseDecision | None = None
        self._goal: Array | None = None
        self._has_goal = False
        self._emergency = False
        self.goal_switches = 0

    @property
    def pass_poses(self) -> Array:
        """(m, 3) poses of the pass that the last decision foresaw."""
        return np.empty((0, 3)) if self._decision is None else self._decision.pass_poses

    @property
    def horizon(self) -> float:
        """Time up to which the last decision foresaw the base's way [s]."""
        if self._decision is None or len(self._decision.prediction) == 0:
            return 0.0
        return float(self._decision.prediction[-1, 0])

    def step(self, now: BaseMoment) -> BaseStep:
        """The base reference of this control step."""
        velocity = np.array([now.v, now.omega])
        report: BaseReport | None = None
        events: tuple[Event, ...] = ()
        if self._count % self._divider == 0:
            self._decision, events = self._decide(now)
            self._ramp.start(velocity, self._decision.acceleration)
            report = self._decision.report
        self._count += 1
        return BaseStep(self._ramp.advance(velocity), report, events)

    def arrival(self, target_xy: Array, reach: float) -> Arrival | None:
        """When the target comes within `reach` [m] of the arm, on the last prediction."""
        if self._decision is None:
            return None
        found = arrival_in_range(self._decision.prediction, self._arm_xy, target_xy, reach)
        if found is None:
            return None
        age = ((self._count - 1) % self._divider) * self._dt
        return Arrival(max(0.0, found.time - age), found.base_pose)

    def _decide(self, now: BaseMoment) -> tuple[BaseDecision, tuple[Event, ...]]:
        """The method's decision; a method that raises stops the base instead of the loop."""
        try:
            decision = _checked(self._method.decide(now))
            events = self._goal_events(now.time, decision.report.goal)
            events += self._emergency_events(now.time, decision.report.emergency)
        except Exception as error:
            event = Event(now.time, "method_failed", f"{type(error).__name__}: {error}", "error")
            return self._stop(now), (event,)
        return decision, events

    def _stop(self, now: BaseMoment) -> BaseDecision:
        """Brake on the arc that the base is on."""
        arc = braking_arc(now.pose, now.v, now.omega, self._limits)
        longest = max(abs(now.v) / self._limits.a_max, abs(now.omega) / self._limits.alpha_max)
        duration = max(longest, self._divider * self._dt)
        times = np.linspace(0.0, duration, len(arc))
        plan = np.column_stack([times, arc])
        nothing = np.empty((0, 3))
        return BaseDecision(
            acceleration=-np.array([now.v, now.omega]) / duration,
            prediction=plan,
            pass_poses=arc,
            report=BaseReport(
                None,
                nothing,
                np.empty(0),
                np.empty(0, dtype=np.int64),
                ("",),
                -1,
                np.empty((0, 2)),
                plan,
                arc,
            ),
        )

    def _emergency_events(self, time: float, emergency: bool) -> tuple[Event, ...]:
        before, self._emergency = self._emergency, emergency
        if not emergency or before:
            return ()
        return (Event(time, "emergency", "nothing but braking is safe", "warn"),)

    def _goal_events(self, time: float, goal: Array | None) -> tuple[Event, ...]:
        before, self._goal = self._goal, goal
        if self._has_goal and _same(before, goal):
            return ()
        self.goal_switches += int(self._has_goal)
        self._has_goal = True
        if goal is None:
            return (Event(time, "goal", "brake to a stop here"),)
        x, y, heading = goal
        return (Event(time, "goal", f"goal ({x:.2f}, {y:.2f}, {heading:.2f} rad)"),)


def _checked(decision: BaseDecision) -> BaseDecision:
    """The decision, if it is one that can be carried out.

    Raises:
        ValueError: it is not; says why.
    """
    if np.shape(decision.acceleration) != (2,) or not np.all(np.isfinite(decision.acceleration)):
        raise ValueError("the acceleration must be two finite numbers")
    for name, width in (("prediction", 4), ("pass_poses", 3)):
        shape = np.shape(getattr(decision, name))
        if len(shape) != 2 or shape[1] != width:
            raise ValueError(f"{name} must have {width} columns, its shape is {shape}")
    return decision


def _same(first: Array | None, second: Array | None) -> bool:
    if first is None or second is None:
        return first is second
    return bool(np.allclose(first, second, rtol=0.0, atol=_SAME_GOAL))
