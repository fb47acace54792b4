"""A grid of how near obstacles are: 1 at them, falling to 0 within a radius.

Occupied cells are dilated, then blurred by a box, so that the value falls evenly with the
distance (STAA*, grid heuristics). The grid covers a square about the robot and is aligned
with the world: a cell has the same value whatever square it is computed in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.footprint_check import Outline, grown_corners, squared_distance
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_DILATED = 0.4  # share of the radius that is dilation; the rest is blur
_SAMPLE_SPACING = 0.12  # [m] on the outline, below half the way on which the value falls


class ProximityGrid(NamedTuple):
    """Nearness of obstacles over a square.

    Attributes:
        x0: left edge of the square [m].
        y0: lower edge [m].
        cell: side of a cell [m].
        values: (rows, columns) nearness, 0 to 1.
        around: (rows, columns) the largest value that the base's outline can meet when
            its origin is in this cell.
    """

    x0: float
    y0: float
    cell: float
    values: Array
    around: Array


class Rings(NamedTuple):
    """Polygons one after the other, with what is blocked on their left.

    Attributes:
        points: (n, 2) corners [m].
        starts: (r + 1,) first corner of each.
        outside: 1 if all that is in no ring is solid (there is a boundary), else 0.
    """

    points: Array
    starts: NDArray[np.int64]
    outside: int


def rings_of(rings: Sequence[Array], bounded: bool) -> Rings:
    """Pack rings (n, 2) [m] with what is blocked on their left."""
    points = np.ascontiguousarray(np.vstack(rings)) if rings else np.zeros((0, 2))
    starts = np.cumsum([0, *(len(ring) for ring in rings)]).astype(np.int64)
    return Rings(points, starts, 1 if bounded else 0)


def sample_outline(outline: Outline) -> Array:
    """(k, 2) points on the outline, evenly spaced on each side, in the base frame [m]."""
    corners = grown_corners(outline, 0.0)
    points = []
    for first, second in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.hypot(*(second - first))) / _SAMPLE_SPACING))
        points.append(first + (second - first) * (np.arange(count) / count)[:, None])
    return np.ascontiguousarray(np.vstack(points))


def proximity_grid(
    rings: Rings, centre: tuple[float, float], half: float, cell: float, radius: float, reach: float
) -> ProximityGrid:
    """Compute the grid.

    Args:
        rings: the world's polygons.
        centre: of the square [m].
        half: half its side [m].
        cell: side of a cell [m].
        radius: distance from an obstacle at which the value has fallen to 0 [m].
        reach: largest distance from the base's origin to a point of its outline [m].
    """
    dilation = round(_DILATED * radius / cell)
    blur = max(round(radius / cell) - dilation, 0)
    pad = dilation + blur + math.ceil(reach / cell) + 1
    # Cells are counted from the world's origin, so that every square has the same ones.
    column = math.floor((centre[0] - half) / cell) - pad
    row = math.floor((centre[1] - half) / cell) - pad
    count = math.ceil(2.0 * half / cell) + 2 * pad
    occupied = _occupied(rings, column, row, count, cell)
    values = _box_blurred(_dilated(occupied, dilation), blur)
    around = _dilated(values, math.ceil(reach / cell) + 1)
    return ProximityGrid(column * cell, row * cell, cell, values, around)


@kernel
def _occupied(rings: Rings, column0: int, row0: int, count: int, cell: float) -> Array:
    """1 where a cell's centre is inside a solid or within half a diagonal of its edge."""
    winding = np.full((count, count), rings.outside)
    occupied = np.zeros((count, count))
    touch = cell * math.sqrt(0.5)
    for ring in range(rings.starts.shape[0] - 1):
        first, last = rings.starts[ring], rings.starts[ring + 1]
        for i in range(first, last):
            x1, y1 = rings.points[i]
            x2, y2 = rings.points[i + 1 if i + 1 < last else first]
            low = max(math.floor((min(y1, y2) - touch) / cell) - row0, 0)
            high = min(math.floor((max(y1, y2) + touch) / cell) - row0, count - 1)
            left = max(math.floor((min(x1, x2) - touch) / cell) - column0, 0)
            right = min(math.floor((max(x1, x2) + touch) / cell) - column0, count - 1)
            for row in range(low, high + 1):
                py = (row0 + row + 0.5) * cell
                for column in range(left, right + 1):
                    px = (column0 + column + 0.5) * cell
                    if squared_distance(px, py, x1, y1, x2, y2) <= touch * touch:
                        occupied[row, column] = 1.0
                if (y1 > py) == (y2 > py):
                    continue
                crossing = x1 + (py - y1) / (y2 - y1) * (x2 - x1)
                sign = 1 if y2 > y1 else -1
                end = min(math.ceil(crossing / cell - 0.5) - column0, count)
                for column in range(end):
                    winding[row, column] += sign
    for row in range(count):
        for column in range(count):
            if winding[row, column] != 0:
                occupied[row, column] = 1.0
    return occupied


@kernel
def _dilated(grid: Array, cells: int) -> Array:
    """Largest value within a square of 2 * cells + 1, rows first, then columns."""
    rows, columns = grid.shape
    between = np.zeros_like(grid)
    result = np.zeros_like(grid)
    for row in range(rows):
        for column in range(columns):
            value = grid[row, column]
            if value > 0.0:
                for k in range(max(column - cells, 0), min(column + cells + 1, columns)):
                    between[row, k] = max(between[row, k], value)
    for row in range(rows):
        for k in range(max(row - cells, 0), min(row + cells + 1, rows)):
            for column in range(columns):
                result[k, column] = max(result[k, column], between[row, column])
    return result


@kernel
def _box_blurred(grid: Array, cells: int) -> Array:
    """Mean over a square of 2 * cells + 1; beyond the grid its nearest cell counts."""
    rows, columns = grid.shape
    size = 2 * cells + 1
    between = np.empty_like(grid)
    result = np.empty_like(grid)
    for row in range(rows):
        for column in range(columns):
            total = 0.0
            for k in range(column - cells, column + cells + 1):
                total += grid[row, min(max(k, 0), columns - 1)]
            between[row, column] = total / size
    for row in range(rows):
        for column in range(columns):
            total = 0.0
            for k in range(row - cells, row + cells + 1):
                total += between[min(max(k, 0), rows - 1), column]
            result[row, column] = total / size
    return result


@lean
def largest_under(
    grid: ProximityGrid, samples: Array, x: float, y: float, c: float, s: float
) -> float:
    """Largest nearness under the outline of the base at (x, y), heading (c, s).

    Where the base is free of collision the largest value lies on the rim of its outline,
    so only that is sampled. Beyond the grid nothing is known, and 0 is returned.
    """
    rows, columns = grid.values.shape
    column = math.floor((x - grid.x0) / grid.cell)
    row = math.floor((y - grid.y0) / grid.cell)
    if column < 0 or row < 0 or column >= columns or row >= rows:
        return 0.0
    if grid.around[row, column] == 0.0:
        return 0.0
    largest = 0.0
    for i in range(samples.shape[0]):
        px = x + c * samples[i, 0] - s * samples[i, 1]
        py = y + s * samples[i, 0] + c * samples[i, 1]
        column = math.floor((px - grid.x0) / grid.cell)
        row = math.floor((py - grid.y0) / grid.cell)
        if 0 <= column < columns and 0 <= row < rows:
            largest = max(largest, grid.values[row, column])
    return largest
