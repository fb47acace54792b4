"""Outlines of the free space as flat arrays, laid out for compiled kernels.

Every ring has what is blocked on its left: outlines of obstacles run counter-clockwise,
holes and the boundary clockwise. So all corners follow one rule: a path can bend only at
corners that turn left (`TURN` > 0). Where outlines touch, each corner bounds one blocked
sector, in which there is nothing free, whichever way the polygons were put together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from motm_wbc.geometry.arrays import Array, BoolArray
from motm_wbc.geometry.jit import kernel

Indices = npt.NDArray[np.int64]

# columns of Walls.corners
X, Y, UX, UY, LENGTH, INCOMING, TURN, BEFORE_X, BEFORE_Y, AFTER_X, AFTER_Y = range(11)
# columns of Walls.links
NEXT, PREVIOUS, TWIN, RING = range(4)

TOUCH = 1e-9
"""Distance below which things touch [m]; far above rounding, far below what matters."""
_STRAIGHT = 1e-11  # [m] off the line of its neighbours: a corner that does nothing


class Walls(NamedTuple):
    """Outlines of the free space.

    Attributes:
        corners: (n, 11) x, y [m]; direction (2) and length [m] of the edge to the next
            corner; angle of the edge from the previous one [rad]; turn to the left [rad];
            vectors to the previous and to the next corner [m].
        links: (n, 4) next and previous corner of the ring; next corner at the same place
            (itself if there is none); ring.
        ring_start: (r + 1,) first corner of each ring.
        ring_box: (r, 4) x and y of the lower, then of the upper bound [m].
        bounded: 1.0 if there is a boundary (outside of all rings is blocked), else 0.0.
    """

    corners: Array
    links: Indices
    ring_start: Indices
    ring_box: Array
    bounded: float


def build_walls(parts: Sequence[Polygon], is_free: bool) -> Walls:
    """Arrays of a region's outlines.

    Args:
        parts: polygons of the region, noded: where outlines touch, both have a corner.
        is_free: the region is what is free (else what is blocked).
    """
    bounded = 1.0 if is_free else 0.0
    if len(parts) == 0:
        empty = np.empty((0, 4), dtype=np.int64)
        return Walls(np.empty((0, 11)), empty, np.zeros(1, np.int64), np.empty((0, 4)), bounded)
    _, closed, (starts, firsts) = shapely.to_ragged_array(parts)
    outer = np.zeros(len(starts) - 1, dtype=np.bool_)
    outer[np.asarray(firsts)[:-1]] = True
    ring_start = np.asarray(starts, dtype=np.int64)
    points, ring_start = _oriented(closed, ring_start, outer != is_free)
    order = np.lexsort((points[:, 1], points[:, 0]))
    place, shared = _places(points, order)
    if shared.any():
        sequence, ring_start = _around_sectors(points, ring_start, order, place)
        points, place, shared = points[sequence], place[sequence], shared[sequence]
    kept, ring_start = _without_straight_corners(points, ring_start, shared)
    corners, links, boxes = _lay_out(points[kept], ring_start, place[kept])
    return Walls(corners, links, ring_start, boxes, bounded)


@kernel
def _oriented(closed: Array, starts: Indices, left: BoolArray) -> tuple[Array, Indices]:
    """Rings without their closing points, counter-clockwise where `left`, else clockwise."""
    count = closed.shape[0] - left.size
    points = np.empty((count, 2))
    ring_start = np.empty_like(starts)
    for ring in range(left.size):
        first, last = starts[ring], starts[ring + 1] - 1
        area = 0.0
        for k in range(first + 1, last):
            ax, ay = closed[k, 0] - closed[first, 0], closed[k, 1] - closed[first, 1]
            bx, by = closed[k + 1, 0] - closed[first, 0], closed[k + 1, 1] - closed[first, 1]
            area += ax * by - ay * bx
        ring_start[ring] = first - ring
        for k in range(last - first):
            points[first - ring + k] = closed[first + k if (area > 0.0) == left[ring] else last - k]
    ring_start[-1] = count
    return points, ring_start


@kernel
def _places(points: Array, order: Indices) -> tuple[Indices, BoolArray]:
    """A number for each corner, the same for corners at one place; whether it shares it.

    `order` sorts the corners by place.
    """
    place = np.empty(order.size, dtype=np.int64)
    shared = np.zeros(order.size, dtype=np.bool_)
    for k in range(order.size):
        here = order[k]
        place[here] = k
        if k > 0 and (points[here] == points[order[k - 1]]).all():
            place[here] = place[order[k - 1]]
            shared[here] = shared[order[k - 1]] = True
    return place, shared


@kernel
def _direction(points: Array, start: int, end: int) -> float:
    return math.atan2(points[end, 1] - points[start, 1], points[end, 0] - points[start, 0])


@kernel
def _around_sectors(
    points: Array, ring_start: Indices, order: Indices, place: Indices
) -> tuple[Indices, Indices]:
    """Rings that go round one blocked sector at each corner, where some share a place.

    There, what is blocked lies between an edge that leaves and, counter-clockwise, the next
    one that arrives: these two are tied.

    Returns:
        The corners in the order of the new rings; first corner of each ring.
    """
    count = points.shape[0]
    before = np.arange(-1, count - 1)
    after = np.arange(1, count + 1)
    for ring in range(ring_start.size - 1):
        before[ring_start[ring]] = ring_start[ring + 1] - 1
        after[ring_start[ring + 1] - 1] = ring_start[ring]
    tied = after.copy()
    first = 0
    while first < count:
        end = first + 1
        while end < count and place[order[end]] == place[order[first]]:
            end += 1
        for leaving in order[first:end] if end - first > 1 else order[:0]:
            out = _direction(points, leaving, after[leaving])
            least = math.inf
            for arriving in order[first:end]:
                sector = (_direction(points, arriving, before[arriving]) - out) % math.tau
                if sector < least:
                    least = sector
                    nearest = before[arriving]
            tied[nearest] = leaving
        first = end
    if (np.bincount(tied, minlength=count) != 1).any():  # edges on top of each other: as it was
        tied = after
    return _followed(tied)


@kernel
def _followed(after: Indices) -> tuple[Indices, Indices]:
    """The rings of a permutation, in one sequence; first place of each."""
    count = after.size
    sequence = np.empty(count, dtype=np.int64)
    start = np.zeros(count + 1, dtype=np.int64)
    seen = np.zeros(count, dtype=np.bool_)
    size, rings = 0, 0
    for first in range(count):
        corner = first
        while not seen[corner]:
            seen[corner] = True
            sequence[size] = corner
            size += 1
            corner = after[corner]
        if size > start[rings]:
            rings += 1
            start[rings] = size
    return sequence, start[: rings + 1]


@kernel
def _is_between(points: Array, before: int, here: int, after: int) -> bool:
    """Whether a corner lies on the line of its neighbours, between them."""
    ax, ay = points[here, 0] - points[before, 0], points[here, 1] - points[before, 1]
    bx, by = points[after, 0] - points[here, 0], points[after, 1] - points[here, 1]
    span = math.hypot(ax + bx, ay + by)
    return bool(ax * bx + ay * by > 0.0 and abs(ax * by - ay * bx) <= _STRAIGHT * span)


@kernel
def _without_straight_corners(
    points: Array, ring_start: Indices, shared: BoolArray
) -> tuple[Indices, Indices]:
    """Corners that are kept: those that turn, and those where rings touch; and the rings."""
    kept = np.empty(points.shape[0], dtype=np.int64)
    start = np.zeros_like(ring_start)
    count, rings = 0, 0
    for ring in range(ring_start.size - 1):
        first, end = ring_start[ring], ring_start[ring + 1]
        begin = count
        for here in range(first, end):
            before = kept[count - 1] if count > begin else (end - 1 if here == first else here - 1)
            after = first if here + 1 == end else here + 1
            if shared[here] or not _is_between(points, before, here, after):
                kept[count] = here
                count += 1
        if count - begin < 3:
            count = begin
            continue
        rings += 1
        start[rings] = count
    return kept[:count], start[: rings + 1]


@kernel
def _lay_out(points: Array, ring_start: Indices, place: Indices) -> tuple[Array, Indices, Array]:
    """Corners, links and boxes of `Walls`; corners of one `place` are tied in a cycle."""
    corners = np.empty((points.shape[0], 11))
    links = np.empty((points.shape[0], 4), dtype=np.int64)
    boxes = np.empty((ring_start.size - 1, 4))
    for ring in range(ring_start.size - 1):
        first, end = ring_start[ring], ring_start[ring + 1]
        boxes[ring, 0], boxes[ring, 1] = points[first, 0], points[first, 1]
        boxes[ring, 2], boxes[ring, 3] = points[first, 0], points[first, 1]
        for here in range(first, end):
            before = end - 1 if here == first else here - 1
            after = first if here + 1 == end else here + 1
            x, y = points[here, 0], points[here, 1]
            ix, iy = x - points[before, 0], y - points[before, 1]
            ox, oy = points[after, 0] - x, points[after, 1] - y
            length = math.hypot(ox, oy)
            corners[here, X], corners[here, Y] = x, y
            corners[here, UX], corners[here, UY] = ox / length, oy / length
            corners[here, LENGTH] = length
            corners[here, INCOMING] = math.atan2(iy, ix)
            corners[here, TURN] = math.atan2(ix * oy - iy * ox, ix * ox + iy * oy)
            corners[here, BEFORE_X], corners[here, BEFORE_Y] = -ix, -iy
            corners[here, AFTER_X], corners[here, AFTER_Y] = ox, oy
            links[here, NEXT], links[here, PREVIOUS] = after, before
            links[here, TWIN], links[here, RING] = here, ring
            boxes[ring, 0], boxes[ring, 1] = min(boxes[ring, 0], x), min(boxes[ring, 1], y)
            boxes[ring, 2], boxes[ring, 3] = max(boxes[ring, 2], x), max(boxes[ring, 3], y)
    _link_twins(links, place)
    return corners, links, boxes


@kernel
def _link_twins(links: Indices, place: Indices) -> None:
    """Ties the corners at one place in a cycle."""
    order = np.argsort(place, kind="mergesort")
    first = 0
    for k in range(order.size):
        last = k + 1 == order.size or place[order[k + 1]] != place[order[k]]
        links[order[k], TWIN] = order[first if last else k + 1]
        if last:
            first = k + 1
