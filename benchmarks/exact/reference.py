"""PathRTR of the fastest path by brute force: every pair of corners, every directed edge.

The graph knows no tangents: its nodes are all corners of the outlines, convex or not, its
edges all free segments. The search runs over directed edges, since what an edge costs depends
on the one before it, once in each gear:

    forward  = turning / omega + length / v
    backward = the same with both headings turned about, at the reverse speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from benchmarks.exact.sight import TOLERANCE, Array, FreeSpace

Indices: TypeAlias = NDArray[np.int64]
Pose: TypeAlias = tuple[float, float, float | None]

_START, _GOAL = -1, -2  # places of a query, as `Edges` knows them
_BEFORE, _AFTER, _NONE = -3, -4, -5  # what lies before the start; after the goal; no sector
_BEGIN, _END = 0, 1  # the first two edges of a query: its headings
_OFFSET = 1.0  # [s] of the last arc: one of no weight might count as none


@dataclass(frozen=True)
class Speeds:
    """Of the base: forward and in reverse [m/s], 0 forbids it; turning [rad/s]."""

    forward: float
    backward: float
    turning: float


@dataclass(frozen=True)
class Edges:
    """Directed edges: the second can follow the first if it leaves where that arrives.

    Attributes:
        leaves: (k,) where from: a free sector of a corner, or start or goal.
        arrives: (k,) where to.
        angle: (k,) direction [rad], NaN: any.
        length: (k,) [m].
    """

    leaves: Indices
    arrives: Indices
    angle: Array
    length: Array

    def __add__(self, other: Edges) -> Edges:
        """Both, in this order."""
        return Edges(
            np.concatenate([self.leaves, other.leaves]),
            np.concatenate([self.arrives, other.arrives]),
            np.concatenate([self.angle, other.angle]),
            np.concatenate([self.length, other.length]),
        )

    def within_sectors(self) -> Edges:
        """Without edges in slits that are thinner than the tolerance."""
        kept = (self.leaves != _NONE) & (self.arrives != _NONE)
        return Edges(self.leaves[kept], self.arrives[kept], self.angle[kept], self.length[kept])

    def followers(self) -> tuple[Indices, Indices, Indices]:
        """Rows, as where each begins (k + 1,), of the edges that can follow each edge.

        Returns:
            Row starts; the edges before (a,) and after (a,), row by row.
        """
        order = np.argsort(self.leaves, kind="stable")
        leaves = self.leaves[order]
        first = np.searchsorted(leaves, self.arrives, side="left")
        counts = np.searchsorted(leaves, self.arrives, side="right") - first
        rows = np.concatenate([[0], np.cumsum(counts)])
        before = np.repeat(np.arange(len(counts)), counts)
        within = np.arange(rows[-1]) - rows[before]
        return rows, before, order[first[before] + within]


class Reference:
    """Full visibility graph of a free space; what belongs to no query is made once."""

    def __init__(self, space: FreeSpace) -> None:
        """Find all edges between corners."""
        self._space = space
        first, second = np.triu_indices(len(space.corners), k=1)
        seen = space.free(space.corners[first], space.corners[second])
        first, second = first[seen], second[seen]
        self._edges = self._between(
            np.concatenate([first, second]), np.concatenate([second, first])
        )

    def time(self, start: Pose, goal: Pose, speeds: Speeds) -> float:
        """PathRTR [s] between free poses; infinite if there is no path."""
        heading, last = (math.nan if pose[2] is None else pose[2] for pose in (start, goal))
        if math.dist(start[:2], goal[:2]) <= TOLERANCE:
            return float(_bend(np.array([heading]), np.array([last]))[0]) / speeds.turning
        ends = self._ends_of(np.array(start[:2]), np.array(goal[:2]))
        rows, before, after = (ends + self._edges).followers()
        best = math.inf
        for speed, about in ((speeds.forward, 0.0), (speeds.backward, math.pi)):
            if speed <= 0.0:
                continue
            edges = ends + self._edges
            edges.angle[[_BEGIN, _END]] = heading + about, last + about
            weights: Array = _bend(edges.angle[before], edges.angle[after]) / speeds.turning
            weights += edges.length[after] / speed
            weights[after == _END] += _OFFSET
            count = len(edges.length)
            graph = csr_array((weights, after, rows), shape=(count, count))
            best = min(best, float(dijkstra(graph, indices=_BEGIN)[_END]) - _OFFSET)
        return best

    def _ends_of(self, start: Array, goal: Array) -> Edges:
        """The headings as edges of no length, and what leads from the start and to the goal."""
        ends = Edges(
            np.array([_BEFORE, _GOAL]),
            np.array([_START, _AFTER]),
            np.array([math.nan, math.nan]),
            np.zeros(2),
        )
        if self._space.free(start[None], goal[None])[0]:
            ends += _edges(np.array([_START]), np.array([_GOAL]), (goal - start)[None])
        corners = self._space.corners
        for place, outward in ((start, True), (goal, False)):
            others = np.flatnonzero(np.hypot(*(corners - place).T) > TOLERANCE)
            others = others[
                self._space.free(np.broadcast_to(place, (len(others), 2)), corners[others])
            ]
            ways = corners[others] - place
            here = np.full(len(others), _START if outward else _GOAL)
            sectors = self._sectors(others, -ways)
            found = _edges(here, sectors, ways) if outward else _edges(sectors, here, -ways)
            ends += found.within_sectors()
        return ends

    def _between(self, tails: Indices, heads: Indices) -> Edges:
        ways = self._space.corners[heads] - self._space.corners[tails]
        return _edges(
            self._sectors(tails, ways), self._sectors(heads, -ways), ways
        ).within_sectors()

    def _sectors(self, corners: Indices, ways: Array) -> Indices:
        """Number of the sector that each way (k, 2) from a corner leads into, or `_NONE`."""
        pairs = zip(corners.tolist(), ways, strict=True)
        found = np.array([self._space.sector(corner, way) for corner, way in pairs], dtype=np.int64)
        return np.where(found < 0, _NONE, self._space.first_sector[corners] + found)


def _edges(leaves: Indices, arrives: Indices, ways: Array) -> Edges:
    angle = np.arctan2(ways[:, 1], ways[:, 0])
    return Edges(leaves, arrives, angle, np.hypot(ways[:, 0], ways[:, 1]))


def _bend(first: Array, second: Array) -> Array:
    """Turns between directions [rad], in [0, pi]; zero where one is free."""
    turned = np.abs(np.remainder(second - first + math.pi, math.tau) - math.pi)
    return np.where(np.isnan(turned), 0.0, turned)
