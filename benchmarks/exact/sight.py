"""The free space of a point as a brute-force reference sees it: numpy and shapely alone.

Conventions, the planner's own: what is blocked is open, so a path may run along an edge and
through corners; where outlines touch there is no passage between them. What lies within
`TOLERANCE` of a line counts as on it, and what is thinner does not count.

Around every corner the plane falls into free *sectors*, between the blocked ones of all
outlines that meet there. A path may pass the corner only within one sector.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.polygon import orient

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TOLERANCE = 1e-9
"""[m]"""
_CERTAIN = 1e-7  # [m] a line that goes deeper than this is blocked without a second look
_FAR = 1e3  # [m] nothing is asked about what lies further outside of a boundary
_FREE, _BLOCKED = False, True
_NUMBERS = 1 << 20  # numbers in one array of a vectorised test


class Sector(NamedTuple):
    """Directions from one, counter-clockwise over an angle, that are free at a corner.

    Attributes:
        start: [rad]
        span: [rad]
        ray_lengths: of the edges that bound it [m].
    """

    start: float
    span: float
    ray_lengths: tuple[float, float]


class FreeSpace:
    """What is free outside of (or, bounded, inside of) some polygons.

    Attributes:
        corners: (n, 2) distinct places of the outlines' corners [m].
        first_sector: (n,) number of each corner's first sector among all corners' sectors.
    """

    def __init__(self, region: MultiPolygon, bounded: bool) -> None:
        """Take united polygons: the free region if `bounded`, else the blocked one."""
        region = _without_slivers(region)
        rings = [
            _distinct(np.array(line.coords)[:-1])
            for polygon in region.geoms
            for turned in [orient(polygon, -1.0 if bounded else 1.0)]
            for line in (turned.exterior, *turned.interiors)
        ]
        self._blocked: MultiPolygon | Polygon = region
        if bounded:
            frame = shapely.box(*region.bounds) if rings else shapely.box(-_FAR, -_FAR, _FAR, _FAR)
            self._blocked = frame.buffer(_FAR, join_style="mitre").difference(region)
        self._core = self._blocked.buffer(-_CERTAIN, join_style="mitre")
        self._edge_line = self._blocked.boundary
        for shape in (self._blocked, self._core, self._edge_line):
            shapely.prepare(shape)
        none = np.zeros((0, 2))
        self._befores = np.vstack([none, *(np.roll(ring, 1, axis=0) for ring in rings)])
        self._tails = np.vstack([none, *rings])
        self._heads = np.vstack([none, *(np.roll(ring, -1, axis=0) for ring in rings)])
        self.corners = _merged(self._tails)
        self._sectors = [self._sectors_at(place) for place in self.corners]
        counts = [len(sectors) for sectors in self._sectors]
        self.first_sector = np.cumsum([0, *counts], dtype=np.int64)[:-1]

    @property
    def edges(self) -> Array:
        """(e, 2, 2) the outlines' edges, from and to [m]."""
        return np.stack([self._tails, self._heads], axis=1)

    def is_blocked(self, points: Array) -> Flags:
        """(m,) which points (m, 2) lie deeper than the tolerance in what is blocked."""
        inside: Flags = shapely.contains_xy(self._blocked, points[:, 0], points[:, 1])
        depth = shapely.distance(shapely.points(points), self._edge_line)
        return np.asarray(inside & (depth > TOLERANCE))

    def sector(self, corner: int, direction: Array) -> int:
        """Number of the sector that a direction [m], not normalised, leads into; or -1."""
        length = math.hypot(*direction)
        angle = math.atan2(direction[1], direction[0])
        for number, (start, span, (first, last)) in enumerate(self._sectors[corner]):
            past = (angle - start) % math.tau
            if past <= span + TOLERANCE / min(length, last):
                return number
            if math.tau - past <= TOLERANCE / min(length, first):
                return number
        return -1

    def free(self, starts: Array, ends: Array) -> Flags:
        """(m,) which segments from (m, 2) to (m, 2) [m] are free; their ends must be."""
        lines = shapely.linestrings(np.stack([starts, ends], axis=1))
        found: Flags = np.logical_not(np.atleast_1d(shapely.intersects(self._core, lines)))
        for few in _chunks(np.flatnonzero(found), len(self._tails)):
            found[few] = self._free_carefully(starts[few], ends[few])
        return found

    def _free_carefully(self, starts: Array, ends: Array) -> Flags:
        ways = ends - starts
        lengths = np.hypot(ways[:, 0], ways[:, 1])
        units = ways / lengths[:, None]
        left = _cross(units[:, None], self._tails - starts[:, None])
        after = _cross(units[:, None], self._heads - starts[:, None])
        edges = self._heads - self._tails
        edges = edges / np.hypot(edges[:, 0], edges[:, 1])[:, None]
        p_left = _cross(edges, starts[:, None] - self._tails)
        q_left = _cross(edges, ends[:, None] - self._tails)
        crosses = (np.minimum(left, after) < -TOLERANCE) & (np.maximum(left, after) > TOLERANCE)
        crosses &= (np.minimum(p_left, q_left) < -TOLERANCE) & (
            np.maximum(p_left, q_left) > TOLERANCE
        )
        found = ~crosses.any(axis=1)
        off = np.abs(_cross(units[:, None], self.corners - starts[:, None]))
        along = ((self.corners - starts[:, None]) * units[:, None]).sum(axis=2)
        on_line = (off <= TOLERANCE) & (along > TOLERANCE)
        on_line &= along < lengths[:, None] - TOLERANCE
        for i in np.flatnonzero(found):
            through = np.flatnonzero(on_line[i])
            found[i] = all(self._passes(int(k), units[i]) for k in through)
            if found[i]:
                found[i] = self._stretches_free(starts[i], ends[i], np.sort(along[i, through]))
        return found

    def _passes(self, corner: int, unit: Array) -> bool:
        ahead = self.sector(corner, unit)
        return ahead >= 0 and ahead == self.sector(corner, -unit)

    def _stretches_free(self, start: Array, end: Array, stops: Array) -> bool:
        """Whether a line that crosses no edge is free between the corners that it touches."""
        shares = np.concatenate([[0.0], stops / math.dist(start, end), [1.0]])
        middles = 0.5 * (shares[1:] + shares[:-1])
        return not self.is_blocked(start + middles[:, None] * (end - start)).any()

    def _sectors_at(self, place: Array) -> list[Sector]:
        """Free sectors between the blocked ones of the outlines through a place."""
        at_tail = np.hypot(*(self._tails - place).T) <= TOLERANCE
        edges = self._heads - self._tails
        lengths = np.hypot(edges[:, 0], edges[:, 1])
        units = edges / lengths[:, None]
        along = ((place - self._tails) * units).sum(axis=1)
        through = np.abs(_cross(units, place - self._tails)) <= TOLERANCE
        through &= (along > TOLERANCE) & (along < lengths - TOLERANCE)
        rays = [
            (math.atan2(way[1], way[0]), after, math.hypot(*way))
            for k in np.flatnonzero(at_tail | through)
            for way, after in (
                (self._heads[k] - place, _BLOCKED),
                ((self._befores if at_tail[k] else self._tails)[k] - place, _FREE),
            )
        ]
        return _gaps(sorted(rays))


def _gaps(rays: list[tuple[float, bool, float]]) -> list[Sector]:
    """Free sectors between rays in order of their angle.

    Each ray has its angle [rad], what follows it counter-clockwise, and its length [m].
    """
    found = []
    for (start, after, first), (end, _, last) in zip(rays, rays[1:] + rays[:1], strict=True):
        span = (end - start) % math.tau
        if after == _FREE and span > TOLERANCE / min(first, last):
            found.append(Sector(start, span, (first, last)))
    return found


def _without_slivers(region: MultiPolygon) -> MultiPolygon:
    """Without polygons and holes that are thinner than the tolerance."""
    kept = []
    for polygon in region.geoms:
        holes = [hole for hole in polygon.interiors if _is_thick(hole)]
        if _is_thick(polygon.exterior):
            kept.append(Polygon(polygon.exterior, holes))
    return MultiPolygon(kept)


def _is_thick(line: shapely.LinearRing) -> bool:
    return bool(Polygon(line).area > TOLERANCE * line.length)


def _distinct(ring: Array) -> Array:
    """The ring without corners that are at the same place as the one before."""
    kept = [ring[0]]
    for point in ring[1:]:
        if math.dist(point, kept[-1]) > TOLERANCE:
            kept.append(point)
    if len(kept) > 1 and math.dist(kept[0], kept[-1]) <= TOLERANCE:
        kept.pop()
    return np.array(kept)


def _merged(points: Array) -> Array:
    """Distinct places: what lies within the tolerance of an earlier one is left out."""
    distinct = np.unique(points, axis=0)
    if len(distinct) < 2:
        return distinct
    doubled = {second for _, second in cKDTree(distinct).query_pairs(TOLERANCE)}
    return distinct[[k for k in range(len(distinct)) if k not in doubled]]


def _chunks(indices: NDArray[np.int64], width: int) -> list[NDArray[np.int64]]:
    rows = max(1, _NUMBERS // max(width, 1))
    return [indices[k : k + rows] for k in range(0, len(indices), rows)]


def _cross(first: Array, second: Array) -> Array:
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
