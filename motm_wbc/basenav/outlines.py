"""Many polygons in a few arrays: moved, and tested against an ellipse, all at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

APART, MEETS, HOLDS = 0, 1, 2


class Outlines(NamedTuple):
    """Polygons with holes, packed.

    Attributes:
        points: (n, 2) corners of all rings [m].
        ring_start: (r + 1,) first corner of each ring.
        first_ring: (s + 1,) the outline of each polygon; its holes follow.
        box: (s, 4) x and y of the lower, then of the upper bound of each [m].
    """

    points: Array
    ring_start: Indices
    first_ring: Indices
    box: Array


class Ellipse(NamedTuple):
    """What the paths of a given length between two places can reach.

    Points p with |p - first| + |p - second| <= length [m].
    """

    first_x: float
    first_y: float
    second_x: float
    second_y: float
    length: float

    def sum_to(self, x: float, y: float) -> float:
        """|p - first| + |p - second| [m]."""
        return math.hypot(x - self.first_x, y - self.first_y) + math.hypot(
            x - self.second_x, y - self.second_y
        )

    def contains(self, other: Ellipse) -> bool:
        """Whether another one lies inside, as far as the triangle inequality tells."""
        first, second = other[:2], other[2:4]
        apart = min(
            math.dist(self[:2], first) + math.dist(self[2:4], second),
            math.dist(self[:2], second) + math.dist(self[2:4], first),
        )
        return apart + other.length <= self.length

    @property
    def box(self) -> tuple[float, float, float, float]:
        """X and y of the lower, then of the upper bound [m]."""
        dx, dy = self.second_x - self.first_x, self.second_y - self.first_y
        across = max(self.length * self.length - dx * dx - dy * dy, 0.0)
        half_x, half_y = 0.5 * math.sqrt(across + dx * dx), 0.5 * math.sqrt(across + dy * dy)
        x, y = 0.5 * (self.first_x + self.second_x), 0.5 * (self.first_y + self.second_y)
        return x - half_x, y - half_y, x + half_x, y + half_y


EVERYWHERE = Ellipse(0.0, 0.0, 0.0, 0.0, math.inf)


def ellipse_of(first: Array, second: Array, length: float) -> Ellipse:
    """The ellipse about two places (2,) [m]."""
    return Ellipse(
        float(first[0]), float(first[1]), float(second[0]), float(second[1]), float(length)
    )


def pack(polygons: Sequence[tuple[Array, ...]]) -> Outlines:
    """Arrays of polygons, each given by its outline and its holes."""
    rings = [ring for polygon in polygons for ring in polygon]
    points = np.concatenate(rings) if rings else np.empty((0, 2))
    starts = np.cumsum([0, *map(len, rings)]).astype(np.int64)
    firsts = np.cumsum([0, *map(len, polygons)]).astype(np.int64)
    return moved(Outlines(points, starts, firsts, np.empty(0)), np.zeros((len(polygons), 3)))


@kernel
def _move(points: Array, corner_start: Indices, poses: Array, out: Array, box: Array) -> None:
    for solid in range(poses.shape[0]):
        x, y, angle = poses[solid, 0], poses[solid, 1], poses[solid, 2]
        c, s = math.cos(angle), math.sin(angle)
        box[solid, 0], box[solid, 1] = math.inf, math.inf
        box[solid, 2], box[solid, 3] = -math.inf, -math.inf
        for k in range(corner_start[solid], corner_start[solid + 1]):
            px = c * points[k, 0] - s * points[k, 1] + x
            py = s * points[k, 0] + c * points[k, 1] + y
            out[k, 0], out[k, 1] = px, py
            box[solid, 0], box[solid, 1] = min(box[solid, 0], px), min(box[solid, 1], py)
            box[solid, 2], box[solid, 3] = max(box[solid, 2], px), max(box[solid, 3], py)


def moved(outlines: Outlines, poses: Array) -> Outlines:
    """The polygons, each moved rigidly by its pose (s, 3) [m], [rad] from the origin."""
    points = np.empty_like(outlines.points)
    box = np.empty((poses.shape[0], 4))
    _move(outlines.points, outlines.ring_start[outlines.first_ring], poses, points, box)
    points.flags.writeable = False
    return Outlines(points, outlines.ring_start, outlines.first_ring, box)


@kernel
def _from_box(box: Array, x: float, y: float) -> float:
    """Distance of a place to a box (4,) [m]."""
    dx = max(box[0] - x, x - box[2], 0.0)
    dy = max(box[1] - y, y - box[3], 0.0)
    return math.hypot(dx, dy)


@kernel
def _least_sum(ax: float, ay: float, bx: float, by: float, ellipse: Ellipse) -> float:
    """Least |p - first| + |p - second| on the segment from a to b.

    The sum is convex along the line; it is least where a ray from one focus would be
    reflected to the other (or runs through to it).
    """
    length = math.hypot(bx - ax, by - ay)
    along = 0.0
    if length > 0.0:
        ux, uy = (bx - ax) / length, (by - ay) / length
        fx, fy = ellipse.first_x - ax, ellipse.first_y - ay
        gx, gy = ellipse.second_x - ax, ellipse.second_y - ay
        f_along, g_along = fx * ux + fy * uy, gx * ux + gy * uy
        f_off, g_off = abs(ux * fy - uy * fx), abs(ux * gy - uy * gx)
        total = f_off + g_off
        best = f_along if total == 0.0 else (f_along * g_off + g_along * f_off) / total
        along = min(max(best, 0.0), length)
        ax, ay = ax + along * ux, ay + along * uy
    first = math.hypot(ax - ellipse.first_x, ay - ellipse.first_y)
    return first + math.hypot(ax - ellipse.second_x, ay - ellipse.second_y)


@kernel
def _relation(points: Array, ring_start: Indices, first: int, end: int, ellipse: Ellipse) -> int:
    """How the polygon of the rings [first, end) lies to an ellipse: APART, MEETS or HOLDS."""
    inside = False
    x, y = ellipse.first_x, ellipse.first_y
    for ring in range(first, end):
        a = ring_start[ring + 1] - 1
        for b in range(ring_start[ring], ring_start[ring + 1]):
            ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
            if _least_sum(ax, ay, bx, by, ellipse) <= ellipse.length:
                return MEETS
            if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
                inside = not inside
            a = b
    return HOLDS if inside else APART


@kernel
def _relations(
    points: Array, ring_start: Indices, first_ring: Indices, box: Array, ellipse: Ellipse
) -> Indices:
    found = np.full(box.shape[0], APART)
    for solid in range(box.shape[0]):
        apart = _from_box(box[solid], ellipse.first_x, ellipse.first_y)
        apart += _from_box(box[solid], ellipse.second_x, ellipse.second_y)
        if apart <= ellipse.length:
            first, end = first_ring[solid], first_ring[solid + 1]
            found[solid] = _relation(points, ring_start, first, end, ellipse)
    return found


def relations(outlines: Outlines, ellipse: Ellipse) -> Indices:
    """(s,) how each polygon lies to an ellipse.

    APART: they have no point in common. MEETS: an edge of the polygon reaches into the
    ellipse. HOLDS: the ellipse lies in the polygon.
    """
    found: Indices = _relations(*outlines, ellipse)
    return found


def clusters(box: Array) -> Indices:
    """(s,) a number for each box (s, 4); boxes that overlap, also through others, share one."""
    labels: Indices = _clusters(box)
    return labels


@kernel
def _root(parent: Indices, item: int) -> int:
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@kernel
def _clusters(box: Array) -> Indices:
    count = box.shape[0]
    parent = np.arange(count)
    order = np.argsort(box[:, 0], kind="mergesort")
    for i in range(count):
        a = order[i]
        for j in range(i + 1, count):
            b = order[j]
            if box[b, 0] > box[a, 2]:
                break
            if box[b, 1] <= box[a, 3] and box[a, 1] <= box[b, 3]:
                one, other = _root(parent, a), _root(parent, b)
                parent[max(one, other)] = min(one, other)
    for item in range(count):
        parent[item] = _root(parent, item)
    return parent
