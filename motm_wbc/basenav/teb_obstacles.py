"""Signed distance from the footprint to convex obstacles, with its exact gradient."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from motm_wbc.basenav.obstacle import Solid
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

_FLAT = 1e-12  # [m^2] cross product below which three points count as on one line
_TOUCHING = 1e-12  # [m] distance without a direction
_RIM = 2.0  # [m] width of the blocked rim that stands for all that lies beyond a boundary


class Parts(NamedTuple):
    """Convex polygons, one after the other.

    Attributes:
        sides: (k, 4) corner x, y [m]; outward unit normal of the side to the next corner.
        starts: (p + 1,) first corner of each.
        boxes: (p, 4) x and y of the lower, then of the upper bound [m].
        velocities: (p, 2) [m/s].
    """

    sides: Array
    starts: Indices
    boxes: Array
    velocities: Array


def pack_parts(solids: Sequence[Solid], boundary: Array | None) -> Parts:
    """Convex polygons that cover the solids, and a rim about the boundary."""
    pieces: list[Array] = []
    velocities: list[Array] = []
    for solid in solids:
        own = _convex_pieces(Polygon(solid.outline, solid.holes))
        pieces += own
        velocities += [solid.velocity] * len(own)
    if boundary is not None:
        floor = Polygon(boundary)
        rim = shapely.box(*shapely.buffer(floor, _RIM).bounds).difference(floor)
        own = [piece for part in shapely.get_parts(rim) for piece in _convex_pieces(part)]
        pieces += own
        velocities += [np.zeros(2)] * len(own)
    return Parts(
        np.vstack([np.zeros((0, 4)), *(_sides(piece) for piece in pieces)]),
        np.cumsum([0, *(len(piece) for piece in pieces)]).astype(np.int64),
        np.array([[*p.min(axis=0), *p.max(axis=0)] for p in pieces]).reshape(-1, 4),
        np.array(velocities).reshape(-1, 2),
    )


def footprint_sides(footprint: Array) -> Array:
    """(m, 4) corners and outward normals of the footprint, in the base frame."""
    return _sides(polygons.counter_clockwise(np.asarray(footprint, dtype=float)))


def _convex_pieces(polygon: Polygon) -> list[Array]:
    outline = polygons.counter_clockwise(np.array(polygon.exterior.coords)[:-1])
    if not polygon.interiors and _is_convex(outline):
        return [outline]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    corners = [np.array(triangle.exterior.coords)[:-1] for triangle in triangles]
    return [polygons.counter_clockwise(piece) for piece in corners]


def _is_convex(outline: Array) -> bool:
    incoming = outline - np.roll(outline, 1, axis=0)
    outgoing = np.roll(incoming, -1, axis=0)
    cross = incoming[:, 0] * outgoing[:, 1] - incoming[:, 1] * outgoing[:, 0]
    return bool((cross >= -_FLAT).all())


def _sides(outline: Array) -> Array:
    along = np.roll(outline, -1, axis=0) - outline
    length = np.hypot(along[:, 0], along[:, 1])
    outline, along = outline[length > 0.0], along[length > 0.0] / length[length > 0.0, None]
    return np.column_stack([outline, along[:, 1], -along[:, 0]])


@kernel
def place_footprint(footprint: Array, x: float, y: float, heading: float, out: Array) -> None:
    """Corners and normals (m, 4) of the footprint at a pose, written to `out`."""
    c, s = math.cos(heading), math.sin(heading)
    for i in range(footprint.shape[0]):
        px, py, nx, ny = footprint[i]
        out[i, 0], out[i, 1] = x + c * px - s * py, y + s * px + c * py
        out[i, 2], out[i, 3] = c * nx - s * ny, s * nx + c * ny


@kernel
def _separating_side(
    sides: Array, first: int, end: int, others: Array, begin: int, stop: int, dx: float, dy: float
) -> tuple[float, int, int]:
    """The side of one polygon that the other one, moved by (dx, dy), is farthest outside of.

    Returns:
        Distance outside of its line [m], its index, and the other's nearest corner.
    """
    best, side, corner = -math.inf, first, begin
    for i in range(first, end):
        least, nearest = math.inf, begin
        for j in range(begin, stop):
            ox, oy = others[j, 0] + dx - sides[i, 0], others[j, 1] + dy - sides[i, 1]
            out = sides[i, 2] * ox + sides[i, 3] * oy
            if out < least:
                least, nearest = out, j
        if least > best:
            best, side, corner = least, i, nearest
    return best, side, corner


@kernel
def _nearest_on_sides(
    sides: Array, first: int, end: int, px: float, py: float
) -> tuple[float, float, float]:
    """Squared distance of a point from an outline, and the way from there to the point."""
    best, bx, by = math.inf, 0.0, 0.0
    for i in range(first, end):
        j = i + 1 if i + 1 < end else first
        ex, ey = sides[j, 0] - sides[i, 0], sides[j, 1] - sides[i, 1]
        rx, ry = px - sides[i, 0], py - sides[i, 1]
        along = min(max((rx * ex + ry * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        qx, qy = rx - along * ex, ry - along * ey
        squared = qx * qx + qy * qy
        if squared < best:
            best, bx, by = squared, qx, qy
    return best, bx, by


@kernel
def _corner_distance(
    base: Array, sides: Array, first: int, end: int, dx: float, dy: float
) -> tuple[float, float, float, float, float]:
    """`separation` of polygons that do not overlap, over all pairs of corner and side."""
    best, nx, ny, wx, wy = math.inf, 0.0, 0.0, 0.0, 0.0
    for i in range(base.shape[0]):
        px, py = base[i, 0], base[i, 1]
        squared, qx, qy = _nearest_on_sides(sides, first, end, px - dx, py - dy)
        if squared < best:
            best, nx, ny, wx, wy = squared, qx, qy, px, py
    for j in range(first, end):
        px, py = sides[j, 0] + dx, sides[j, 1] + dy
        squared, qx, qy = _nearest_on_sides(base, 0, base.shape[0], px, py)
        if squared < best:
            best, nx, ny, wx, wy = squared, -qx, -qy, px, py
    distance = math.sqrt(best)
    return distance, nx / distance, ny / distance, wx, wy


@kernel
def separation(
    base: Array, parts: Parts, part: int, dx: float, dy: float, beyond: float
) -> tuple[float, float, float, float, float]:
    """Signed distance from the placed footprint to a part that is moved by (dx, dy).

    Negative: the least way that parts them (separating axis theorem). With the normal n and
    the witness w, a displacement of the base by (dx, dy) and its turn by dt about its origin o
    change the distance by n . (dx, dy) + n . perp(w - o) dt.

    Args:
        base: (m, 4) see `place_footprint`.
        parts: the obstacles.
        part: index of the one.
        dx: by which it is moved [m].
        dy: the same.
        beyond: distance from which on the exact value does not matter: a lower bound that is
            not less may be returned instead [m].

    Returns:
        Distance [m]; unit normal from the part to the base (2); witness point (2) [m].
    """
    sides, first, end = parts.sides, parts.starts[part], parts.starts[part + 1]
    count = base.shape[0]
    out, i, corner = _separating_side(sides, first, end, base, 0, count, -dx, -dy)
    nx, ny = sides[i, 2], sides[i, 3]
    wx, wy = base[corner, 0], base[corner, 1]
    if out < beyond:
        other, j, corner = _separating_side(base, 0, count, sides, first, end, dx, dy)
        if other > out:
            out, nx, ny = other, -base[j, 2], -base[j, 3]
            wx, wy = sides[corner, 0] + dx, sides[corner, 1] + dy
    if out <= _TOUCHING or out >= beyond:
        return out, nx, ny, wx, wy
    return _corner_distance(base, sides, first, end, dx, dy)


@kernel
def between(poses: Array, half: int) -> tuple[float, float, float]:
    """The band's pose half / 2; for odd numbers, half-way between two poses."""
    a, b = poses[half // 2], poses[(half + 1) // 2]
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


@kernel
def near_parts(
    parts: Parts, poses: Array, intervals: Array, radius: float
) -> tuple[Indices, Indices, Array]:
    """Which parts may be within `radius` [m] of the band, its ends left out.

    The band is looked at at its poses and half-way between them: a corner of a turning base
    reaches farther there than at either pose.

    Returns:
        (k,) places, ascending, see `between`; (k,) parts; (k, 2) way of the part until the
        base is there [m].
    """
    found = 0
    for counting in range(2):
        if counting == 1:
            at, which = np.empty(found, dtype=np.int64), np.empty(found, dtype=np.int64)
            moved = np.empty((found, 2))
        found, time = 0, 0.0
        for half in range(1, 2 * intervals.shape[0]):
            time += 0.5 * intervals[(half - 1) // 2]
            x, y, _ = between(poses, half)
            for part in range(parts.boxes.shape[0]):
                dx, dy = parts.velocities[part, 0] * time, parts.velocities[part, 1] * time
                ox = max(parts.boxes[part, 0] + dx - x, x - parts.boxes[part, 2] - dx, 0.0)
                oy = max(parts.boxes[part, 1] + dy - y, y - parts.boxes[part, 3] - dy, 0.0)
                if ox * ox + oy * oy > radius * radius:
                    continue
                if counting == 1:
                    at[found], which[found] = half, part
                    moved[found, 0], moved[found, 1] = dx, dy
                found += 1
    return at, which, moved
