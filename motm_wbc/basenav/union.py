"""Polygons united, so that outlines that meet up to rounding meet exactly."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from motm_wbc.basenav.noding import Rings, near_misses, noded
from motm_wbc.basenav.outlines import clusters
from motm_wbc.basenav.walls import TOUCH, Indices
from motm_wbc.geometry.arrays import Array, BoolArray

_ROUNDINGS = 8.0  # that an outline may be off by, each as coarse as doubles are there
_ROUNDS = 4  # of uniting and noding, after which all meets exactly
_LEAST_CLOSED = 4  # points of a ring that has an area, the first one twice
_FINE = 0.01  # of what touches: the grid of the union that can't fail


def united(
    parts: Sequence[shapely.Polygon], without: Sequence[shapely.Polygon] = ()
) -> list[shapely.Polygon]:
    """Polygons of a union, less others; noded: where two touch, both have a corner.

    What is no farther apart than `TOUCH`, touches. GEOS leaves that to rounding: it may leave
    slits between polygons, and corners beside edges. So where it has left a corner next to an
    edge that doesn't end there, they are made to meet and are united once more, now exactly.

    Args:
        parts: what is united.
        without: what is cut out of the union.
    """
    if len(parts) == 0:
        return []
    apart = _tolerance([*parts, *without])
    pieces = _united([*parts, *without], len(parts), apart)
    for _ in range(_ROUNDS):
        met = _met(pieces, apart)
        if met is None:
            break
        pieces = _united(met, len(met), apart)
    return pieces


def _tolerance(shapes: Sequence[shapely.Polygon]) -> float:
    """What touches [m]: `TOUCH`, or as coarse as doubles are far from the origin."""
    farthest = float(np.abs(shapely.total_bounds(shapes)).max())
    return max(TOUCH, _ROUNDINGS * math.ulp(farthest))


def _united(shapes: list[shapely.Polygon], count: int, apart: float) -> list[shapely.Polygon]:
    """What comes before `count` less the others; only what may meet is united."""
    pieces: list[shapely.Polygon] = []
    for kept, cut in _groups(shapes, count, apart) if shapes else ():
        if len(kept) == 1 and not cut:
            pieces += kept
        elif kept:
            pieces += _combined(kept, cut, apart)
    return pieces


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
    whole = _union(kept, apart)
    if cut:
        taken = _union(cut, apart)
        left = shapely.difference(whole, taken)
        if _holds(left, cut).any():  # never seen; what is blocked must not be free
            left = shapely.difference(whole, taken, grid_size=_FINE * apart)
        whole = left
    return _polygons(whole, apart, fill=not cut)


def _union(parts: list[shapely.Polygon], apart: float) -> shapely.Geometry:
    """The union; on a grid, five times as slow, if GEOS has lost one of the polygons.

    It does so where corners lie next to edges, about once in a thousand times.
    """
    if len(parts) == 1:
        return parts[0]
    whole = shapely.union_all(parts)
    if _holds(whole, parts).all():
        return whole
    return shapely.union_all(parts, grid_size=_FINE * apart)


def _holds(whole: shapely.Geometry, parts: list[shapely.Polygon]) -> BoolArray:
    """(p,) whether a geometry has some inner point of each of the polygons inside."""
    shapely.prepare(whole)
    points = shapely.get_coordinates(shapely.point_on_surface(parts))
    return np.asarray(shapely.contains_xy(whole, points))


def _met(parts: list[shapely.Polygon], apart: float) -> list[shapely.Polygon] | None:
    """Polygons with outlines that meet exactly; None if they do so as they are."""
    if not parts:
        return None
    rings, first_ring = _rings(parts)
    pairs = near_misses(rings, apart)
    if len(pairs) == 0:
        return None
    where = np.searchsorted(first_ring, rings.ring[pairs], side="right") - 1
    near = set(where.ravel().tolist())
    far = [part for k, part in enumerate(parts) if k not in near]
    return far + _noded([part for k, part in enumerate(parts) if k in near], apart)


def _rings(parts: list[shapely.Polygon]) -> tuple[Rings, Indices]:
    """All rings, and the number of each polygon's outline."""
    _, points, (start, first_ring) = shapely.to_ragged_array(parts)
    ring = np.repeat(np.arange(len(start) - 1), np.diff(start))
    return Rings(points, ring), np.asarray(first_ring[:-1])


def _noded(parts: list[shapely.Polygon], apart: float) -> list[shapely.Polygon]:
    """The polygons, noded with each other: each may fall into several, or be gone."""
    rings, first_ring = _rings(parts)
    count = int(rings.ring[-1]) + 1
    points, ring = noded(rings, apart)
    lines = np.split(points, np.searchsorted(ring, np.arange(1, count)))
    each = np.split(np.arange(count), first_ring[1:])
    return [piece for of_part in each for piece in _valid([lines[k] for k in of_part])]


def _valid(lines: list[Array]) -> list[shapely.Polygon]:
    """Polygons of an outline and holes that may touch themselves along edges."""
    outline, *holes = lines
    if len(outline) < _LEAST_CLOSED:
        return []
    polygon = shapely.Polygon(outline, [hole for hole in holes if len(hole) >= _LEAST_CLOSED])
    valid = shapely.make_valid(polygon, method="structure", keep_collapsed=False)
    return [part for part in shapely.get_parts(valid) if part.geom_type == "Polygon"]


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
