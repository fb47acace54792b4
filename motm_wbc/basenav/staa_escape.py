"""First actions among moving obstacles: which are safe, and what is left if none is.

An action is safe if the base, having executed its command period and braked to rest on its
arc, can stand there for a while before anything meets it. So it is never hit but at rest. If
no action is safe, the one is taken that meets nothing for longest, be it driving away.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.movers import Movers, meets_mover
from motm_wbc.basenav.staa_admissible import (
    ACCELERATION,
    ALPHA,
    RATE_OMEGA,
    RATE_V,
    TARGET_OMEGA,
    TARGET_V,
    check_spacing,
    executed,
)
from motm_wbc.basenav.staa_motion import (
    Drive,
    arc,
    stopping_duration,
    stopping_span,
    velocity_after,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_HOLDS = (0.0, 0.3, 0.6, 1.0, 1.5)  # [s] that an escape keeps its first action
_AFTER = (0.0, 1.0, -1.0)  # then: brake, straight ahead, straight back
_STRAIGHT = 1.5  # [s] for which it drives straight before it brakes

Pose = tuple[float, float, float, float]


@lean
def braking_pose(drive: Drive, pose: Pose, v: float, omega: float, time: float) -> Pose:
    """Pose `time` [s] after a base at `pose` has begun to brake to rest on its arc."""
    duration = stopping_duration(drive, v, omega)
    left = max(1.0 - time / duration, 0.0) if duration > 0.0 else 0.0
    way = (1.0 - left * left) * stopping_span(drive, v, omega)
    return arc(pose[0], pose[1], pose[2], pose[3], v * way, omega * way)


@lean
def first_contact(
    drive: Drive,
    movers: Movers,
    outline: Outline,
    margin: float,
    standing: float,
    pose: Pose,
    v: float,
    omega: float,
    a: float,
    alpha: float,
) -> float:
    """When a moving obstacle meets the base that obeys a command, brakes and stands [s].

    It is looked for so often that nothing can slip through between (see `check_spacing`);
    infinite if there is none until it has stood for `standing` [s].
    """
    end = executed(drive, pose, v, omega, a, alpha)
    v1, w1 = v + a * drive.period, omega + alpha * drive.period
    horizon = drive.period + stopping_duration(drive, v1, w1) + standing
    turning = max(abs(omega), abs(w1)) * outline.radius
    speed = max(abs(v), abs(v1)) + turning + movers.fastest
    count = max(math.ceil(horizon * speed / check_spacing(margin)), 1)
    for k in range(count + 1):
        time = horizon * k / count
        if time < drive.period:
            way, turn = (v + 0.5 * a * time) * time, (omega + 0.5 * alpha * time) * time
            x, y, c, s = arc(pose[0], pose[1], pose[2], pose[3], way, turn)
        else:
            x, y, c, s = braking_pose(drive, end, v1, w1, time - drive.period)
        if meets_mover(movers, outline, margin, x, y, c, s, time):
            return float(time)
    return math.inf


@kernel
def contact_times(
    drive: Drive,
    movers: Movers,
    outline: Outline,
    margin: float,
    standing: float,
    pose: Pose,
    v: float,
    omega: float,
    table: Array,
) -> Array:
    """`first_contact` of each first action of a table (n, 6)."""
    times = np.empty(table.shape[0])
    for index in range(times.size):
        times[index] = first_contact(
            drive, movers, outline, margin, standing, pose, v, omega,
            table[index, ACCELERATION], table[index, ALPHA],
        )  # fmt: skip
    return times


@lean
def _escape_time(
    drive: Drive,
    world: EdgeMap,
    movers: Movers,
    outline: Outline,
    margin: float,
    horizon: float,
    pose: Pose,
    v: float,
    omega: float,
    action: Array,
    hold: float,
    after: float,
) -> float:
    """How long a way out meets nothing that moves.

    It is an action, kept for `hold` [s]; then straight ahead (`after` 1) or back (-1) for a
    while, or not (0); then braking and standing.

    Returns:
        Time [s], infinite if nothing is met until the horizon; -1 if what rests is in the way.
    """
    x, y, c, s = pose
    period, time = drive.period, 0.0
    if meets_mover(movers, outline, margin, x, y, c, s, time):
        return 0.0
    while time < horizon:
        if time < hold or time == 0.0:
            v1 = velocity_after(v, action[TARGET_V], action[RATE_V], period)
            w1 = velocity_after(omega, action[TARGET_OMEGA], action[RATE_OMEGA], period)
        elif after != 0.0 and time < hold + _STRAIGHT:
            target = drive.v_max if after > 0.0 else -drive.v_reverse
            v1 = velocity_after(v, target, drive.a_max, period)
            w1 = velocity_after(omega, 0.0, drive.alpha_max, period)
        else:
            duration = stopping_duration(drive, v, omega)
            left = max(1.0 - period / duration, 0.0) if duration > 0.0 else 0.0
            v1, w1 = left * v, left * omega
        way, turn = 0.5 * (v + v1) * period, 0.5 * (omega + w1) * period
        speed = abs(way) + abs(turn) * outline.radius
        x, y, c, s = arc(x, y, c, s, way, turn)
        v, omega, time = v1, w1, time + period
        if speed > 0.0 and not is_clear(world, outline, x, y, c, s, margin):
            return -1.0
        grown = margin + 0.5 * (speed + movers.fastest * period)
        if meets_mover(movers, outline, grown, x, y, c, s, time):
            return time
    return math.inf


@kernel
def escape(
    drive: Drive,
    world: EdgeMap,
    movers: Movers,
    outline: Outline,
    margin: float,
    horizon: float,
    pose: Pose,
    v: float,
    omega: float,
    table: Array,
    free: NDArray[np.bool_],
) -> int:
    """The first action that meets nothing for longest, if it is kept for a while.

    Args:
        drive: limits and times.
        world: what rests.
        movers: what moves.
        outline: the base's.
        margin: distance to be kept [m].
        horizon: how far to look [s].
        pose: x, y [m], cosine and sine of the heading.
        v: speed [m/s].
        omega: turn rate [rad/s].
        table: (n, 6) first actions, the last one is the brake.
        free: (n,) which of them keep clear of what rests, braking included.

    Returns:
        Its index; of equals the simplest and shortest way out, the brake before all others.
    """
    best = int(table.shape[0]) - 1
    longest = _escape_time(
        drive, world, movers, outline, margin, horizon, pose, v, omega, table[best], 0.0, 0.0
    )
    for after in _AFTER:
        for hold in _HOLDS:
            for index in range(table.shape[0] - 1):
                if longest == math.inf:
                    return best
                if not free[index]:
                    continue
                time = _escape_time(
                    drive, world, movers, outline, margin, horizon, pose, v, omega,
                    table[index], hold, after,
                )  # fmt: skip
                if time > longest:
                    best, longest = index, time
    return best
