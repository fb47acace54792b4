"""Closest points of one line segment and one other body, as compiled kernels.

A capsule is a segment with a radius: subtract the radius from the distance. The squared
distance of a segment's points from a convex body is a convex function of the place along the
segment; each kernel finds its minimum exactly. Where the two overlap, `depth` takes over.

All write the same seven numbers: signed distance [m], point of the segment [m] (3), and the
unit normal (3) from the segment to the other body. The other body's point is the segment's
point plus distance times normal.
"""

from __future__ import annotations

import math

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.depth import TOUCHING, cylinder_depth, prism_depth
from motm_wbc.geometry.jit import inlined, kernel
from motm_wbc.geometry.prism import LENGTH, NX, NY, UX, UY, X, Y

_PARALLEL = 1e-24  # squared sine below which two segments have no common normal
_STEPS = 60  # each leaves a piece of the distance for good or halves the bracket
_NARROW = 1e-15  # width of a bracket, in lengths of the segment, that is a point
_SETTLED = 1e-8  # step beside a rim, in lengths of the segment; the error left is its square
_FAR = 1e300  # [m^2] stands for no distance yet
_INSIDE = -1  # piece of the distance from an outline: none


@kernel
def segment_segment(a: Array, b: Array, c: Array, d: Array, out: Array) -> None:
    """Closest points of segments a-b and c-d (Ericson, Real-Time Collision Detection, 5.1.9).

    The nearest places of the two lines come from cross products: unlike the determinant of
    the normal equations they keep their digits where the lines are almost parallel. The
    distance is never negative; where two segments cross, the normal is square to both.

    Args:
        a: (3,) first end of the segment [m].
        b: (3,) its second end; may be the first.
        c: (3,) first end of the other segment [m].
        d: (3,) its second end; may be the first.
        out: (7,) distance, point of a-b, normal; is written.
    """
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    rx, ry, rz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    nn = nx * nx + ny * ny + nz * nz
    s = t = 0.0
    if nn > 0.0:
        across = nx * (ry * vz - rz * vy) + ny * (rz * vx - rx * vz) + nz * (rx * vy - ry * vx)
        s = min(max(across / nn, 0.0), 1.0)
    if vv > 0.0:
        along = (s * ux - rx) * vx + (s * uy - ry) * vy + (s * uz - rz) * vz
        t = min(max(along / vv, 0.0), 1.0)
    if uu > 0.0:
        along = (t * vx + rx) * ux + (t * vy + ry) * uy + (t * vz + rz) * uz
        s = min(max(along / uu, 0.0), 1.0)
    gx, gy, gz = rx + t * vx - s * ux, ry + t * vy - s * uy, rz + t * vz - s * uz
    distance = math.sqrt(gx * gx + gy * gy + gz * gz)
    out[0] = distance
    out[1], out[2], out[3] = a[0] + s * ux, a[1] + s * uy, a[2] + s * uz
    if distance >= TOUCHING:
        share = 1.0 / distance
        out[4], out[5], out[6] = gx * share, gy * share, gz * share
        return
    if nn <= _PARALLEL * uu * vv:
        nx, ny, nz = _square_to(ux, uy, uz) if uu >= vv else _square_to(vx, vy, vz)
        nn = nx * nx + ny * ny + nz * nz
    share = 1.0 / math.sqrt(nn)
    if gx * nx + gy * ny + gz * nz < 0.0:
        share = -share
    out[4], out[5], out[6] = nx * share, ny * share, nz * share


@kernel
def segment_prism(a: Array, b: Array, edges: Array, bottom: float, top: float, out: Array) -> None:
    """Closest points of a segment and an upright prism over a convex outline; boxes are such.

    The squared distance is piecewise quadratic. Newton's step from a piece to the minimum of
    its parabola ends in the piece of the minimum after few steps, and is exact there.

    Args:
        a: (3,) first end [m].
        b: (3,) second end [m]; may be the first.
        edges: (n, 7) as from `prism.outline_edges`.
        bottom: height of the lower face [m].
        top: height of the upper face [m].
        out: (7,) signed distance, point of the segment, normal; is written.
    """
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    t, low, high, last = 0.0, -1.0, 2.0, -3
    qx = qy = qz = 0.0
    for _ in range(_STEPS):
        z = a[2] + t * dz
        piece, qx, qy, curvature = _beyond_outline(edges, a[0] + t * dx, a[1] + t * dy, dx, dy)
        piece *= 3
        qz = 0.0
        if z > top:
            qz = z - top
            piece += 1
            curvature += dz * dz
        elif z < bottom:
            qz = z - bottom
            piece += 2
            curvature += dz * dz
        slope = qx * dx + qy * dy + qz * dz
        if piece == last or slope == 0.0:
            break
        if slope < 0.0:
            low = t
        else:
            high = t
        target = min(max(t - slope / curvature, 0.0), 1.0)
        if target == t or high - low < _NARROW:
            break
        last = piece
        if target <= low or target >= high:
            target = 0.5 * (low + high)
            last = -3
        t = target
    if not _write_apart(a, b, t, qx, qy, qz, out):
        prism_depth(a, b, edges, bottom, top, out)


@kernel
def segment_cylinder(
    a: Array,
    b: Array,
    x: float,
    y: float,
    radius: float,
    bottom: float,
    top: float,
    out: Array,
) -> None:
    """Closest points of a segment and an upright cylinder.

    Beside the mantle the nearest place to the axis is the nearest to the mantle too, and over
    a face the distance is linear; beside a rim the place is the root of a quartic, found by
    Newton's method inside a shrinking bracket.

    Args:
        a: (3,) first end [m].
        b: (3,) second end [m]; may be the first.
        x: place of the axis [m].
        y: the same.
        radius: of the cylinder [m].
        bottom: height of the lower face [m].
        top: height of the upper face [m].
        out: (7,) signed distance, point of the segment, normal; is written.
    """
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    ax, ay, level = a[0] - x, a[1] - y, dx * dx + dy * dy
    t, low, high, last, before = 0.0, -1.0, 2.0, -1, 2.0
    qx = qy = qz = 0.0
    for _ in range(_STEPS):
        px, py, z = ax + t * dx, ay + t * dy, a[2] + t * dz
        squared = px * px + py * py
        qz = z - min(max(z, bottom), top)
        qx = qy = slope = curvature = radial = 0.0
        piece = 0
        if qz * dz != 0.0:  # a level segment is as far beyond a face everywhere
            piece = 1 if qz > 0.0 else 2
            slope, curvature = qz * dz, dz * dz
        if squared > radius * radius:
            rho = math.sqrt(squared)
            share = radius / rho
            radial = px * dx + py * dy
            qx, qy = px * (1.0 - share), py * (1.0 - share)
            slope += (1.0 - share) * radial
            piece += 3
            curvature += (1.0 - share) * level + share * radial * radial / squared
        if slope == 0.0 or (piece == last and (piece <= 3 or abs(t - before) < _SETTLED)):
            break
        if slope < 0.0:
            low = t
        else:
            high = t
        step = slope / curvature if piece != 3 else radial / level
        target = min(max(t - step, 0.0), 1.0)
        if target == t or high - low < _NARROW:
            break
        last = piece
        if target <= low or target >= high:
            target = 0.5 * (low + high)
            last = -1
        before = t
        t = target
    if not _write_apart(a, b, t, qx, qy, qz, out):
        cylinder_depth(a, b, x, y, radius, bottom, top, out)


@inlined
def _write_apart(a: Array, b: Array, t: float, qx: float, qy: float, qz: float, out: Array) -> bool:
    """Write the contact of the segment's point at `t`, q beyond the solid; False if it touches."""
    squared = qx * qx + qy * qy + qz * qz
    if squared < TOUCHING * TOUCHING:
        return False
    distance = math.sqrt(squared)
    share = -1.0 / distance
    out[0] = distance
    for i in range(3):
        out[1 + i] = a[i] + t * (b[i] - a[i])
    out[4], out[5], out[6] = qx * share, qy * share, qz * share
    return True


@kernel
def _square_to(x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector square to another one, of about its length; up for one of no length."""
    if x * x + y * y + z * z < TOUCHING * TOUCHING:
        return 0.0, 0.0, 1.0
    if abs(x) <= abs(y) and abs(x) <= abs(z):
        return 0.0, z, -y
    return (-z, 0.0, x) if abs(y) <= abs(z) else (y, -x, 0.0)


@kernel
def _beyond_outline(
    edges: Array, x: float, y: float, dx: float, dy: float
) -> tuple[int, float, float, float]:
    """Where a point lies beyond an outline.

    Only edges that the point lies outside of count. Where it lies square to one of them, this
    is the nearest.

    Returns:
        Number of the Voronoi region, `_INSIDE` for the outline itself; from the nearest
        point of the outline to the point x, y [m]; half the second derivative of the squared
        distance when the point moves by dx, dy.
    """
    region, nearest, qx, qy, curvature = _INSIDE, _FAR, 0.0, 0.0, 0.0
    for i in range(edges.shape[0]):
        rx, ry = x - edges[i, X], y - edges[i, Y]
        above = edges[i, NX] * rx + edges[i, NY] * ry
        if above <= 0.0:
            continue
        along = edges[i, UX] * rx + edges[i, UY] * ry
        if 0.0 <= along <= edges[i, LENGTH]:
            rate = edges[i, NX] * dx + edges[i, NY] * dy
            return 3 * i, above * edges[i, NX], above * edges[i, NY], rate * rate
        over = along if along < 0.0 else along - edges[i, LENGTH]
        squared = above * above + over * over
        if squared < nearest:
            nearest = squared
            region = 3 * i + 1 if along < 0.0 else 3 * i + 2
            qx = above * edges[i, NX] + over * edges[i, UX]
            qy = above * edges[i, NY] + over * edges[i, UY]
            curvature = dx * dx + dy * dy
    return region, qx, qy, curvature
