"""The candidates on the ring about a target, and what of their costs can be kept.

A candidate never moves and is judged by the true footprint at its heading. What the way to
it needs of the world, the corners in sight of it, depends on the target only and is worked
out once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.goal_field import GoalField, by_chain, cost_to_go
from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.pathrtr import direct_time, end_turn
from motm_wbc.basenav.visibility import (
    NEITHER,
    line_of_sight,
    may_be_tangent,
    push_out,
    tangent_side,
)
from motm_wbc.basenav.walls import TOUCH, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

REASONS = ("", "collision", "out of reach", "unreachable")
FREE, COLLISION, OUT_OF_REACH, UNREACHABLE = range(4)


class Fans(NamedTuple):
    """Tangents from some places to the corners that they see.

    Attributes:
        places: (m, 3) x, y of the nearest free point and the distance to it [m].
        start: (m + 1,) first tangent of each place.
        chain: (t,) chain that the tangent leads to (see `graph`).
        values: (t, 3) direction [rad], length [m], turn on the chain [rad].
    """

    places: Array
    start: Indices
    chain: Indices
    values: Array


@dataclass(frozen=True)
class Ring:
    """Candidates about a target; number 2 k + s is at position k with sense s.

    Attributes:
        poses: (2 n, 3); sense 0 goes round the target counter-clockwise, sense 1 clockwise.
        rejections: (2 n,) index into `REASONS`.
        fans: of the n positions.
    """

    poses: Array
    rejections: Indices
    fans: Fans


def ring_poses(target_xy: Array, count: int, radius: float) -> Array:
    """(2 count, 3) poses on the circle about a target, tangential, both ways round."""
    angles = np.arange(count) * (math.tau / count)
    poses = np.empty((2 * count, 3))
    for sense, quarter in enumerate((0.5 * math.pi, -0.5 * math.pi)):
        poses[sense::2, 0] = target_xy[0] + radius * np.cos(angles)
        poses[sense::2, 1] = target_xy[1] + radius * np.sin(angles)
        heading = angles + quarter
        poses[sense::2, 2] = np.arctan2(np.sin(heading), np.cos(heading))
    return poses


@kernel
def clear_poses(edges: EdgeMap, outline: Outline, poses: Array, margin: float) -> Indices:
    """(m,) 1 where the footprint at the pose overlaps nothing, else 0."""
    clear = np.zeros(poses.shape[0], dtype=np.int64)
    for i in range(poses.shape[0]):
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        if is_clear(edges, outline, poses[i, 0], poses[i, 1], c, s, margin):
            clear[i] = 1
    return clear


@kernel
def tangent_fans(walls: Walls, positions: Array) -> Fans:
    """Tangents from positions (m, 2) [m] to corners in sight.

    A position inside what is blocked counts as its nearest free point.
    """
    corners = walls.corners
    count = positions.shape[0]
    places = np.empty((count, 3))
    start = np.zeros(count + 1, dtype=np.int64)
    most = max(1, count * corners.shape[0])
    chain = np.empty(most, dtype=np.int64)
    values = np.empty((most, 3))
    size = 0
    for i in range(count):
        push = push_out(walls, positions[i, 0], positions[i, 1], places[i])
        if push <= TOUCH:
            places[i, 0], places[i, 1], push = positions[i, 0], positions[i, 1], 0.0
        places[i, 2] = push
        x, y = places[i, 0], places[i, 1]
        for corner in range(corners.shape[0]):
            cx, cy = corners[corner, X], corners[corner, Y]
            dx, dy = cx - x, cy - y
            if not may_be_tangent(corners, corner, dx, dy):
                continue
            length = math.sqrt(dx * dx + dy * dy)
            if length <= TOUCH:
                continue
            side = tangent_side(corners, walls.links, corner, dx / length, dy / length)
            if side == NEITHER or not line_of_sight(walls, x, y, cx, cy):
                continue
            angle = math.atan2(dy, dx)
            chain[size] = 2 * corner + side
            values[size, 0], values[size, 1] = angle, length
            values[size, 2] = chain_turn(corners, corner, side, angle)
            size += 1
        start[i + 1] = size
    return Fans(places, start, chain[:size].copy(), values[:size].copy())


@kernel
def times_to(field: GoalField, poses: Array) -> Array:
    """(m,) `cost_to_go` from each pose [s]."""
    times = np.empty(poses.shape[0])
    for i in range(poses.shape[0]):
        times[i] = cost_to_go(field, poses[i, 0], poses[i, 1], poses[i, 2])
    return times


@kernel
def times_from(field: GoalField, fans: Fans, poses: Array) -> Array:
    """(2 n,) time from the place that a field leads to, to each candidate of a ring [s].

    A way driven in the other direction turns as much: with all headings turned about, the
    time from a place to a candidate is that from the candidate to the place. So `field` is
    that of the place with its heading turned about.
    """
    speeds = field.speeds
    gears = 2 if speeds.backward > 0.0 else 1
    times = np.full(poses.shape[0], math.inf)
    gx, gy, toward, extra = field.goals[0]
    for k in range(fans.places.shape[0]):
        x, y = fans.places[k, 0], fans.places[k, 1]
        added = fans.places[k, 2] / speeds.forward
        if line_of_sight(field.walls, x, y, gx, gy):
            for i in range(2 * k, 2 * k + 2):
                heading = poses[i, 2] + math.pi
                for gear in range(gears):
                    time = direct_time(gx - x, gy - y, heading, toward, speeds, gear)
                    times[i] = min(times[i], time + added + extra)
            continue
        for t in range(fans.start[k], fans.start[k + 1]):
            angle, length, turn = fans.values[t, 0], fans.values[t, 1], fans.values[t, 2]
            for gear in range(gears):
                speed = speeds.forward if gear == 0 else speeds.backward
                time = length / speed + added
                time += by_chain(
                    field.chain_start,
                    field.exit_turn,
                    field.exit_cost,
                    fans.chain[t],
                    turn,
                    gear,
                    speeds.turning,
                )
                for i in range(2 * k, 2 * k + 2):
                    turned = end_turn(angle, poses[i, 2] + math.pi, gear)
                    times[i] = min(times[i], time + turned / speeds.turning)
    return times
