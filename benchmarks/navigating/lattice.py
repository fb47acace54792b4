"""Brute force: which poses a differential drive can get to, by a search over (x, y, heading).

It shares no code with the planners: obstacles are united by shapely, distances measured to
every edge, the footprint's rectangle clipped against the edges near it. All poses of all
motions are checked, so closely that whatever lies between two of them is free as well. The
motions can be driven in both directions: places that can be reached from each other form a
class, and one flood of the lattice answers for any start and goal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks.navigating.moves import Moves, make_moves
from motm_wbc.basenav import World
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

CELL = 0.05  # [m]
HEADINGS = 64
_SPACING = 0.02  # [m] that a point of the base moves between two checks
_TILE = 0.5  # [m]
_UNSEEN, _BLOCKED = 0, -1


class Box(NamedTuple):
    """A rectangular footprint, grown by what is kept free about it.

    Attributes:
        front: largest x in the base frame [m].
        back: least x [m].
        left: largest y [m].
        right: least y [m].
        inner: radius of the disc about the base's origin that it contains [m].
        outer: radius of the disc that contains it [m].
    """

    front: float
    back: float
    left: float
    right: float
    inner: float
    outer: float


class Ground(NamedTuple):
    """What there is to meet.

    Attributes:
        x0: x of the first column [m].
        y0: y of the first row [m].
        distances: (rows, columns) from each node to the nearest edge [m], negative inside.
        edges: (e, 4) x1, y1, x2, y2, tile after tile [m].
        starts: (tiles + 1,) where each tile's edges begin.
        tile_columns: number of tiles along x.
    """

    x0: float
    y0: float
    distances: Array
    edges: Array
    starts: NDArray[np.int64]
    tile_columns: int


class Lattice:
    """Classes of poses that can be reached from each other.

    Attributes:
        labels: (rows, columns, headings) class of each node, -1 where the base can't be.
    """

    def __init__(self, world: World, footprint: Array, margin: float = 0.02) -> None:
        """Flood the lattice.

        Args:
            world: obstacles at rest, with a boundary.
            footprint: (4, 2) rectangle along the axes of the base frame [m].
            margin: that is kept free on all ways [m].
        """
        kept = margin + 0.5 * _SPACING
        (back, right), (front, left) = footprint.min(axis=0) - kept, footprint.max(axis=0) + kept
        inner, outer = min(front, -back, left, -right), max(np.hypot(*footprint.T)) + 2.0 * kept
        self._box = Box(front, back, left, right, inner, outer)
        self._moves: Moves = make_moves(CELL, HEADINGS, _SPACING, self._box.outer)
        self._ground = _ground(world, self._box.outer)
        rows, columns = self._ground.distances.shape
        self.labels = np.full((rows, columns, HEADINGS), _UNSEEN, dtype=np.int32)
        self._arrivals = np.full(self.labels.shape, -1, dtype=np.int16)
        _flood(self._ground, self._box, self._moves, self.labels, self._arrivals)

    def is_free(self, pose: Array) -> bool:
        """Whether the base may stand at any pose (3,), with what is kept free about it."""
        x, y, heading = (float(value) for value in pose)
        return bool(_is_free(self._ground, self._box, x, y, math.cos(heading), math.sin(heading)))

    def pose(self, node: tuple[int, int, int]) -> Array:
        """(3,) of a node: row, column, heading index."""
        row, column, k = node
        turned = wrap(math.tau * k / HEADINGS)
        return np.array([self._ground.x0 + CELL * column, self._ground.y0 + CELL * row, turned])

    def node(self, pose: Array) -> tuple[int, int, int]:
        """The node nearest to a pose."""
        k = round(float(pose[2]) * HEADINGS / math.tau) % HEADINGS
        row = round((float(pose[1]) - self._ground.y0) / CELL)
        column = round((float(pose[0]) - self._ground.x0) / CELL)
        return row, column, k

    def label(self, pose: Array) -> int:
        """Class of the nearest node; -1: not free, or off the lattice."""
        row, column, k = self.node(pose)
        rows, columns, _ = self.labels.shape
        if not (0 <= row < rows and 0 <= column < columns):
            return _BLOCKED
        return int(self.labels[row, column, k])

    def node_within(
        self, pose: Array, distance: float, angle: float, label: int
    ) -> tuple[int, int, int] | None:
        """The nearest node of a class that lies within tolerances of a pose, or None."""
        row, column, k = self.node(pose)
        cells, turns = math.ceil(distance / CELL), math.ceil(angle * HEADINGS / math.tau)
        best, least = None, math.inf
        for i in range(row - cells, row + cells + 1):
            for j in range(column - cells, column + cells + 1):
                if not (0 <= i < self.labels.shape[0] and 0 <= j < self.labels.shape[1]):
                    continue
                for turn in range(-turns, turns + 1):
                    node = (i, j, (k + turn) % HEADINGS)
                    there = self.pose(node)
                    off = math.hypot(*(there[:2] - pose[:2]))
                    turned = abs(wrap(there[2] - pose[2]))
                    if off > distance or turned > angle or self.labels[node] != label:
                        continue
                    if off / distance + turned / angle < least:
                        best, least = node, off / distance + turned / angle
        return best

    def way(self, start: tuple[int, int, int], goal: tuple[int, int, int]) -> Array:
        """(n, 3) poses of a way between two nodes of one class, by way of the class's first."""
        ways = [self._way_from_first(node) for node in (start, goal)]
        return np.vstack([ways[0][::-1], ways[1]])

    def _way_from_first(self, node: tuple[int, int, int]) -> Array:
        moves, pieces = self._moves, [self.pose(node)[None]]
        row, column, k = node
        while (move := int(self._arrivals[row, column, k])) >= 0:
            shift = moves.shifts[move]
            row, column, k = row - shift[1], column - shift[0], (k - shift[2]) % HEADINGS
            begin, end = moves.spans[move]
            between = moves.between[begin:end]
            turned = np.arctan2(between[:, 3], between[:, 2])
            origin = self.pose((row, column, k))[:2]
            pieces.append(np.column_stack([between[:, :2] + origin, turned]))
        return np.vstack(pieces[::-1])


def _ground(world: World, reach: float) -> Ground:
    solid = shapely.union_all([shapely.Polygon(s.outline, s.holes) for s in world.solids])
    floor = shapely.Polygon(world.boundary)
    rings = [*(ring for s in world.solids for ring in s.rings), np.asarray(world.boundary)]
    edges = np.vstack([np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings])
    x0, y0, x1, y1 = floor.bounds
    xs, ys = np.arange(x0, x1 + CELL, CELL), np.arange(y0, y1 + CELL, CELL)
    grid_x, grid_y = np.meshgrid(xs, ys)
    free = shapely.contains_xy(floor, grid_x, grid_y)
    free &= ~shapely.intersects_xy(solid, grid_x, grid_y)
    distances = np.where(free, 1.0, -1.0) * _distances(xs, ys, edges)
    columns, rows = math.ceil((x1 - x0) / _TILE) + 1, math.ceil((y1 - y0) / _TILE) + 1
    centres = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    tiles = shapely.box(
        *(np.array([x0, y0]) + _TILE * centres - reach).T,
        *(np.array([x0, y0]) + _TILE * (centres + 1) + reach).T,
    )
    tree = shapely.STRtree(shapely.linestrings(edges.reshape(-1, 2, 2)))
    tile, edge = tree.query(tiles, predicate="intersects")
    starts = np.searchsorted(tile, np.arange(len(tiles) + 1)).astype(np.int64)
    return Ground(float(x0), float(y0), distances, edges[edge], starts, columns)


@kernel
def _distances(xs: Array, ys: Array, edges: Array) -> Array:
    """From every node to the nearest edge [m]."""
    found = np.empty((ys.shape[0], xs.shape[0]))
    for row in range(ys.shape[0]):
        for column in range(xs.shape[0]):
            px, py = xs[column], ys[row]
            least = np.inf
            for e in range(edges.shape[0]):
                x, y = edges[e, 0], edges[e, 1]
                dx, dy = edges[e, 2] - x, edges[e, 3] - y
                share = ((px - x) * dx + (py - y) * dy) / (dx * dx + dy * dy)
                share = min(max(share, 0.0), 1.0)
                ex, ey = x + share * dx - px, y + share * dy - py
                least = min(least, ex * ex + ey * ey)
            found[row, column] = math.sqrt(least)
    return found


@kernel
def _enters(box: Box, x1: float, y1: float, x2: float, y2: float) -> bool:
    """Whether a segment, in the base frame, has a point in the box."""
    dx, dy = x2 - x1, y2 - y1
    first, last = 0.0, 1.0
    for low, high, at, way in ((box.back, box.front, x1, dx), (box.right, box.left, y1, dy)):
        if way == 0.0:
            if at < low or at > high:
                return False
            continue
        a, b = (low - at) / way, (high - at) / way
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first <= last


@kernel
def _is_free(ground: Ground, box: Box, x: float, y: float, c: float, s: float) -> bool:
    rows, columns = ground.distances.shape
    column = math.floor((x - ground.x0) / CELL + 0.5)
    row = math.floor((y - ground.y0) / CELL + 0.5)
    if column < 0 or row < 0 or column >= columns or row >= rows:
        return False
    off = math.hypot(x - ground.x0 - column * CELL, y - ground.y0 - row * CELL)
    distance = ground.distances[row, column]
    if distance - off >= box.outer:
        return True
    if distance + off < box.inner:
        return False
    tile_column = math.floor((x - ground.x0) / _TILE)
    tile = math.floor((y - ground.y0) / _TILE) * ground.tile_columns + tile_column
    for e in range(ground.starts[tile], ground.starts[tile + 1]):
        edge = ground.edges[e]
        ax, ay, bx, by = edge[0] - x, edge[1] - y, edge[2] - x, edge[3] - y
        if _enters(box, c * ax + s * ay, c * ay - s * ax, c * bx + s * by, c * by - s * bx):
            return False
    return True


@kernel
def _motion_is_free(
    ground: Ground, box: Box, moves: Moves, move: int, row: int, column: int
) -> bool:
    if ground.distances[row, column] >= box.outer + moves.extents[move]:
        return True
    x, y = ground.x0 + column * CELL, ground.y0 + row * CELL
    for p in range(moves.spans[move, 0], moves.spans[move, 1]):
        pose = moves.between[p]
        if not _is_free(ground, box, x + pose[0], y + pose[1], pose[2], pose[3]):
            return False
    return True


@kernel
def _flood(
    ground: Ground,
    box: Box,
    moves: Moves,
    labels: NDArray[np.int32],
    arrivals: NDArray[np.int16],
) -> None:
    """Give every node its class, and the motion by which it was reached from the first one."""
    rows, columns, headings = labels.shape
    waiting = np.empty((labels.size, 3), dtype=np.int16)
    label = 0
    for row in range(rows):
        for column in range(columns):
            x, y = ground.x0 + column * CELL, ground.y0 + row * CELL
            for k in range(headings):
                turned = math.tau * k / headings
                if not _is_free(ground, box, x, y, math.cos(turned), math.sin(turned)):
                    labels[row, column, k] = _BLOCKED
    for first in range(labels.size):
        r, rest = divmod(first, columns * headings)
        c, h = divmod(rest, headings)
        if labels[r, c, h] != _UNSEEN:
            continue
        label += 1
        labels[r, c, h] = label
        waiting[0] = r, c, h
        begin, end = 0, 1
        while begin < end:
            r, c, h = waiting[begin]
            begin += 1
            for move in range(moves.starts[h], moves.starts[h + 1]):
                column, row = c + moves.shifts[move, 0], r + moves.shifts[move, 1]
                if column < 0 or row < 0 or column >= columns or row >= rows:
                    continue
                k = (h + moves.shifts[move, 2]) % headings
                if labels[row, column, k] != _UNSEEN:
                    continue
                if _motion_is_free(ground, box, moves, move, r, c):
                    labels[row, column, k] = label
                    arrivals[row, column, k] = move
                    waiting[end] = row, column, k
                    end += 1
