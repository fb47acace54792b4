"""PathRTR: the time to drive a polyline by rotating, translating, rotating.

Source: Missura, Roychoudhury, Bennewitz, "Fast-Replanning Motion Control for
Non-Holonomic Vehicles with Aborting A*" (2109.07775); with oriented start and goal and
rotation in the global cost: Burgess-Limerick et al., "Enabling Failure Recovery for
On-The-Move Mobile Manipulation" (2305.08351).

With the segments' directions phi_i, turns wrapped to [-pi, pi] and the length L,

    forward  = (|phi_0 - theta_s| + sum |phi_i - phi_i-1| + |theta_g - phi_last|) / omega + L / v
    backward = the same with theta_s + pi, theta_g + pi and the reverse speed.

A free heading (None here, NaN in kernels) makes its term zero. The whole path is driven in
one gear. If start and goal are one place, what is left is |theta_g - theta_s| / omega.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

from motm_wbc.basenav.walls import TOUCH
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import lean

FORWARD, BACKWARD = 0, 1


class Speeds(NamedTuple):
    """What turns length and turning into time.

    Attributes:
        forward: [m/s], > 0.
        backward: speed in reverse [m/s]; 0 forbids it.
        turning: [rad/s], > 0.
    """

    forward: float
    backward: float
    turning: float


def path_time(
    points: Array,
    start_heading: float | None,
    goal_heading: float | None,
    speeds: Speeds,
    backward: bool = False,
) -> float:
    """PathRTR [s] of a polyline in one gear.

    Args:
        points: (k, 2) [m], k >= 1; points nearer than 1e-9 m to the one before are left out.
        start_heading: [rad], None: free.
        goal_heading: [rad], None: free.
        speeds: speeds of the base.
        backward: the path is driven in reverse; infinite if `speeds.backward` is 0.
    """
    speed = speeds.backward if backward else speeds.forward
    directions, length = _directions(points)
    if not directions:
        if start_heading is None or goal_heading is None:
            return 0.0
        return abs(wrap(goal_heading - start_heading)) / speeds.turning
    if speed <= 0.0:
        return math.inf
    flip = math.pi if backward else 0.0
    chain = [*directions]
    if start_heading is not None:
        chain.insert(0, start_heading + flip)
    if goal_heading is not None:
        chain.append(goal_heading + flip)
    turned = sum(abs(wrap(after - before)) for before, after in itertools.pairwise(chain))
    return turned / speeds.turning + length / speed


def _directions(points: Array) -> tuple[list[float], float]:
    """Directions of the segments [rad] and their length in all [m]."""
    directions: list[float] = []
    length = 0.0
    (x, y), *rest = points.tolist()
    for next_x, next_y in rest:
        dx, dy = next_x - x, next_y - y
        step = math.hypot(dx, dy)
        if step > TOUCH:
            directions.append(math.atan2(dy, dx))
            length += step
            x, y = next_x, next_y
    return directions, length


@lean
def turn_between(first: float, second: float) -> float:
    """|second - first| wrapped to [0, pi] [rad]; zero if one of them is NaN, i.e. free."""
    turned = abs(second - first)
    if turned >= math.tau:
        turned %= math.tau
    if turned > math.pi:
        turned = math.tau - turned
    return 0.0 if math.isnan(turned) else turned


@lean
def end_turn(direction: float, heading: float, gear: int) -> float:
    """Turn between a heading and the path at one of its ends [rad], in the given gear."""
    if math.isnan(heading):
        return 0.0
    turned = turn_between(direction, heading)
    return math.pi - turned if gear == BACKWARD else turned


@lean
def direct_time(
    dx: float, dy: float, start: float, goal: float, speeds: Speeds, gear: int
) -> float:
    """PathRTR [s] of one segment (dx, dy) [m] between headings `start` and `goal` [rad]."""
    length = math.sqrt(dx * dx + dy * dy)
    if length <= TOUCH:
        return turn_between(start, goal) / speeds.turning
    speed = speeds.backward if gear == BACKWARD else speeds.forward
    if speed <= 0.0:
        return math.inf
    direction = math.atan2(dy, dx)
    turned = end_turn(direction, start, gear) + end_turn(direction, goal, gear)
    return turned / speeds.turning + length / speed
