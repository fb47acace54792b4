"""The candidates on the ring about a target, and which of them the base can stand at."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

REASONS = ("", "collision", "out of reach", "unreachable")
"""Why a candidate is rejected, in words; the first is for one that is legal."""
FREE, COLLISION, OUT_OF_REACH, UNREACHABLE = range(4)


@dataclass(frozen=True)
class Ring:
    """Candidates about a target; number h k + s is at position k with heading s of h.

    A candidate never moves and is judged by the true footprint at its heading.

    Attributes:
        centre: (2,) the target [m].
        radius: [m].
        each: candidates at a position.
        poses: (m, 3).
        rejections: (m,) index into `REASONS`.
    """

    centre: Array
    radius: float
    each: int
    poses: Array
    rejections: Indices

    @cached_property
    def free(self) -> Array:
        """(k, 3) the poses that are not rejected."""
        return np.asarray(self.poses[self.rejections == FREE])


def make_ring(
    centre: Array,
    radius: float,
    count: int,
    headings: Sequence[float],
    edges: EdgeMap,
    outline: Outline,
    margin: float,
    region: ReachRegion | None,
) -> Ring:
    """The candidates about a target.

    Args:
        centre: (2,) target [m].
        radius: of the ring [m].
        count: positions on it.
        headings: of the candidates at a position, from the counter-clockwise tangent [rad].
        edges: the world about the target, not inflated.
        outline: footprint.
        margin: distance that the footprint keeps [m].
        region: where the arm can work; None: everywhere.
    """
    poses = ring_poses(centre, count, radius, headings)
    rejections = np.where(clear_poses(edges, outline, poses, margin) == 1, FREE, COLLISION)
    if region is not None:
        within = region.contains_each(poses, centre)
        rejections[~within & (rejections == FREE)] = OUT_OF_REACH
    return Ring(centre.copy(), radius, len(headings), poses, rejections.astype(np.int64))


def ring_poses(centre: Array, count: int, radius: float, headings: Sequence[float]) -> Array:
    """(count h, 3) poses on the circle about a target; headings from the tangent [rad]."""
    angles = np.arange(count) * (math.tau / count)
    poses = np.empty((count * len(headings), 3))
    for index, offset in enumerate(headings):
        at = slice(index, None, len(headings))
        poses[at, 0] = centre[0] + radius * np.cos(angles)
        poses[at, 1] = centre[1] + radius * np.sin(angles)
        heading = angles + (0.5 * math.pi + offset)
        poses[at, 2] = np.arctan2(np.sin(heading), np.cos(heading))
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
