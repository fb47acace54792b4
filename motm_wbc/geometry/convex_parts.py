"""Cutting a simple polygon into convex ones, for shapes that must be convex."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

_FLAT = 1e-12  # [m^2] cross product below which three points count as on one line


def convex_parts(polygon: Array) -> list[Array]:
    """Convex polygons that together cover a simple polygon and do not overlap.

    Ears are cut off (Meisters 1975), then triangles are joined over shared edges as long as
    the union stays convex (Hertel and Mehlhorn 1983): at most four times the least number.

    Args:
        polygon: (n, 2) simple polygon, any winding [m].

    Returns:
        Counter-clockwise arrays (k, 2) [m]; the polygon itself where it is convex.
    """
    points = polygons.counter_clockwise(np.asarray(polygon, dtype=float))
    every = list(range(len(points)))
    if _is_convex(points, every):
        return [points]
    return [points[part] for part in _joined(points, _triangles(points))]


def _cross(points: Array, a: int, b: int, c: int) -> float:
    u, v = points[b] - points[a], points[c] - points[b]
    return float(u[0] * v[1] - u[1] * v[0])


def _is_convex(points: Array, part: list[int]) -> bool:
    n = len(part)
    return all(_cross(points, part[i - 1], part[i], part[(i + 1) % n]) >= -_FLAT for i in range(n))


def _triangles(points: Array) -> list[list[int]]:
    """Indices of the triangles that ear clipping leaves."""
    left = list(range(len(points)))
    triangles: list[list[int]] = []
    while len(left) > 3:
        ear = next(i for i in range(len(left)) if _is_ear(points, left, i))
        corner = [left[ear - 1], left[ear], left[(ear + 1) % len(left)]]
        if _cross(points, corner[0], corner[1], corner[2]) > _FLAT:
            triangles.append(corner)
        del left[ear]
    return [*triangles, left]


def _is_ear(points: Array, left: list[int], i: int) -> bool:
    """Whether the corner can be cut off: convex (or flat), no other corner inside."""
    a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
    turn = _cross(points, a, b, c)
    if turn < -_FLAT:
        return False
    if turn <= _FLAT:
        return True
    others = [k for k in left if k not in (a, b, c)]
    return not any(_inside(points, a, b, c, k) for k in others)


def _inside(points: Array, a: int, b: int, c: int, k: int) -> bool:
    edges = ((a, b), (b, c), (c, a))
    return all(_cross(points, start, end, k) >= -_FLAT for start, end in edges)


def _joined(points: Array, parts: list[list[int]]) -> list[list[int]]:
    """Parts after joining neighbours wherever the union is convex."""
    merged = True
    while merged:
        merged = False
        for i in range(len(parts)):
            for j in range(i + 1, len(parts)):
                union = _union(parts[i], parts[j])
                if union is not None and _is_convex(points, union):
                    parts = [*parts[:i], *parts[i + 1 : j], *parts[j + 1 :], union]
                    merged = True
                    break
            if merged:
                break
    return parts


def _union(first: list[int], second: list[int]) -> list[int] | None:
    """Outline of two counter-clockwise parts that share an edge, or None."""
    for i, start in enumerate(first):
        end = first[(i + 1) % len(first)]
        for j in range(len(second)):
            if second[j] == end and second[(j + 1) % len(second)] == start:
                return first[: i + 1] + _ring_after(second, j) + first[i + 1 :]
    return None


def _ring_after(part: list[int], j: int) -> list[int]:
    """The corners strictly between the shared edge's end and start, going round."""
    n = len(part)
    return [part[(j + k) % n] for k in range(2, n)]
