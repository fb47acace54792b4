"""Rings that nearly meet, made to meet: at common corners, to the bit."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array, BoolArray
from motm_wbc.geometry.jit import kernel

_FEW = 64
_ROUNDS = 16  # of moving corners together, each of which may bring others near


class Rings(NamedTuple):
    """Closed rings: the first corner of each comes again as its last.

    Attributes:
        points: (n, 2) corners of all rings [m].
        ring: (n,) number of the ring that each one is part of, ascending.
    """

    points: Array
    ring: Indices


@kernel
def _from_edge(points: Array, a: int, b: int, corner: int) -> float:
    """Distance of a corner to the edge between two others [m]; infinite if it is one of them.

    Whatever lies at the very same place as an end is that end.
    """
    x, y = points[corner, 0], points[corner, 1]
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    if (x == ax and y == ay) or (x == bx and y == by):
        return math.inf
    ex, ey, wx, wy = bx - ax, by - ay, x - ax, y - ay
    square = ex * ex + ey * ey
    along = 0.0 if square == 0.0 else min(max((wx * ex + wy * ey) / square, 0.0), 1.0)
    return math.hypot(wx - along * ex, wy - along * ey)


@kernel
def _near_misses(points: Array, ring: Indices, order: Indices, apart: float) -> Indices:
    """`near_misses`; `order` sorts the corners by x."""
    found = np.empty((_FEW, 2), dtype=np.int64)
    count = 0
    xs = points[order, 0]
    for a in range(points.shape[0] - 1):
        b = a + 1
        if ring[b] != ring[a]:
            continue
        low_x, high_x = min(points[a, 0], points[b, 0]), max(points[a, 0], points[b, 0])
        low_y, high_y = min(points[a, 1], points[b, 1]), max(points[a, 1], points[b, 1])
        for k in range(np.searchsorted(xs, low_x - apart), xs.size):
            corner = order[k]
            if xs[k] > high_x + apart:
                break
            if not low_y - apart <= points[corner, 1] <= high_y + apart:
                continue
            if _from_edge(points, a, b, corner) <= apart:
                if count == found.shape[0]:
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = a, corner
                count += 1
    return found[:count]


def near_misses(rings: Rings, apart: float) -> Indices:
    """Where a corner lies next to an edge that doesn't end there.

    Args:
        rings: that may meet.
        apart: what is no farther away counts as next to it [m].

    Returns:
        (k, 2) the edge's first corner, and the corner.
    """
    order = np.argsort(rings.points[:, 0], kind="stable")
    found: Indices = _near_misses(*rings, order, apart)
    return found


def noded(rings: Rings, apart: float) -> Rings:
    """Rings without near misses: corners near each other are one, edges end where they touch.

    A corner moves by little more than `apart`. Rings may be left with fewer corners, or on
    both sides of one line.

    Args:
        rings: that nearly meet.
        apart: as in `near_misses` [m].
    """
    for _ in range(_ROUNDS):
        edge, corner = near_misses(rings, apart).T
        if len(edge) == 0:
            break
        away = [_between(rings.points, corner, edge + end) for end in (0, 1)]
        end = edge + (away[1] < away[0])
        meet = np.minimum(*away) <= apart
        if meet.any():
            points = _together(rings.points, corner[meet], end[meet])
            rings = _without_repeats(Rings(points, rings.ring))
        else:
            rings = _without_repeats(_inserted(rings, edge, corner, away[0]))
    return rings


def _between(points: Array, one: Indices, other: Indices) -> Array:
    """Distances between corners [m]."""
    offset = points[one] - points[other]
    return np.asarray(np.hypot(offset[:, 0], offset[:, 1]))


def _together(points: Array, one: Indices, other: Indices) -> Array:
    """Corners moved so that those of each pair are at one place, with all that was there."""
    places, place = np.unique(points, axis=0, return_inverse=True)
    count = len(places)
    pairs = coo_array((np.ones(len(one)), (place[one], place[other])), shape=(count, count))
    _, cluster = connected_components(pairs, directed=False)
    _, first = np.unique(cluster, return_index=True)
    return np.asarray(places[first[cluster[place]]])


def _inserted(rings: Rings, edge: Indices, corner: Indices, along: Array) -> Rings:
    """Corners put into the edges that they lie on, in their order along each."""
    order = np.lexsort((along, edge))
    at, corner = edge[order] + 1, corner[order]
    return Rings(
        np.insert(rings.points, at, rings.points[corner], axis=0),
        np.insert(rings.ring, at, rings.ring[at - 1]),
    )


def _without_repeats(rings: Rings) -> Rings:
    """Edges of no length are left out."""
    points, ring = rings
    kept: BoolArray = np.ones(len(points), dtype=np.bool_)
    kept[1:] = (points[1:] != points[:-1]).any(axis=1) | (ring[1:] != ring[:-1])
    return Rings(points[kept], ring[kept])
