"""What the band's residuals are made of: limits, weights, ends, obstacles near it."""

from __future__ import annotations

import math
from typing import NamedTuple

from motm_wbc.basenav.teb_obstacles import Parts
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits


class Terms(NamedTuple):
    """Limits, weights and distances of the residuals.

    Attributes:
        v_max: [m/s].
        v_reverse: positive [m/s].
        omega_max: [rad/s].
        a_max: [m/s^2].
        alpha_max: [rad/s^2].
        time: square roots of the weights, of the duration,
        rolling: of slipping sideways,
        forward: of way in reverse,
        speed: of speed beyond its limits,
        turn: of turn rate,
        acceleration: of acceleration,
        turn_acceleration: of angular acceleration,
        obstacle: of coming nearer than `distance`,
        nearness: of coming nearer than `nearness_distance`.
        distance: to obstacles [m].
        nearness_distance: to obstacles [m].
        interval: usual duration of an interval [s].
    """

    v_max: float
    v_reverse: float
    omega_max: float
    a_max: float
    alpha_max: float
    time: float
    rolling: float
    forward: float
    speed: float
    turn: float
    acceleration: float
    turn_acceleration: float
    obstacle: float
    nearness: float
    distance: float
    nearness_distance: float
    interval: float


def terms_of(limits: BaseLimits, parameters: TebParameters) -> Terms:
    """Pack limits and weights for the kernels."""
    p = parameters
    return Terms(
        float(limits.v_max),
        float(limits.v_reverse),
        float(limits.omega_max),
        float(limits.a_max),
        float(limits.alpha_max),
        math.sqrt(p.time_weight),
        math.sqrt(p.rolling_weight),
        math.sqrt(p.forward_weight),
        math.sqrt(p.speed_weight),
        math.sqrt(p.turn_weight),
        math.sqrt(p.acceleration_weight),
        math.sqrt(p.turn_acceleration_weight),
        math.sqrt(p.obstacle_weight),
        math.sqrt(p.nearness_weight),
        p.distance,
        p.nearness_distance,
        p.interval,
    )


class Ends(NamedTuple):
    """Velocities at the band's ends.

    Attributes:
        v: speed at the start [m/s].
        omega: turn rate at the start [rad/s].
        stop: the base is at rest at the end; else its velocity there is free.
    """

    v: float
    omega: float
    stop: bool


class Neighbours(NamedTuple):
    """Obstacles near the band (see `near_parts`).

    Attributes:
        footprint: (m, 4) corners and normals in the base frame.
        parts: all obstacles.
        places: (k,) where on the band.
        which: (k,) index of the part.
        moved: (k, 2) way of the part until then [m].
    """

    footprint: Array
    parts: Parts
    places: Indices
    which: Indices
    moved: Array
