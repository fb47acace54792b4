"""Outlines of the free space as flat arrays, laid out for compiled kernels.

Every ring has what is blocked on its left: outlines of obstacles run counter-clockwise,
holes and the boundary clockwise. So all corners follow one rule: a path can bend only at
corners that turn left (`TURN` > 0).
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from shapely.geometry import MultiPolygon
from shapely.geometry.polygon import orient

from motm_wbc.geometry.arrays import Array

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


def build_walls(region: MultiPolygon, is_free: bool) -> Walls:
    """Arrays of a region's outlines.

    Args:
        region: noded polygons: where outlines touch, both have a corner.
        is_free: the region is what is free (else what is blocked).
    """
    rings = _rings(region, is_free)
    starts = np.cumsum([0, *(len(ring) for ring in rings)]).astype(np.int64)
    count = int(starts[-1])
    corners = np.zeros((count, 11))
    links = np.zeros((count, 4), dtype=np.int64)
    boxes = np.zeros((len(rings), 4))
    for index, ring in enumerate(rings):
        here = slice(int(starts[index]), int(starts[index + 1]))
        corners[here] = _corner_rows(ring)
        numbers = np.arange(here.start, here.stop)
        links[here] = np.column_stack(
            [np.roll(numbers, -1), np.roll(numbers, 1), numbers, np.full(len(ring), index)]
        )
        boxes[index] = [*ring.min(axis=0), *ring.max(axis=0)]
    _link_twins(corners, links)
    return Walls(corners, links, starts, boxes, 1.0 if is_free else 0.0)


def _rings(region: MultiPolygon, is_free: bool) -> list[Array]:
    raw: list[Array] = []
    for polygon in region.geoms:
        turned = orient(polygon, -1.0 if is_free else 1.0)
        raw += [np.array(line.coords)[:-1] for line in (turned.exterior, *turned.interiors)]
    seen: dict[tuple[float, float], int] = defaultdict(int)
    for ring in raw:
        for x, y in ring:
            seen[float(x), float(y)] += 1
    shared = {place for place, times in seen.items() if times > 1}
    simplified = [_without_straight_corners(ring, shared) for ring in raw]
    return [ring for ring in simplified if len(ring) >= 3]


def _without_straight_corners(ring: Array, shared: set[tuple[float, float]]) -> Array:
    """The ring without corners on the line of their neighbours, but where rings touch."""
    kept: list[Array] = []
    for index, point in enumerate(ring):
        before = kept[-1] if kept else ring[index - 1]
        after = ring[(index + 1) % len(ring)]
        if (float(point[0]), float(point[1])) in shared or not _is_between(before, point, after):
            kept.append(point)
    return np.array(kept).reshape(-1, 2)


def _is_between(before: Array, point: Array, after: Array) -> bool:
    (ax, ay), (bx, by) = point - before, after - point
    span = math.hypot(ax + bx, ay + by)
    return bool(ax * bx + ay * by > 0.0 and abs(ax * by - ay * bx) <= _STRAIGHT * span)


def _corner_rows(ring: Array) -> Array:
    outgoing = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(outgoing[:, 0], outgoing[:, 1])
    incoming = np.roll(outgoing, 1, axis=0)
    cross = incoming[:, 0] * outgoing[:, 1] - incoming[:, 1] * outgoing[:, 0]
    turn = np.arctan2(cross, (incoming * outgoing).sum(axis=1))
    angle = np.arctan2(incoming[:, 1], incoming[:, 0])
    return np.column_stack(
        [ring, outgoing / length[:, None], length, angle, turn, -incoming, outgoing]
    )


def _link_twins(corners: Array, links: Indices) -> None:
    """Ties the corners at one place in a cycle."""
    places: dict[tuple[float, float], list[int]] = defaultdict(list)
    for index, (x, y) in enumerate(corners[:, :2]):
        places[float(x), float(y)].append(index)
    for group in places.values():
        for index, other in zip(group, [*group[1:], group[0]], strict=True):
            links[index, TWIN] = other
