"""Whether the base, at a pose, overlaps the world: its true outline against true polygons.

The outline is convex and stays fixed in the base frame; the edges of the world's polygons
are brought into that frame and clipped against its sides. If no edge enters the outline,
the base lies wholly inside or wholly outside of every polygon, and its winding number
tells which. Polygons may be concave and may overlap. A margin moves the outline's sides
outward, so that corners stay sharp: never less than the true distance.

Edges are filed by square tiles, each with those that the base may touch from there, and
with the winding number of the tile's centre: a check looks at one tile only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_TILE = 0.25  # [m]
_MAX_TILES = 1_000_000  # a larger world gets larger tiles


class Outline(NamedTuple):
    """A convex footprint as half-planes n . p <= b in the base frame.

    Attributes:
        normals: (m, 2) outward unit normals.
        offsets: (m,) b [m].
        radius: distance from the base's origin to the farthest corner [m].
        inner: distance from the base's origin to the nearest side [m].
        front: largest x of a corner [m].
        back: least x [m].
        left: largest y [m].
        right: least y [m].
        stretch: how far x and y of a corner move for each metre of margin, at most.
    """

    normals: Array
    offsets: Array
    radius: float
    inner: float
    front: float
    back: float
    left: float
    right: float
    stretch: float


class EdgeMap(NamedTuple):
    """The world's edges, filed by tiles.

    Attributes:
        x0: left edge of the tiles [m].
        y0: lower edge [m].
        tile: side of a tile [m].
        columns: tiles along x.
        rows: tiles along y.
        starts: (rows * columns + 1,) where each tile's edges begin.
        edges: (k, 4) x1, y1, x2, y2 [m], free space on the right; tile after tile.
        windings: (rows * columns,) how many solids each tile's centre lies in.
        outside: the same for all that lies beyond the tiles.
    """

    x0: float
    y0: float
    tile: float
    columns: int
    rows: int
    starts: NDArray[np.int64]
    edges: Array
    windings: NDArray[np.int64]
    outside: int


def outline_of(footprint: Array) -> Outline:
    """Half-planes of a convex polygon (n, 2) [m], any winding."""
    corners = polygons.counter_clockwise(np.asarray(footprint, dtype=float))
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    corners, sides = corners[lengths > 0.0], sides[lengths > 0.0]
    normals = np.column_stack([sides[:, 1], -sides[:, 0]]) / lengths[lengths > 0.0, None]
    offsets = np.einsum("ij,ij->i", normals, corners)
    radius = float(np.hypot(corners[:, 0], corners[:, 1]).max())
    (front, left), (back, right) = corners.max(axis=0).tolist(), corners.min(axis=0).tolist()
    inner = max(float(offsets.min()), 0.0)
    stretch = float(np.abs(_corners(normals, offsets + 1.0) - _corners(normals, offsets)).max())
    return Outline(
        np.ascontiguousarray(normals), offsets, radius, inner, front, back, left, right, stretch
    )


def grown_corners(outline: Outline, margin: float) -> Array:
    """(m, 2) corners of the outline with its sides moved outward by `margin` [m]."""
    return _corners(outline.normals, outline.offsets + margin)


def grown_radius(outline: Outline, margin: float) -> float:
    """Distance from the base's origin to the farthest of the `grown_corners` [m]."""
    return float(np.hypot(*grown_corners(outline, margin).T).max())


def _corners(normals: Array, offsets: Array) -> Array:
    """(m, 2) where neighbouring sides n . p = b meet [m]."""
    n, b = normals, offsets
    m, c = np.roll(n, -1, axis=0), np.roll(b, -1)
    cross = n[:, 0] * m[:, 1] - n[:, 1] * m[:, 0]
    keep = np.abs(cross) > 1e-9  # parallel neighbours share no corner
    x = (b * m[:, 1] - c * n[:, 1])[keep] / cross[keep]
    y = (c * n[:, 0] - b * m[:, 0])[keep] / cross[keep]
    return np.column_stack([x, y])


def edge_map(rings: Sequence[Array], bounded: bool, reach: float) -> EdgeMap:
    """File the edges of the world.

    Args:
        rings: polygons (n, 2) [m] with what is blocked on their left; they may overlap.
        bounded: what is in no ring is blocked.
        reach: largest distance from the base's origin to a point of its outline [m].
    """
    outside = 1 if bounded else 0
    if not rings:
        none = np.zeros(0, dtype=np.int64)
        return EdgeMap(0.0, 0.0, 1.0, 0, 0, np.zeros(1, np.int64), np.zeros((0, 4)), none, 0)
    edges = np.vstack([np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in rings])
    points = edges[:, :2]
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    size = high - low
    tile = max(_TILE, math.sqrt(size[0] * size[1] / _MAX_TILES))
    columns, rows = (max(1, math.ceil(length / tile)) for length in size)
    x0, y0 = float(low[0]), float(low[1])
    touch = reach + tile * math.sqrt(0.5)
    counts = _count_edges(edges, x0, y0, tile, columns, rows, touch)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    filed = _file_edges(edges, x0, y0, tile, columns, rows, touch, starts)
    windings = _winding_numbers(edges, x0, y0, tile, columns, rows, outside)
    return EdgeMap(x0, y0, tile, columns, rows, starts, filed, windings, outside)


@lean
def squared_distance(px: float, py: float, x1: float, y1: float, x2: float, y2: float) -> float:
    """Squared distance from a point to a segment [m^2]."""
    dx, dy = x2 - x1, y2 - y1
    square = dx * dx + dy * dy
    t = 0.0
    if square > 0.0:
        t = min(max(((px - x1) * dx + (py - y1) * dy) / square, 0.0), 1.0)
    ex, ey = x1 + t * dx - px, y1 + t * dy - py
    return ex * ex + ey * ey


@kernel
def _tile_range(a: float, b: float, origin: float, tile: float, count: int) -> tuple[int, int]:
    first = max(math.floor((min(a, b) - origin) / tile), 0)
    last = min(math.floor((max(a, b) - origin) / tile), count - 1)
    return first, last


@kernel
def _count_edges(
    edges: Array, x0: float, y0: float, tile: float, columns: int, rows: int, touch: float
) -> NDArray[np.int64]:
    counts = np.zeros(columns * rows, dtype=np.int64)
    for e in range(edges.shape[0]):
        x1, y1, x2, y2 = edges[e]
        left, right = _tile_range(min(x1, x2) - touch, max(x1, x2) + touch, x0, tile, columns)
        low, high = _tile_range(min(y1, y2) - touch, max(y1, y2) + touch, y0, tile, rows)
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                px, py = x0 + (column + 0.5) * tile, y0 + (row + 0.5) * tile
                if squared_distance(px, py, x1, y1, x2, y2) <= touch * touch:
                    counts[row * columns + column] += 1
    return counts


@kernel
def _file_edges(
    edges: Array,
    x0: float,
    y0: float,
    tile: float,
    columns: int,
    rows: int,
    touch: float,
    starts: NDArray[np.int64],
) -> Array:
    filed = np.empty((starts[-1], 4))
    cursor = starts[:-1].copy()
    for e in range(edges.shape[0]):
        x1, y1, x2, y2 = edges[e]
        left, right = _tile_range(min(x1, x2) - touch, max(x1, x2) + touch, x0, tile, columns)
        low, high = _tile_range(min(y1, y2) - touch, max(y1, y2) + touch, y0, tile, rows)
        for row in range(low, high + 1):
            for column in range(left, right + 1):
                px, py = x0 + (column + 0.5) * tile, y0 + (row + 0.5) * tile
                if squared_distance(px, py, x1, y1, x2, y2) <= touch * touch:
                    at = cursor[row * columns + column]
                    filed[at] = edges[e]
                    cursor[row * columns + column] = at + 1
    return filed


@kernel
def _winding_numbers(
    edges: Array, x0: float, y0: float, tile: float, columns: int, rows: int, outside: int
) -> NDArray[np.int64]:
    """For every tile's centre: signed crossings of the ray from it towards +x."""
    windings = np.full(columns * rows, outside, dtype=np.int64)
    for e in range(edges.shape[0]):
        x1, y1, x2, y2 = edges[e]
        for row in range(rows):
            py = y0 + (row + 0.5) * tile
            if (y1 > py) == (y2 > py):
                continue
            crossing = x1 + (py - y1) / (y2 - y1) * (x2 - x1)
            sign = 1 if y2 > y1 else -1
            last = min(math.ceil((crossing - x0) / tile + 0.5), columns)
            for column in range(last):
                if x0 + (column + 0.5) * tile < crossing:
                    windings[row * columns + column] += sign
    return windings


@lean
def enters(outline: Outline, margin: float, x1: float, y1: float, x2: float, y2: float) -> bool:
    """Whether a segment, in the base frame, has points inside the grown outline."""
    grown = outline.stretch * margin
    if max(x1, x2) < outline.back - grown or min(x1, x2) > outline.front + grown:
        return False
    if max(y1, y2) < outline.right - grown or min(y1, y2) > outline.left + grown:
        return False
    dx, dy = x2 - x1, y2 - y1
    first, last = 0.0, 1.0
    for i in range(outline.offsets.shape[0]):
        nx, ny = outline.normals[i, 0], outline.normals[i, 1]
        room = outline.offsets[i] + margin - (nx * x1 + ny * y1)
        slope = nx * dx + ny * dy
        if slope > 0.0:
            last = min(last, room / slope)
        elif slope < 0.0:
            first = max(first, room / slope)
        elif room <= 0.0:
            return False
        if first >= last:
            return False
    return True


@lean
def _crossing(rx: float, ry: float, x: float, y: float, edge: Array) -> int:
    """Change of the winding number where the way from r to (x, y) crosses an edge."""
    x1, y1, x2, y2 = edge[0], edge[1], edge[2], edge[3]
    dx, dy = x - rx, y - ry
    if (dx * (y1 - ry) - dy * (x1 - rx) >= 0.0) == (dx * (y2 - ry) - dy * (x2 - rx) >= 0.0):
        return 0
    ex, ey = x2 - x1, y2 - y1
    before = ex * (ry - y1) - ey * (rx - x1) >= 0.0
    after = ex * (y - y1) - ey * (x - x1) >= 0.0
    if before == after:
        return 0
    return 1 if after else -1


@lean
def is_clear(
    world: EdgeMap, outline: Outline, x: float, y: float, c: float, s: float, margin: float
) -> bool:
    """Whether the base at (x, y), heading (c, s) = (cos, sin), is free of overlap.

    Touching is free. `margin` [m] moves the outline's sides outward; outline and margin
    must stay within the reach that the map was made for.
    """
    column = math.floor((x - world.x0) / world.tile)
    row = math.floor((y - world.y0) / world.tile)
    if column < 0 or row < 0 or column >= world.columns or row >= world.rows:
        return world.outside == 0
    index = row * world.columns + column
    winding = world.windings[index]
    rx = world.x0 + (column + 0.5) * world.tile
    ry = world.y0 + (row + 0.5) * world.tile
    for e in range(world.starts[index], world.starts[index + 1]):
        edge = world.edges[e]
        ax, ay = edge[0] - x, edge[1] - y
        bx, by = edge[2] - x, edge[3] - y
        if enters(
            outline, margin, c * ax + s * ay, c * ay - s * ax, c * bx + s * by, c * by - s * bx
        ):
            return False
        winding += _crossing(rx, ry, x, y, edge)
    return bool(winding == 0)


def pose_is_clear(world: EdgeMap, outline: Outline, pose: Array, margin: float) -> bool:
    """`is_clear` for a pose (3,) [m, m, rad]."""
    x, y, heading = (float(value) for value in pose)
    return is_clear(world, outline, x, y, math.cos(heading), math.sin(heading), margin)
