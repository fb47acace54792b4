"""How deep a segment lies in an upright convex solid, and the shortest way out, compiled.

The depth along an outward axis is how far the solid reaches along it, less how far the
segment's nearest point does. The least over the facets of the Minkowski difference is the
penetration depth (van den Bergen, Collision Detection in Interactive 3D Environments, 2003).
Every axis gives an upper bound, so a facet too many does no harm.

The kernels write signed distance (minus the depth), the segment's deepest point, and the unit
normal against the way out, as `distance` does.
"""

from __future__ import annotations

import math

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel
from motm_wbc.geometry.prism import NX, NY, X, Y

TOUCHING = 1e-9
"""Distance below which two bodies touch [m]."""
_SHORT = 1e-12  # [m] a vector this short has no direction
_BY_TILT = -1.0  # place on the segment: its deepest end
_FAR = 1e300  # [m] stands for no way out yet
_STEPS = 60  # of Newton's method over a rim; 5 are usual
_SETTLED = 1e-9  # relative step at which it ends; the error left is its square

_Way = tuple[float, float, float, float, float]
"""Depth [m], unit way out (3), and place on the segment in [0, 1] or `_BY_TILT`."""


@kernel
def prism_depth(a: Array, b: Array, edges: Array, bottom: float, top: float, out: Array) -> None:
    """Depth of a segment in an upright prism that it overlaps.

    The facets are the prism's own and those that the segment sweeps along its edges.

    Args:
        a: (3,) first end [m].
        b: (3,) second end [m]; may be the first.
        edges: (n, 7) as from `prism.outline_edges`.
        bottom: height of the lower face [m].
        top: height of the upper face [m].
        out: (7,) signed distance, deepest point, normal; is written.
    """
    way = _through_end(a, b, bottom, top)
    other = _through_side(a, b, edges)
    if other[0] < way[0]:
        way = other
    other = _over_level_edge(a, b, edges, bottom, top)
    if other[0] < way[0]:
        way = other
    other = _beside_upright_edge(a, b, edges)
    if other[0] < way[0]:
        way = other
    place = way[4]
    if place == _BY_TILT:
        place = _end_by_tilt(a, b, way)
        if place == _BY_TILT:
            place = _middle(*_between_faces(a, b, bottom, top, *_within_outline(a, b, edges)))
    _write(a, b, way, place, out)


@kernel
def cylinder_depth(
    a: Array,
    b: Array,
    x: float,
    y: float,
    radius: float,
    bottom: float,
    top: float,
    out: Array,
) -> None:
    """Depth of a segment in an upright cylinder that it overlaps.

    The ways out: up, down, level through the mantle, and square to the segment over a rim.

    Args:
        a: (3,) first end [m].
        b: (3,) second end [m]; may be the first.
        x: place of the axis [m].
        y: the same.
        radius: of the cylinder [m].
        bottom: height of the lower face [m].
        top: height of the upper face [m].
        out: (7,) signed distance, deepest point, normal; is written.
    """
    way = _through_end(a, b, bottom, top)
    other = _through_mantle(a, b, x, y, radius)
    if other[0] < way[0]:
        way = other
    for side in (1.0, -1.0):
        other = _over_rim(a, b, x, y, radius, top if side > 0.0 else bottom, side)
        if other[0] < way[0]:
            way = other
    place = way[4]
    if place == _BY_TILT:
        place = _end_by_tilt(a, b, way)
        if place == _BY_TILT:
            inside = _within_disc(a, b, x, y, radius)
            place = _middle(*_between_faces(a, b, bottom, top, *inside))
    _write(a, b, way, place, out)


@kernel
def _through_end(a: Array, b: Array, bottom: float, top: float) -> _Way:
    """The way up or down."""
    up, down = top - min(a[2], b[2]), max(a[2], b[2]) - bottom
    if up <= down:
        return up, 0.0, 0.0, 1.0, _BY_TILT
    return down, 0.0, 0.0, -1.0, _BY_TILT


@kernel
def _through_side(a: Array, b: Array, edges: Array) -> _Way:
    """The best way through an upright face."""
    depth, best = _FAR, 0
    for i in range(edges.shape[0]):
        start = edges[i, NX] * (edges[i, X] - a[0]) + edges[i, NY] * (edges[i, Y] - a[1])
        end = edges[i, NX] * (edges[i, X] - b[0]) + edges[i, NY] * (edges[i, Y] - b[1])
        if max(start, end) < depth:
            depth, best = max(start, end), i
    return depth, edges[best, NX], edges[best, NY], 0.0, _BY_TILT


@kernel
def _over_level_edge(a: Array, b: Array, edges: Array, bottom: float, top: float) -> _Way:
    """The best way square to the segment and to an edge of the lower or upper face.

    The axis is their cross product, turned so that its level part points out of the edge:
    then this edge is the one that the solid reaches farthest with.
    """
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    best = _FAR, 0.0, 0.0, 1.0, 0.0
    if abs(dz) < _SHORT:
        return best
    for i in range(edges.shape[0]):
        nx, ny = edges[i, NX], edges[i, NY]
        rise = -(nx * dx + ny * dy) if dz > 0.0 else nx * dx + ny * dy
        length = math.sqrt(dz * dz + rise * rise)
        level, rise = abs(dz) / length, rise / length
        face = top if rise > 0.0 else bottom
        inside = nx * (edges[i, X] - a[0]) + ny * (edges[i, Y] - a[1])
        depth = level * inside + rise * (face - a[2])
        if depth < best[0]:
            place = (face - depth * rise - a[2]) / dz
            best = depth, level * nx, level * ny, rise, min(max(place, 0.0), 1.0)
    return best


@kernel
def _beside_upright_edge(a: Array, b: Array, edges: Array) -> _Way:
    """The better level way square to the segment, past the farthest corner of the outline."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dx * dx + dy * dy)
    if length < _SHORT:
        return _FAR, 0.0, 0.0, 1.0, 0.0
    wx, wy = -dy / length, dx / length
    left, right, left_corner, right_corner = -_FAR, -_FAR, 0, 0
    for i in range(edges.shape[0]):
        reach = wx * (edges[i, X] - a[0]) + wy * (edges[i, Y] - a[1])
        if reach > left:
            left, left_corner = reach, i
        if -reach > right:
            right, right_corner = -reach, i
    corner = left_corner
    if right < left:
        left, corner, wx, wy = right, right_corner, -wx, -wy
    along = (edges[corner, X] - a[0]) * dx + (edges[corner, Y] - a[1]) * dy
    return left, wx, wy, 0.0, min(max(along / (length * length), 0.0), 1.0)


@kernel
def _through_mantle(a: Array, b: Array, x: float, y: float, radius: float) -> _Way:
    """The level way from the cylinder's axis through the segment's place nearest to it."""
    ax, ay, dx, dy = a[0] - x, a[1] - y, b[0] - a[0], b[1] - a[1]
    dd = dx * dx + dy * dy
    t = min(max(-(ax * dx + ay * dy) / dd, 0.0), 1.0) if dd > 0.0 else 0.0
    px, py = ax + t * dx, ay + t * dy
    near = math.sqrt(px * px + py * py)
    place = t if dd > TOUCHING * TOUCHING else _BY_TILT
    if near > _SHORT:
        return radius - near, px / near, py / near, 0.0, place
    length = math.sqrt(dd)
    if length > _SHORT:
        return radius, -dy / length, dx / length, 0.0, place
    return radius, 1.0, 0.0, 0.0, place


@kernel
def _over_rim(
    a: Array, b: Array, x: float, y: float, radius: float, face: float, side: float
) -> _Way:
    """The best way square to the segment over the rim of the face on one side (up 1, down -1).

    Seen along the segment, the rim is an ellipse: half axes `radius`, level, and radius times
    `sine` of the segment's slope. The way out of it at the angle whose cotangent is c is
    stationary where A - B c - R c / sqrt(c^2 + sine^2) = 0, A and B the segment's place
    beside and beyond the centre, R = radius cosine^2. This function of c is convex, and A
    >= 0: from c = 0, Newton's method grows to its first root and never beyond. That is the
    least depth. Where there is no root, the way through the mantle is the better one.
    """
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    level = math.sqrt(dx * dx + dy * dy)
    length = math.sqrt(level * level + dz * dz)
    if level < _SHORT or abs(dz) < _SHORT:
        return _FAR, 0.0, 0.0, 1.0, 0.0
    sine, cosine = abs(dz) / length, level / length
    hx, hy = -dy / level, dx / level
    beside = hx * (a[0] - x) + hy * (a[1] - y)
    if beside < 0.0:
        beside, hx, hy = -beside, -hx, -hy
    tilt = -side * dz / length / level
    ex, ey, ez = tilt * dx, tilt * dy, side * cosine
    beyond = ex * (a[0] - x) + ey * (a[1] - y) + ez * (a[2] - face)
    cotangent = 0.0
    for _ in range(_STEPS):
        spread = math.sqrt(cotangent * cotangent + sine * sine)
        bend = radius * cosine * cosine / spread
        value = beside - (beyond + bend) * cotangent
        slope = -beyond - bend * (sine / spread) ** 2
        if slope >= 0.0:
            return _FAR, 0.0, 0.0, 1.0, 0.0
        step = -value / slope
        cotangent += step
        if step <= _SETTLED * cotangent:
            break
    norm = math.sqrt(1.0 + cotangent * cotangent)
    spread = math.sqrt(cotangent * cotangent + sine * sine)
    depth = (radius * spread - beside * cotangent - beyond) / norm
    wx, wy, wz = (cotangent * hx + ex) / norm, (cotangent * hy + ey) / norm, ez / norm
    reach = radius * norm / spread
    along = (x + reach * wx - a[0]) * dx + (y + reach * wy - a[1]) * dy + (face - a[2]) * dz
    return depth, wx, wy, wz, min(max(along / (length * length), 0.0), 1.0)


@kernel
def _end_by_tilt(a: Array, b: Array, way: _Way) -> float:
    """The deeper end of the segment, `_BY_TILT` where it lies square to the way out."""
    tilt = way[1] * (b[0] - a[0]) + way[2] * (b[1] - a[1]) + way[3] * (b[2] - a[2])
    if abs(tilt) <= TOUCHING:
        return _BY_TILT
    return 0.0 if tilt > 0.0 else 1.0


@kernel
def _below(start: float, rate: float, low: float, high: float) -> tuple[float, float]:
    """The part of the interval where start + t rate is not positive, up to `TOUCHING`."""
    if rate > 0.0:
        high = max(min(high, (TOUCHING - start) / rate), 0.0)
    elif rate < 0.0:
        low = min(max(low, (TOUCHING - start) / rate), 1.0)
    return low, high


@kernel
def _between_faces(
    a: Array, b: Array, bottom: float, top: float, low: float, high: float
) -> tuple[float, float]:
    """The part of the interval in which the segment lies between two heights."""
    low, high = _below(a[2] - top, b[2] - a[2], low, high)
    return _below(bottom - a[2], a[2] - b[2], low, high)


@kernel
def _within_outline(a: Array, b: Array, edges: Array) -> tuple[float, float]:
    """The interval in which the segment lies in an outline."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    low, high = 0.0, 1.0
    for i in range(edges.shape[0]):
        start = edges[i, NX] * (a[0] - edges[i, X]) + edges[i, NY] * (a[1] - edges[i, Y])
        low, high = _below(start, edges[i, NX] * dx + edges[i, NY] * dy, low, high)
    return low, high


@kernel
def _within_disc(a: Array, b: Array, x: float, y: float, radius: float) -> tuple[float, float]:
    """The interval in which the segment lies in a disc."""
    ax, ay, dx, dy = a[0] - x, a[1] - y, b[0] - a[0], b[1] - a[1]
    dd, half, cross = dx * dx + dy * dy, ax * dx + ay * dy, ax * dy - ay * dx
    if dd < _SHORT * _SHORT:
        return 0.0, 1.0
    reach = math.sqrt(max(radius * radius * dd - cross * cross, 0.0))
    return max((-half - reach) / dd, 0.0), min((-half + reach) / dd, 1.0)


@kernel
def _middle(low: float, high: float) -> float:
    return min(max(0.5 * (low + high), 0.0), 1.0)


@kernel
def _write(a: Array, b: Array, way: _Way, place: float, out: Array) -> None:
    out[0] = -way[0]
    for i in range(3):
        out[1 + i] = a[i] + place * (b[i] - a[i])
        out[4 + i] = -way[1 + i]
