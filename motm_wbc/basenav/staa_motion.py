"""How the base moves under an action, and how it brakes, as compiled kernels.

An action moves each velocity towards a target at a constant rate and then holds it, so
that speed limits and standstill are met exactly. A step is driven on arcs of constant
velocity, its mean over each part of the step (STAA*, arc motion model).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.jit import lean

_STRAIGHT = 1e-9  # [rad] turned below which the arc's series is exact


class Drive(NamedTuple):
    """Limits of the base and the times of the planner.

    Attributes:
        v_max: forward speed [m/s].
        v_reverse: backward speed, positive [m/s].
        omega_max: turn rate [rad/s].
        a_max: acceleration along the heading [m/s^2].
        alpha_max: angular acceleration [rad/s^2].
        step: duration of a node's action [s].
        period: duration of a command [s].
        ramp: duration of a control step, the period's part [s].
        ramp_steps: control steps of a period.
    """

    v_max: float
    v_reverse: float
    omega_max: float
    a_max: float
    alpha_max: float
    step: float
    period: float
    ramp: float
    ramp_steps: int


def drive_of(limits: BaseLimits, step: float, period: float, ramp_steps: int) -> Drive:
    """Pack limits and times for the kernels."""
    return Drive(
        float(limits.v_max),
        float(limits.v_reverse),
        float(limits.omega_max),
        float(limits.a_max),
        float(limits.alpha_max),
        float(step),
        float(period),
        float(period) / ramp_steps,
        int(ramp_steps),
    )


@lean
def profile(
    velocity: float, index: int, count: int, rate: float, low: float, high: float, step: float
) -> tuple[float, float]:
    """Target and rate of one of `count` actions, evenly from -rate to +rate.

    The weakest action that would pass through standstill within the step ends there, so
    that the base can come to rest exactly; stronger ones pass.

    Args:
        velocity: at the start of the step.
        index: of the action; count // 2 holds the velocity.
        count: number of actions, odd.
        rate: largest acceleration.
        low: least velocity allowed.
        high: largest velocity allowed.
        step: duration [s].

    Returns:
        Target velocity, and the rate at which it is approached (>= 0).
    """
    half = count // 2
    level = abs(index - half)
    if level == 0:
        return velocity, 0.0
    acceleration = rate * level / half
    sign = 1.0 if index > half else -1.0
    target = min(max(velocity + sign * acceleration * step, low), high)
    weaker = rate * (level - 1) / half
    if velocity * sign < 0.0 and velocity * target < 0.0 and abs(velocity) > weaker * step:
        target = 0.0
    return target, acceleration


@lean
def velocity_after(velocity: float, target: float, rate: float, time: float) -> float:
    """Velocity after `time` [s] on the way to the target."""
    if abs(target - velocity) <= rate * time or rate == 0.0:
        return target
    return velocity + (rate if target > velocity else -rate) * time


@lean
def travel(velocity: float, target: float, rate: float, time: float) -> float:
    """Distance driven (or angle turned) in `time` [s] on the way to the target."""
    if rate == 0.0:
        return target * time
    ramp = min(abs(target - velocity) / rate, time)
    signed = rate if target > velocity else -rate
    reached = velocity + signed * ramp
    return (velocity + 0.5 * signed * ramp) * ramp + reached * (time - ramp)


@lean
def arc(
    x: float, y: float, c: float, s: float, distance: float, turn: float
) -> tuple[float, float, float, float]:
    """Pose at the end of an exact arc; the heading is (c, s) = (cos, sin).

    Args:
        x: start [m].
        y: start [m].
        c: cosine of the heading at the start.
        s: sine of it.
        distance: driven along the arc, negative backwards [m].
        turn: angle turned [rad].
    """
    if abs(turn) < _STRAIGHT:
        along, across = distance, 0.5 * turn * distance
        ct, st = 1.0, turn
    else:
        ct, st = math.cos(turn), math.sin(turn)
        along, across = distance * st / turn, distance * (1.0 - ct) / turn
    return x + c * along - s * across, y + s * along + c * across, c * ct - s * st, s * ct + c * st


@lean
def stopping_duration(drive: Drive, v: float, omega: float) -> float:
    """Time to rest with v and omega shrinking together, the fastest within limits [s]."""
    return max(abs(v) / drive.a_max, abs(omega) / drive.alpha_max)


@lean
def stopping_span(drive: Drive, v: float, omega: float) -> float:
    """Duration at constant (v, omega) that leads as far as braking to rest does [s].

    Both velocities fall in proportion, so the base stays on its circle. Commands last a
    whole period: the last one, which may need less, takes it all; and each control step
    holds the velocity that it ends with, which shortens the way by half a control step.
    """
    duration = stopping_duration(drive, v, omega)
    if duration == 0.0:
        return 0.0
    whole = math.floor(duration / drive.period + 1e-9) * drive.period
    rest = max(1.0 - whole / duration, 0.0)
    span = whole - 0.5 * whole * whole / duration + 0.5 * rest * drive.period
    return span - 0.5 * drive.ramp


@lean
def braking_rates(drive: Drive, v: float, omega: float) -> tuple[float, float]:
    """Decelerations of v and omega for the next period, both >= 0."""
    duration = max(stopping_duration(drive, v, omega), drive.period)
    return abs(v) / duration, abs(omega) / duration


@lean
def command(velocity: float, target: float, rate: float, period: float) -> float:
    """The constant acceleration that the action amounts to over the next period."""
    return (velocity_after(velocity, target, rate, period) - velocity) / period
