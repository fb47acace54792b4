"""Which first actions are safe: from where the command leads, the base can brake to rest.

Only the command period of an action is executed before the next plan. So the footprint is
checked over that period and over the braking arc that follows it. Then the brake is left
as an action at every later step, and a base that starts safely stays so.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.staa_motion import (
    Drive,
    arc,
    braking_rates,
    command,
    profile,
    stopping_span,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean
from motm_wbc.geometry.wrapping import wrapped

RATE_V, TARGET_V, RATE_OMEGA, TARGET_OMEGA, ACCELERATION, ALPHA = range(6)
"""Columns of the table of first actions."""

_INSET = 0.005  # [m] and [rad] that poses at rest keep from the region's rim: plants differ
_FINEST = 0.01  # [m] least distance between checked poses
_HALVINGS = 12


class Keep(NamedTuple):
    """The region in which the base must be able to come to rest.

    Attributes:
        applies: whether there is one.
        arm_x: the arm's base in the base frame [m].
        arm_y: the same.
        radius: largest distance from the arm's base to the object [m].
        bearing: largest angle of the object off the heading, seen from there [rad].
        object_x: the object in the world [m].
        object_y: the same.
    """

    applies: bool
    arm_x: float
    arm_y: float
    radius: float
    bearing: float
    object_x: float
    object_y: float


@lean
def in_reach(keep: Keep, inset: float, x: float, y: float, c: float, s: float) -> bool:
    """Whether the object is in the arm's range, less `inset` [m and rad], at this pose."""
    radius = keep.radius - inset
    dx = keep.object_x - (x + c * keep.arm_x - s * keep.arm_y)
    dy = keep.object_y - (y + s * keep.arm_x + c * keep.arm_y)
    if dx * dx + dy * dy > radius * radius:
        return False
    return abs(math.atan2(c * dy - s * dx, c * dx + s * dy)) <= keep.bearing - inset


@lean
def check_spacing(margin: float) -> float:
    """Distance between checked poses that no point can slip through [m].

    What enters and leaves a convex outline, grown by the margin, within this way gets less
    than the margin deep: it never meets the outline itself.
    """
    return max(1.9 * margin, _FINEST)


@lean
def arc_is_clear(
    world: EdgeMap,
    outline: Outline,
    margin: float,
    pose: tuple[float, float, float, float],
    distance: float,
    turn: float,
) -> bool:
    """Whether the base can drive an arc from `pose` (x, y, cos, sin), its end included."""
    x, y, c, s = pose
    way = abs(distance) + abs(turn) * outline.radius
    count = max(math.ceil(way / check_spacing(margin)), 1)
    for k in range(1, count + 1):
        share = k / count
        px, py, pc, ps = arc(x, y, c, s, share * distance, share * turn)
        if not is_clear(world, outline, px, py, pc, ps, margin):
            return False
    return True


@lean
def margin_left(
    drive: Drive,
    world: EdgeMap,
    outline: Outline,
    margin: float,
    pose: tuple[float, float, float, float],
    v: float,
    omega: float,
) -> float:
    """The largest margin, up to `margin`, that pose and braking arc keep; -1 on contact.

    A base that stands inside the margin may go on there, but no deeper.
    """
    span = stopping_span(drive, v, omega)
    kept, high = -1.0, margin
    tried = margin
    for halving in range(_HALVINGS + 2):
        x, y, c, s = pose
        if is_clear(world, outline, x, y, c, s, tried) and arc_is_clear(
            world, outline, tried, pose, v * span, omega * span
        ):
            kept = tried
            if halving == 0:
                return kept
        elif halving == 1:
            return -1.0
        else:
            high = tried
        tried = 0.0 if halving == 0 else 0.5 * (kept + high)
    return kept


@lean
def executed(
    drive: Drive,
    pose: tuple[float, float, float, float],
    v: float,
    omega: float,
    a: float,
    alpha: float,
) -> tuple[float, float, float, float]:
    """Pose after one command, ramped by control steps as the base is driven."""
    x, y, c, s = pose
    for k in range(1, drive.ramp_steps + 1):
        time = k * drive.ramp
        distance, turn = (v + a * time) * drive.ramp, (omega + alpha * time) * drive.ramp
        x, y, c, s = arc(x, y, c, s, distance, turn)
    return x, y, c, s


@lean
def first_action(
    drive: Drive,
    linear: int,
    angular: int,
    extra: Array,
    index: int,
    v: float,
    omega: float,
) -> tuple[float, float, float, float, float, float]:
    """A row of the table of first actions; the last index is the brake."""
    grid = linear * angular
    if index == grid + extra.shape[0]:
        rate_v, rate_w = braking_rates(drive, v, omega)
        target_v = target_w = 0.0
    elif index >= grid:
        row = extra[index - grid]
        rate_v, target_v = row[RATE_V], row[TARGET_V]
        rate_w, target_w = row[RATE_OMEGA], row[TARGET_OMEGA]
    else:
        target_v, rate_v = profile(
            v, index // angular, linear, drive.a_max, -drive.v_reverse, drive.v_max, drive.step
        )
        target_w, rate_w = profile(
            omega,
            index % angular,
            angular,
            drive.alpha_max,
            -drive.omega_max,
            drive.omega_max,
            drive.step,
        )
    a = command(v, target_v, rate_v, drive.period)
    alpha = command(omega, target_w, rate_w, drive.period)
    return rate_v, target_v, rate_w, target_w, a, alpha


@kernel
def first_actions(
    drive: Drive,
    world: EdgeMap,
    outline: Outline,
    keep: Keep,
    linear: int,
    angular: int,
    margin: float,
    pose: Array,
    v: float,
    omega: float,
    extra: Array,
    slack: float,
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_], Array]:
    """All first actions, and which of them are admissible.

    Args:
        drive: limits and times.
        world: the obstacles.
        outline: the base's.
        keep: where the base must be able to come to rest. It binds while the base is there;
            where no action can keep it there, the brake is left.
        linear: number of accelerations.
        angular: number of angular accelerations.
        margin: distance to be kept [m], what `margin_left` has found.
        pose: (3,) of the base.
        v: speed [m/s].
        omega: turn rate [rad/s].
        extra: (m, >= 4) further actions: rate and target of v and of omega.
        slack: by how much these may come nearer than the margin [m].

    Returns:
        (n, 6) actions: the grid, the further ones, the brake; (n,) free of overlap; (n,)
        admissible: kept in the region as well; (n, 3) poses at rest after the command and
        braking.
    """
    count = linear * angular + extra.shape[0] + 1
    table = np.empty((count, 6))
    clear = np.zeros(count, dtype=np.bool_)
    admissible = np.zeros(count, dtype=np.bool_)
    rests = np.empty((count, 3))
    c, s = math.cos(pose[2]), math.sin(pose[2])
    binds = keep.applies and in_reach(keep, 0.0, pose[0], pose[1], c, s)
    for index in range(count):
        row = first_action(drive, linear, angular, extra, index, v, omega)
        for column in range(6):
            table[index, column] = row[column]
        a, alpha = row[ACCELERATION], row[ALPHA]
        is_brake = index == count - 1
        kept = margin - slack if linear * angular <= index < count - 1 else margin
        free, rest = _outcome(drive, world, outline, kept, is_brake, pose, v, omega, a, alpha)
        clear[index] = admissible[index] = free
        for axis in range(3):
            rests[index, axis] = rest[axis]
        if binds and not is_brake:
            c, s = math.cos(rest[2]), math.sin(rest[2])
            admissible[index] = free and in_reach(keep, _INSET, rest[0], rest[1], c, s)
    return table, clear, admissible, rests


@lean
def _outcome(
    drive: Drive,
    world: EdgeMap,
    outline: Outline,
    margin: float,
    is_brake: bool,
    pose: Array,
    v: float,
    omega: float,
    a: float,
    alpha: float,
) -> tuple[bool, tuple[float, float, float]]:
    """Whether a command and braking after it are free of overlap; the pose at rest."""
    begin = (pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2]))
    end = executed(drive, begin, v, omega, a, alpha)
    v1, w1 = v + a * drive.period, omega + alpha * drive.period
    span = stopping_span(drive, v1, w1)
    x, y, _, _ = arc(end[0], end[1], end[2], end[3], v1 * span, w1 * span)
    # The sum over the control steps, each of which turns at the rate that it ends with.
    turned = 0.5 * (omega + w1) * drive.period + 0.5 * (w1 - omega) * drive.ramp
    rest = (x, y, wrapped(pose[2] + turned + w1 * span))
    # The brake stays on the arc that was found free when the margin was measured.
    free = is_brake or (
        _command_is_clear(drive, world, outline, margin, begin, v, omega, a, alpha)
        and arc_is_clear(world, outline, margin, end, v1 * span, w1 * span)
    )
    return free, rest


@lean
def _command_is_clear(
    drive: Drive,
    world: EdgeMap,
    outline: Outline,
    margin: float,
    pose: tuple[float, float, float, float],
    v: float,
    omega: float,
    a: float,
    alpha: float,
) -> bool:
    """Whether the command period itself is free of overlap."""
    x, y, c, s = pose
    since = 0.0
    for k in range(1, drive.ramp_steps + 1):
        time = k * drive.ramp
        distance, turn = (v + a * time) * drive.ramp, (omega + alpha * time) * drive.ramp
        x, y, c, s = arc(x, y, c, s, distance, turn)
        since += abs(distance) + abs(turn) * outline.radius
        if k == drive.ramp_steps or since > 0.5 * check_spacing(margin):
            since = 0.0
            if not is_clear(world, outline, x, y, c, s, margin):
                return False
    return True
