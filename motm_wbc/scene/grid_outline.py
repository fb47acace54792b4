"""The outlines of the blocked cells of a grid, with few corners, never less than the cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from shapely.geometry import Polygon

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

Mask: TypeAlias = npt.NDArray[np.bool_]
Indices: TypeAlias = npt.NDArray[np.int64]

_FINEST = 0.2  # cells; below it nothing is left out
_SCRAMBLE = 2654435761  # odd: neighbours' ranks are in no order


@dataclass(frozen=True, slots=True)
class CellRegion:
    """Connected cells.

    Attributes:
        outline: (n, 2) counter-clockwise, in cells.
        holes: (n, 2) each, clockwise: free cells that it encloses.
    """

    outline: Array
    holes: tuple[Array, ...]


def cell_regions(blocked: Mask, tolerance: float) -> list[CellRegion]:
    """Polygons that contain the blocked cells.

    Cells that touch at a corner only are joined by filling one of the free cells between:
    there is no way through. Notches are then filled where that needs no more than
    `tolerance`; so straight walls at any angle have few corners, and nothing is uncovered.

    Args:
        blocked: (columns, rows); the cell [i, j] covers i..i+1 and j..j+1.
        tolerance: by which an outline may lie outside of the cells, in cells.
    """
    joined = np.pad(without_pinches(blocked), 1)
    rings = _rings(joined)
    if not rings:
        return []
    labels, count = ndimage.label(joined)
    outlines: list[Array] = [np.empty((0, 2))] * count
    holes: list[list[Array]] = [[] for _ in range(count)]
    filled = filled_outward([np.asarray(ring - 1.0) for ring in rings], tolerance)
    for ring, points in zip(rings, filled, strict=True):
        x, y = ring[0]  # the lowest leftmost corner: an outline has its cell up right of it
        if joined[x, y]:
            outlines[labels[x, y] - 1] = points
        elif len(points) >= 3:
            holes[labels[x - 1, y] - 1].append(points)
    return [CellRegion(one, tuple(some)) for one, some in zip(outlines, holes, strict=True)]


def without_pinches(blocked: Mask) -> Mask:
    """The mask with one cell filled wherever two blocked ones touch at a corner only."""
    filled = blocked.copy()
    while True:
        low, right = filled[:-1, :-1], filled[1:, :-1]
        up, far = filled[:-1, 1:], filled[1:, 1:]
        rising = low & far & ~right & ~up
        falling = right & up & ~low & ~far
        if not (rising.any() or falling.any()):
            return filled
        right |= rising
        low |= falling


def _rings(blocked: Mask) -> list[Indices]:
    """(n, 2) corners of each ring, blocked cells on its left, from the lowest leftmost one.

    Every corner has one edge along x and one along y. The corners on a grid line, in order,
    are joined in pairs: what lies between the first two is an edge, and so on.
    """
    corner = blocked[:-1, :-1] ^ blocked[1:, :-1] ^ blocked[:-1, 1:] ^ blocked[1:, 1:]
    x, y = (one + 1 for one in np.nonzero(corner))  # sorted by x, then y
    count = len(x)
    along_y = np.arange(count) ^ 1
    by_y = np.lexsort((x, y))
    along_x = np.empty(count, dtype=np.int64)
    along_x[by_y[0::2]], along_x[by_y[1::2]] = by_y[1::2], by_y[0::2]
    # Up the left side of a free cell, down that of a blocked one: then blocked is on the left.
    first_along_x = blocked[x, y]
    points = np.column_stack([x, y])
    partners = along_x.tolist(), along_y.tolist()
    begins = first_along_x.tolist()
    done = bytearray(count)
    rings = []
    for start in range(count):
        if done[start]:
            continue
        ring, at, way = [], start, 0 if begins[start] else 1
        while not done[at]:
            done[at] = 1
            ring.append(at)
            at = partners[way][at]
            way = 1 - way
        rings.append(points[ring])
    return rings


def filled_outward(rings: list[Array], tolerance: float) -> list[Array]:
    """Rings with fewer corners, which hold all that they held, and little more.

    Corners at which a ring turns right are left out, which adds a triangle, as long as
    nothing left out is farther than `tolerance` from the new edge. Where a ring would then
    cross itself, half the tolerance is taken. A hole that vanishes has less than three.

    Args:
        rings: (n, 2) each, what it holds on its left.
        tolerance: in the unit of the rings.
    """
    filled = _filled(rings, tolerance)
    wrong = [
        index
        for index, (ring, before) in enumerate(zip(filled, rings, strict=True))
        if len(ring) != len(before) and not _holds(ring, before)
    ]
    if wrong:
        finer = 0.5 * tolerance if tolerance > _FINEST else 0.0
        again = filled_outward([rings[index] for index in wrong], finer)
        for index, ring in zip(wrong, again, strict=True):
            filled[index] = ring
    return filled


def _holds(ring: Array, before: Array) -> bool:
    """Whether all that was on the left of a ring still is."""
    if len(ring) < 3:
        return polygons.signed_area(before) < 0.0
    new, old = Polygon(ring), Polygon(before)
    if not new.is_valid:
        return False
    return bool(new.covers(old) if polygons.signed_area(before) > 0.0 else old.covers(new))


def _filled(rings: list[Array], tolerance: float) -> list[Array]:
    """Leave out what can be, a few rounds of corners that are no neighbours of each other."""
    sizes = np.array([len(ring) for ring in rings])
    ends = np.cumsum(sizes)
    chain = _Chain(np.concatenate(rings), np.repeat(ends - sizes, sizes), np.repeat(sizes, sizes))
    count = len(chain.points)
    before, after = np.arange(-1, count - 1), np.arange(1, count + 1)
    before[ends - sizes], after[ends - 1] = ends - 1, ends - sizes
    rank = np.arange(count) * _SCRAMBLE % (1 << 32)
    left = np.ones(count, dtype=bool)
    while True:
        at = np.flatnonzero(left)
        need = np.full(count, np.inf)
        need[at] = chain.needed(before[at], at, after[at], tolerance)
        first = _comes_first(need, rank, before) & _comes_first(need, rank, after)
        out = np.flatnonzero(np.isfinite(need) & first)
        if len(out) == 0:
            break
        after[before[out]], before[after[out]] = after[out], before[out]
        left[out] = False
    starts = zip(ends - sizes, ends, strict=True)
    return [chain.points[begin:end][left[begin:end]] for begin, end in starts]


class _Chain(NamedTuple):
    """All rings behind each other.

    Attributes:
        points: (n, 2) their corners.
        begin: (n,) index of the first corner of each corner's ring.
        size: (n,) how many corners that ring has.
    """

    points: Array
    begin: Indices
    size: Indices

    def needed(self, before: Indices, at: Indices, after: Indices, tolerance: float) -> Array:
        """(k,) tolerance that leaving out each corner needs; infinite where it can't be."""
        way = self.points[at] - self.points[before]
        onward = self.points[after] - self.points[at]
        chord = way + onward
        across = way[:, 0] * onward[:, 1] - way[:, 1] * onward[:, 0]
        length = np.hypot(chord[:, 0], chord[:, 1])
        need = np.full(len(at), np.inf)
        legal = np.flatnonzero((across <= 0.0) & (length > 0.0) & (-across <= tolerance * length))
        if len(legal):
            need[legal] = self._sag(before[legal], after[legal])
        need[need > tolerance] = np.inf
        return need

    def _sag(self, first: Indices, last: Indices) -> Array:
        """(k,) largest distance from the edges first - last of the corners between them."""
        size = self.size[first]
        counts = (last - first) % size - 1
        starts = np.cumsum(counts) - counts
        step = np.arange(counts.sum()) - np.repeat(starts, counts) + 1
        edge = np.repeat(np.arange(len(first)), counts)
        begin = self.begin[first][edge]
        between = begin + (first[edge] - begin + step) % size[edge]
        chord = self.points[last] - self.points[first]
        chord /= np.hypot(chord[:, 0], chord[:, 1])[:, None]
        offset = self.points[between] - self.points[first][edge]
        away = np.abs(chord[edge, 0] * offset[:, 1] - chord[edge, 1] * offset[:, 0])
        return np.asarray(np.maximum.reduceat(away, starts))


def _comes_first(need: Array, rank: Indices, neighbour: Indices) -> Mask:
    """Whether each corner comes before a neighbour: the lesser need, then the scrambled rank."""
    other = need[neighbour]
    return np.asarray((need < other) | ((need == other) & (rank < rank[neighbour])))
