"""The hard check of commands: no band is trusted, whatever its residuals say.

What stands still is checked as in STAA* (`first_actions`): the true footprint over the command
period and the braking arc after it. What moves is predicted over the same time, and for a
while in which the base stands at the end of that arc.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.footprint_check import EdgeMap, Outline
from motm_wbc.basenav.staa_admissible import (
    ACCELERATION,
    ALPHA,
    arc_is_clear,
    executed,
    first_actions,
    margin_left,
)
from motm_wbc.basenav.staa_motion import Drive, arc, stopping_duration, stopping_span
from motm_wbc.basenav.staa_root import NOWHERE, with_direction
from motm_wbc.basenav.teb_obstacles import Parts, place_footprint, separation
from motm_wbc.basenav.teb_residuals import way
from motm_wbc.basenav.teb_world import Scene
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_GRID = np.linspace(-1.0, 1.0, 5)  # of accelerations, as shares of their limits
_STANDING = 1.0  # [s] after rest for which what moves must stay clear of the base
_LOOK = 0.05  # [s] between two looks at what moves


@dataclass(frozen=True)
class State:
    """Where the base is.

    Attributes:
        pose: (3,) [m, m, rad].
        v: speed [m/s].
        omega: turn rate [rad/s].
        residue: what rounding has left of velocities that were braked, and v and omega are
            without; the command takes it away.
    """

    pose: Array
    v: float
    omega: float
    residue: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Safety:
    """Which commands may be given out in a state.

    Attributes:
        drive: limits and times.
        scene: the world.
        outline: the footprint, as half-planes.
        footprint: (m, 4) its corners and normals.
        margin: distance to keep from obstacles [m].
        state: of the base.
        known: the state is one; else nothing is safe.
    """

    drive: Drive
    scene: Scene
    outline: Outline
    footprint: Array
    margin: float
    state: State
    known: bool = True

    @cached_property
    def room(self) -> float:
        """Largest margin [m] that pose and braking arc keep; negative: on contact.

        A base that stands inside the margin may go on there, but no deeper.
        """
        if not self.known:
            return -1.0
        pose, v, omega = with_direction(self.state.pose), self.state.v, self.state.omega
        edges = self.scene.edges
        return float(margin_left(self.drive, edges, self.outline, self.margin, pose, v, omega))

    @cached_property
    def brake(self) -> tuple[float, float]:
        """Accelerations that come to rest on the present arc."""
        return self._check(np.zeros((0, 2)))[1]

    def allows(self, command: tuple[float, float]) -> bool:
        """Whether accelerations within the limits may be applied for a command period.

        If a moving obstacle comes anyway, it may not come sooner than at a braking base.
        """
        return (
            self.room >= 0.0
            and bool(self._check(np.array([command]))[0][0])
            and self._outruns(command)
        )

    def nearest(self, wanted: tuple[float, float]) -> tuple[float, float] | None:
        """The command that may be given out and is nearest to the one that is wanted.

        Distances are taken in shares of the limits, among the wanted accelerations and a grid
        over what the limits allow; None if there is none, or none that moves the base.
        """
        if self.allows(wanted):
            return wanted
        if self.room < 0.0:
            return None
        drive, state = self.drive, self.state
        grid = np.array(
            [
                (a, alpha)
                for a in (wanted[0], *_GRID * drive.a_max)
                for alpha in (wanted[1], *_GRID * drive.alpha_max)
            ]
        )
        low = np.array([-drive.v_reverse - state.v, -drive.omega_max - state.omega]) / drive.period
        high = np.array([drive.v_max - state.v, drive.omega_max - state.omega]) / drive.period
        grid = np.clip(grid, low, high)
        moves = np.any(grid != np.array(self.brake), axis=1)
        grid = grid[moves & self._check(grid)[0]]
        limits = np.array([drive.a_max, drive.alpha_max])
        away = (((grid - np.array(wanted)) / limits) ** 2).sum(axis=1)
        for a, alpha in grid[np.argsort(away, kind="stable")].tolist():
            if self._outruns((a, alpha)):
                return a, alpha
        return None

    def _outruns(self, command: tuple[float, float]) -> bool:
        """Whether what moves keeps the margin, or breaks it no sooner than if the base brakes.

        A base that has it inside the margin already goes on if that is not touched sooner.
        """
        free = self._time_to_contact(command, self.margin)
        if math.isinf(free):
            return True
        if free < self._time_to_contact(self.brake, self.margin):
            return False
        if free > self.drive.period:
            return True
        return self._time_to_contact(command, 0.0) >= self._time_to_contact(self.brake, 0.0)

    def _check(self, commands: Array) -> tuple[NDArray[np.bool_], tuple[float, float]]:
        """Which of the commands (m, 2) are safe beside what stands still; the brake."""
        state, period = self.state, self.drive.period
        targets = np.array([state.v, state.omega]) + commands * period
        rates = np.abs(commands)
        table, admissible, _, _ = first_actions(
            self.drive,
            self.scene.edges,
            self.outline,
            NOWHERE,
            1,
            1,
            max(self.room, 0.0),
            state.pose,
            state.v,
            state.omega,
            np.column_stack([rates[:, 0], targets[:, 0], rates[:, 1], targets[:, 1]]),
            0.0,
        )
        brake = table[-1]
        return admissible[1:-1], (float(brake[ACCELERATION]), float(brake[ALPHA]))

    def _time_to_contact(self, command: tuple[float, float], margin: float) -> float:
        if len(self.scene.moving.boxes) == 0:
            return math.inf
        state = self.state
        pose = with_direction(state.pose)
        return float(
            time_to_contact(
                self.drive,
                self.footprint,
                self.scene.moving,
                margin,
                pose,
                state.v,
                state.omega,
                *command,
            )
        )


@kernel
def time_to_contact(
    drive: Drive,
    footprint: Array,
    moving: Parts,
    margin: float,
    pose: tuple[float, float, float, float],
    v: float,
    omega: float,
    a: float,
    alpha: float,
) -> float:
    """When a moving obstacle comes nearer than a margin, if the base brakes after a command.

    Args:
        drive: limits and times.
        footprint: (m, 4) corners and normals in the base frame.
        moving: convex parts with velocities.
        margin: [m].
        pose: x, y [m], cosine and sine of the heading.
        v: speed [m/s].
        omega: turn rate [rad/s].
        a: acceleration commanded for a period [m/s^2].
        alpha: angular acceleration [rad/s^2].

    Returns:
        Time [s]; infinite if none does until the base has stood for a second.
    """
    x, y, c, s = executed(drive, pose, v, omega, a, alpha)
    v1, w1 = v + a * drive.period, omega + alpha * drive.period
    duration, span = stopping_duration(drive, v1, w1), stopping_span(drive, v1, w1)
    base = np.empty_like(footprint)
    for look in range(math.ceil((duration + _STANDING) / _LOOK) + 1):
        time = look * _LOOK
        left = max(1.0 - time / duration, 0.0) if duration > 0.0 else 0.0
        share = (1.0 - left * left) * span
        px, py, pc, ps = arc(x, y, c, s, v1 * share, w1 * share)
        place_footprint(footprint, px, py, math.atan2(ps, pc), base)
        since = time + drive.period
        for part in range(moving.boxes.shape[0]):
            dx, dy = moving.velocities[part, 0] * since, moving.velocities[part, 1] * since
            if separation(base, moving, part, dx, dy, margin)[0] < margin:
                return since
    return math.inf


@kernel
def free_time(
    edges: EdgeMap, outline: Outline, margin: float, poses: Array, intervals: Array
) -> float:
    """Time that a band can be driven before it meets what stands still [s], or infinity."""
    slope, time = np.empty(7), 0.0
    for i in range(intervals.shape[0]):
        begin = (poses[i, 0], poses[i, 1], math.cos(poses[i, 2]), math.sin(poses[i, 2]))
        gone, turn = way(poses[i], poses[i + 1], slope), poses[i + 1, 2] - poses[i, 2]
        if not arc_is_clear(edges, outline, margin, begin, gone, turn):
            return time
        time += intervals[i]
    return math.inf
