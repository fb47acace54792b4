"""Plans of the local planner, made of what was chosen."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.staa_admissible import ACCELERATION, ALPHA, executed
from motm_wbc.basenav.staa_motion import Drive, braking_rates, stopping_duration, stopping_span
from motm_wbc.basenav.staa_plan import Effort, StaaPlan
from motm_wbc.basenav.staa_root import Root, with_direction
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_ARC_SPACING = 0.03  # [m] between reported poses of a braking arc


class Answers:
    """Writes plans out.

    Args:
        drive: limits and times, for the kernels.
        limits: of the base.
        radius: distance from the base's origin to the farthest corner [m].
    """

    def __init__(self, drive: Drive, limits: BaseLimits, radius: float) -> None:
        self._drive = drive
        self._limits = limits
        self._radius = radius

    @property
    def period(self) -> float:
        """Of the commands [s]."""
        return self._drive.period

    def once(
        self,
        root: Root,
        goal: Goal | None,
        action: int,
        *,
        reached: bool = False,
        emergency: bool = False,
        effort: Effort | None = None,
    ) -> StaaPlan:
        """An action for one period, and braking to rest after it."""
        row, period = root.table[action], self._drive.period
        after = self._after(root, action)
        start = np.array([[0.0, *root.pose, root.v, root.omega]])
        states = np.vstack([start, self._braking_states(after)])
        actions = np.array([[*row[:ACCELERATION], period]])
        actions = self.with_braking(actions, after[4], after[5])
        return self.whole(
            root, goal, action, actions, states,
            reached=reached, emergency=emergency, effort=effort,
        )  # fmt: skip

    def whole(
        self,
        root: Root,
        goal: Goal | None,
        action: int,
        actions: Array,
        states: Array,
        *,
        reached: bool = False,
        emergency: bool = False,
        effort: Effort | None = None,
    ) -> StaaPlan:
        """A sequence of actions (k, 5) and the states (n, 6) along it."""
        period, limits = self._drive.period, self._limits
        row = root.table[action]
        a = _within(float(row[ACCELERATION]), limits.a_max)
        alpha = _within(float(row[ALPHA]), limits.alpha_max)
        return StaaPlan(
            acceleration=(
                _within(a - root.residue[0] / period, limits.a_max),
                _within(alpha - root.residue[1] / period, limits.alpha_max),
            ),
            poses=states[:, :4],
            velocities=states[:, 4:],
            reached=reached,
            braking=self._braking_states(self._after(root, action))[:, 1:4],
            actions=actions,
            goal=goal,
            emergency=emergency,
            effort=effort or Effort(),
        )

    def with_braking(self, actions: Array, v: float, omega: float) -> Array:
        """(k, 5) actions, extended by braking to rest from (v, omega)."""
        duration = stopping_duration(self._drive, v, omega)
        if duration == 0.0:
            return actions
        rates = braking_rates(self._drive, v, omega)
        return np.vstack(
            [actions, [rates[0], 0.0, rates[1], 0.0, max(duration, self._drive.period)]]
        )

    def _after(self, root: Root, action: int) -> Array:
        """(6,) time, pose and velocity at the end of an action's command period."""
        row, limits, period = root.table[action], self._limits, self._drive.period
        a = _within(float(row[ACCELERATION]), limits.a_max)
        alpha = _within(float(row[ALPHA]), limits.alpha_max)
        x, y, c, s = executed(self._drive, with_direction(root.pose), root.v, root.omega, a, alpha)
        v, omega = root.v + a * period, root.omega + alpha * period
        return np.array([period, x, y, math.atan2(s, c), v, omega])

    def _braking_states(self, state: Array) -> Array:
        """(b, 6) time, pose and velocity while the base brakes to rest on its circle."""
        when, pose, (v, omega) = state[0], state[1:4], state[4:]
        duration = stopping_duration(self._drive, v, omega)
        span = stopping_span(self._drive, v, omega)
        way = max(abs(v), abs(omega) * self._radius) * span
        count = max(1, math.ceil(way / _ARC_SPACING)) if duration > 0.0 else 0
        states = np.empty((count + 1, 6))
        for k in range(count + 1):
            share = k / count if count else 0.0  # of the way; the speed falls with its root
            left = math.sqrt(1.0 - share)
            reached = se2.integrate_twist(pose, v, 0.0, omega, share * span)
            states[k] = [when + (1.0 - left) * duration, *reached, left * v, left * omega]
        return states


def _within(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
