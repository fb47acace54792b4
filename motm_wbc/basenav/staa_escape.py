"""Ways out among moving obstacles: which first actions are safe, and what is left if none is.

A way out is a first action; then that action kept, or a sharp turn, or neither; then straight
ahead or back, or neither; then braking and standing. It lasts until something that moves meets
the base. An action is safe if the base that brakes after it can stand for a moment before it
is met, and if some way out that begins with it lasts: so the base may drive close past what
moves, and is not caught there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.movers import Movers, half_way, meets_mover
from motm_wbc.basenav.staa_admissible import (
    ACCELERATION,
    ALPHA,
    RATE_OMEGA,
    RATE_V,
    TARGET_OMEGA,
    TARGET_V,
)
from motm_wbc.basenav.staa_follow import DURATION
from motm_wbc.basenav.staa_motion import Drive, arc, stopping_duration, velocity_after
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_HOLDS = (0.5, 1.0, 1.8)  # [s] for which the first action is kept, or a turn
_AHEAD = (0, 1, 1, 0, 0, -1, -1)  # of the base while it is kept (the first of these) or turns
_TURNS = (0, 1, -1, 1, -1, 1, -1)
_STRAIGHT = (0.0, 1.5, -1.5, 4.0)  # [s] then: brake, or straight ahead or (negative) back
_SWERVES = 1 + len(_HOLDS) * len(_TURNS)
_FORMS = _SWERVES * len(_STRAIGHT)
_LOOK = 0.1  # [s] between two looks at what moves while the base stands

Pose = tuple[float, float, float, float]


@dataclass(frozen=True)
class WaysOut:
    """The longest way out that begins with each first action.

    Attributes:
        times: (n,) how long it lasts [s]; infinite if nothing is met as far as is looked,
            negative if what rests is in the way.
        forms: (n,) which it is; -1: what was left of the last step's.
        ends: (n, 3) pose at its end.
        stands: (n,) how long the base lasts at rest that brakes after the action [s]; negative
            if something meets it before.
        kept: (k, 5) what was left of the last step's way out.
    """

    times: Array
    forms: NDArray[np.int64]
    ends: Array
    stands: Array
    kept: Array

    def safe(self, standing: float, lasting: float) -> NDArray[np.bool_]:
        """(n,) which actions are safe, by the strictest of these rules that any action meets.

        The base can brake and stand, and a way out meets nothing as far as is looked; or lasts
        long enough; the same where it can't stand; there is no way out that lasts longer.

        Args:
            standing: how long the base must be able to brake and stand [s].
            lasting: how long a way out must last [s].
        """
        for stands in (self.can_stand(standing), np.ones_like(self.forms, dtype=np.bool_)):
            for least in (math.inf, lasting):
                safe: NDArray[np.bool_] = stands & (self.times >= least)
                if safe.any():
                    return safe
        return np.asarray(self.times == self.times.max())

    def can_stand(self, standing: float) -> NDArray[np.bool_]:
        """(n,) after which actions the base can brake and stand for so long [s]."""
        return np.asarray(self.stands >= standing)

    def best(self, standing: float, lasting: float, left: Array) -> int:
        """The action that avoids what moves: of the safe ones the brake, or what is under way.

        If neither is safe, the one whose way out ends nearest to the goal.

        Args:
            standing: see `safe` [s].
            lasting: see `safe` [s].
            left: (n,) time to the goal from where they end [s].
        """
        safe = self.safe(standing, lasting)
        if safe[-1] and self.stands[-1] >= standing:
            return len(safe) - 1
        under_way = np.flatnonzero(safe & (self.forms < 0))
        if len(under_way):
            return int(under_way[0])
        return int(np.argmin(np.where(safe, left, math.inf)))

    def actions(self, drive: Drive, table: Array, index: int) -> Array:
        """(k, 5) actions of the way out that begins with a row of the table of first actions."""
        if self.forms[index] < 0:
            return self.kept
        actions = np.empty((3, 5))
        _write(drive, table[index], int(self.forms[index]), actions)
        return actions[actions[:, DURATION] > 0.0]


@lean
def _write(drive: Drive, first: Array, form: int, actions: Array) -> None:
    """Write the actions (3, 5) of one form of way out; what is left out lasts no time."""
    swerve, straight = form % _SWERVES, _STRAIGHT[form // _SWERVES]
    turn = (swerve - 1) % len(_TURNS)
    for row in range(3):
        actions[row, RATE_V], actions[row, RATE_OMEGA] = drive.a_max, drive.alpha_max
    for column in range(DURATION):
        actions[0, column] = first[column]
        if turn == 0:
            actions[1, column] = first[column]
    actions[0, DURATION] = drive.period
    if turn > 0:
        actions[1, TARGET_V] = _speed(drive, _AHEAD[turn])
        actions[1, TARGET_OMEGA] = _TURNS[turn] * drive.omega_max
    actions[1, DURATION] = _HOLDS[(swerve - 1) // len(_TURNS)] if swerve > 0 else 0.0
    actions[2, TARGET_V], actions[2, TARGET_OMEGA] = _speed(drive, straight), 0.0
    actions[2, DURATION] = abs(straight)


@lean
def _speed(drive: Drive, sign: float) -> float:
    """Full speed ahead (+) or back (-), or none [m/s]."""
    if sign > 0.0:
        return drive.v_max
    return -drive.v_reverse if sign < 0.0 else 0.0


@lean
def _velocity_after(
    drive: Drive, actions: Array, k: int, v: float, omega: float, step: float
) -> tuple[float, float]:
    """Velocities a step later, under the k-th action or, after the last one, braking."""
    if k < actions.shape[0]:
        row = actions[k]
        return (
            velocity_after(v, row[TARGET_V], row[RATE_V], step),
            velocity_after(omega, row[TARGET_OMEGA], row[RATE_OMEGA], step),
        )
    duration = stopping_duration(drive, v, omega)
    left = max(1.0 - step / duration, 0.0) if duration > 0.0 else 0.0
    return left * v, left * omega


@lean
def _lasts(
    drive: Drive,
    world: EdgeMap,
    movers: Movers,
    outline: Outline,
    margin: float,
    growth: float,
    horizon: float,
    pose: Pose,
    v: float,
    omega: float,
    actions: Array,
) -> tuple[float, float, float, float]:
    """How long actions (k, 5), then braking and standing, meet nothing that moves.

    Returns:
        Time [s], infinite if nothing is met until the horizon; -1 if what rests is in the
        way. The last pose looked at: x, y [m], heading [rad].
    """
    x, y, c, s = pose
    time, k = 0.0, 0
    left = actions[0, DURATION] if actions.shape[0] > 0 else 0.0
    if meets_mover(movers, outline, margin, x, y, c, s, time):
        return 0.0, x, y, math.atan2(s, c)
    while time < horizon:
        while k < actions.shape[0] and left <= 1e-9:
            k += 1
            left = actions[k, DURATION] if k < actions.shape[0] else 0.0
        step = drive.period
        if k < actions.shape[0]:
            step = min(step, left)
            left -= step
        elif v == 0.0 and omega == 0.0:
            step = _LOOK
        v1, w1 = _velocity_after(drive, actions, k, v, omega, step)
        way, turn = 0.5 * (v + v1) * step, 0.5 * (omega + w1) * step
        x, y, c, s = arc(x, y, c, s, way, turn)
        v, omega, time = v1, w1, time + step
        moved = way != 0.0 or turn != 0.0
        if moved and not is_clear(world, outline, x, y, c, s, margin):
            return -1.0, x, y, math.atan2(s, c)
        grown = margin + growth * half_way(movers, outline, way, turn, step)
        if meets_mover(movers, outline, grown, x, y, c, s, time):
            return time, x, y, math.atan2(s, c)
    return math.inf, x, y, math.atan2(s, c)


@kernel
def lasts(
    drive: Drive,
    world: EdgeMap,
    movers: Movers,
    outline: Outline,
    margin: float,
    horizon: float,
    pose: Pose,
    v: float,
    omega: float,
    actions: Array,
) -> float:
    """How long a sequence of actions (k, 5), braking and standing meet nothing [s].

    Infinite if nothing that moves is met until the horizon, -1 if what rests is in the way.
    """
    return _lasts(
        drive, world, movers, outline, margin, 1.0, horizon, pose, v, omega, actions
    )[0]  # fmt: skip


@kernel
def longest_ways(
    drive: Drive,
    world: EdgeMap,
    movers: Movers,
    outline: Outline,
    margin: float,
    growth: float,
    horizon: float,
    pose: Pose,
    v: float,
    omega: float,
    table: Array,
    free: NDArray[np.bool_],
    kept: Array,
    kept_index: int,
) -> tuple[Array, NDArray[np.int64], Array, Array]:
    """The longest way out that begins with each first action.

    Args:
        drive: limits and times.
        world: what rests.
        movers: what moves.
        outline: the base's.
        margin: distance to be kept [m].
        growth: share of the way between two checks that the margin is grown by, so that
            nothing slips through: 1, or 0 if nothing else is left.
        horizon: how far to look [s].
        pose: x, y [m], cosine and sine of the heading.
        v: speed [m/s].
        omega: turn rate [rad/s].
        table: (n, 6) first actions, the last one is the brake.
        free: (n,) which of them keep clear of what rests, braking included.
        kept: (k, 5) what is left of the last step's way out.
        kept_index: the row that it begins with; negative if there is none.

    Returns:
        (n,) times, (n,) forms, (n, 3) ends, (n,) times at rest; see
        `WaysOut`. Of equal ways out the simplest.
    """
    count = table.shape[0]
    times, stands = np.full(count, -1.0), np.full(count, -1.0)
    forms, ends = np.zeros(count, dtype=np.int64), np.zeros((count, 3))
    actions = np.empty((3, 5))
    for index in range(count):
        if not free[index]:
            continue
        for form in range(-1 if index == kept_index else 0, _FORMS):
            if form >= 0:
                _write(drive, table[index], form, actions)
            time, x, y, heading = _lasts(
                drive, world, movers, outline, margin, growth, horizon, pose, v, omega,
                kept if form < 0 else actions,
            )  # fmt: skip
            if form == 0:
                v1 = v + table[index, ACCELERATION] * drive.period
                w1 = omega + table[index, ALPHA] * drive.period
                stands[index] = time - drive.period - stopping_duration(drive, v1, w1)
            if time > times[index]:
                times[index], forms[index] = time, form
                ends[index, 0], ends[index, 1], ends[index, 2] = x, y, heading
            if times[index] == math.inf and form >= 0:
                break
    return times, forms, ends, stands
