"""Polygons united, so that outlines that meet up to rounding meet exactly."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from motm_wbc.basenav.noding import Rings, near_misses, noded
from motm_wbc.basenav.outlines import clusters
from motm_wbc.basenav.walls import TOUCH
from motm_wbc.geometry.arrays import Array

_ROUNDINGS = 8.0  # that an outline may be off by, each as coarse as doubles are there
_ROUNDS = 4  # of uniting what was noded, after which all meets exactly


def united(
    parts: Sequence[shapely.Polygon], without: Sequence[shapely.Polygon] = ()
) -> list[shapely.Polygon]:
    """Polygons of a union, less others; noded: where two touch, both have a corner.

    What is no farther apart than `TOUCH`, touches. The plain union decides that by
    rounding: it may leave a slit between two polygons, or a corner beside an edge. So where
    it leaves a corner next to an edge that doesn't end there, they are made to meet, and
    united once more: now exactly.

    Args:
        parts: what is united.
        without: what is cut out of the union.
    """
    if len(parts) == 0:
        return []
    apart = _tolerance([*parts, *without])
    pieces: list[shapely.Polygon] = []
    for kept, cut in _groups([*parts, *without], len(parts), apart):
        if len(kept) == 1 and not cut:
            pieces += kept
        elif kept:
            pieces += _combined(kept, cut, apart)
    return _meeting_exactly(pieces, apart, fill=len(without) == 0)


def _tolerance(shapes: Sequence[shapely.Polygon]) -> float:
    """What touches [m]: `TOUCH`, or as coarse as doubles are far from the origin."""
    farthest = float(np.abs(shapely.total_bounds(shapes)).max())
    return max(TOUCH, _ROUNDINGS * math.ulp(farthest))


def _groups(
    shapes: list[shapely.Polygon], count: int, apart: float
) -> list[tuple[list[shapely.Polygon], list[shapely.Polygon]]]:
    """Shapes that may meet, together: those before `count`, and the others."""
    box = shapely.bounds(shapes) + apart * np.array([-1.0, -1.0, 1.0, 1.0])
    found: dict[int, tuple[list[shapely.Polygon], list[shapely.Polygon]]] = {}
    for index, label in enumerate(clusters(box).tolist()):
        found.setdefault(label, ([], []))[index >= count].append(shapes[index])
    return list(found.values())


def _combined(
    kept: list[shapely.Polygon], cut: list[shapely.Polygon], apart: float
) -> list[shapely.Polygon]:
    united = shapely.union_all(kept)
    if cut:
        united = shapely.difference(united, shapely.union_all(cut))
    return _polygons(united, apart, fill=not cut)


def _meeting_exactly(
    parts: list[shapely.Polygon], apart: float, fill: bool
) -> list[shapely.Polygon]:
    """The polygons, those with near misses noded and united again."""
    for _ in range(_ROUNDS):
        if not parts:
            break
        rings, first_ring = _rings(parts)
        pairs = near_misses(rings, apart)
        if len(pairs) == 0:
            break
        part = np.searchsorted(first_ring, rings.ring[pairs], side="right") - 1
        near = set(np.unique(part).tolist())
        meet = [piece for index, piece in enumerate(parts) if index in near]
        parts = [piece for index, piece in enumerate(parts) if index not in near]
        parts += _polygons(shapely.union_all(_noded(meet, apart)), apart, fill)
    return parts


def _rings(parts: list[shapely.Polygon]) -> tuple[Rings, Array]:
    """All rings, and the number of each polygon's outline."""
    _, points, (start, first_ring) = shapely.to_ragged_array(parts)
    ring = np.repeat(np.arange(len(start) - 1), np.diff(start))
    return Rings(points, ring), np.asarray(first_ring[:-1])


def _noded(parts: list[shapely.Polygon], apart: float) -> list[shapely.Geometry]:
    """The polygons with outlines that meet exactly; they may fall apart, or be gone."""
    rings, first_ring = _rings(parts)
    count = rings.ring[-1] + 1
    points, ring = noded(rings, apart)
    lines = np.split(points, np.searchsorted(ring, np.arange(1, count)))
    found = []
    for lines_of in np.split(np.arange(count), first_ring[1:]):
        outline, *holes = (lines[k] for k in lines_of)
        if len(outline) > 3:
            polygon = shapely.Polygon(outline, [hole for hole in holes if len(hole) > 3])
            found.append(shapely.make_valid(polygon, method="structure", keep_collapsed=False))
    return found


def _polygons(geometry: shapely.Geometry, apart: float, fill: bool) -> list[shapely.Polygon]:
    """Polygons of a geometry, without slivers thinner than what touches.

    Args:
        geometry: of any kind.
        apart: what touches [m].
        fill: close holes that are such slivers too: gaps between what met.
    """
    parts = [part for part in shapely.get_parts(geometry) if not _is_sliver(part, apart)]
    return [_filled(part, apart) for part in parts] if fill else parts


def _is_sliver(part: shapely.Geometry, apart: float) -> bool:
    return part.geom_type != "Polygon" or bool(part.area <= apart * part.length)


def _filled(part: shapely.Polygon, apart: float) -> shapely.Polygon:
    holes = [hole for hole in part.interiors if not _is_sliver(shapely.Polygon(hole), apart)]
    return part if len(holes) == len(part.interiors) else shapely.Polygon(part.exterior, holes)
