"""Signed distances of convex outlines on the floor plan, compiled."""

from __future__ import annotations

import math

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import inlined, kernel
from motm_wbc.geometry.prism import LENGTH, NX, NY, UX, UY, X, Y

_SIDE_BY_SIDE = 0.95  # cosine of the angle up to which edges count as facing each other


@kernel
def outline_outline(first: Array, second: Array, out: Array) -> None:
    """Closest points of two convex outlines.

    Where they overlap, the depth is the least translation that parts them: along a normal of
    one of their edges (separating axes; Ericson, Real-Time Collision Detection, 2005, 5.2.1).

    Args:
        first: (n, 7) edges as `prism.outline_edges` makes them.
        second: (m, 7) edges.
        out: (5,) signed distance [m], point of the first x, y [m], unit normal x, y from the
            first to the second, is written.
    """
    out[0] = -math.inf
    beside = _part_along(first, second, 1.0, out, False)
    beside = _part_along(second, first, -1.0, out, beside)
    # a corner beside an edge is as near as the edge's line: nothing is nearer
    if out[0] <= 0.0 or beside:
        return
    out[0] = math.inf
    for i in range(len(first)):
        _near_point(first[i, X], first[i, Y], second, True, out)
    for i in range(len(second)):
        _near_point(second[i, X], second[i, Y], first, False, out)


@kernel
def outline_disc(outline: Array, x: float, y: float, radius: float, out: Array) -> None:
    """Closest points of a convex outline and a disc about (x, y); as `outline_outline`."""
    deepest, edge = -math.inf, 0
    for i in range(len(outline)):
        height = _height(outline[i], x, y)
        if height > deepest:
            deepest, edge = height, i
    if deepest <= 0.0:
        nx, ny = outline[edge, NX], outline[edge, NY]
        out[0], out[1], out[2], out[3], out[4] = deepest - radius, x, y, nx, ny
        out[1], out[2] = x - deepest * nx, y - deepest * ny
        return
    out[0] = math.inf
    _near_point(x, y, outline, False, out)
    out[0] -= radius


@inlined
def _height(edge: Array, x: float, y: float) -> float:
    """How far a point is outside of an edge's line [m]."""
    return float(edge[NX] * (x - edge[X]) + edge[NY] * (y - edge[Y]))


@inlined
def _part_along(own: Array, other: Array, side: float, out: Array, beside: bool) -> bool:
    """Keep the edge of `own` whose normal parts the two best; `side` -1: own is the second.

    Returns whether the nearest corner of `other` lies beside the edge that is kept, between
    its ends; `beside` if none is better than before.
    """
    for i in range(len(own)):
        least, corner = math.inf, 0
        for j in range(len(other)):
            height = _height(own[i], other[j, X], other[j, Y])
            if height < least:
                least, corner = height, j
        if least > out[0]:
            nx, ny = side * own[i, NX], side * own[i, NY]
            x, y = other[corner, X], other[corner, Y]
            along = own[i, UX] * (x - own[i, X]) + own[i, UY] * (y - own[i, Y])
            beside = 0.0 <= along <= own[i, LENGTH]
            if side > 0.0:  # the point of the first is the other's corner, moved onto the edge
                x, y = x - least * nx, y - least * ny
            out[0], out[1], out[2], out[3], out[4] = least, x, y, nx, ny
    return beside


@inlined
def _near_point(x: float, y: float, outline: Array, of_first: bool, out: Array) -> None:
    """Keep the nearest point of an outline to a corner of the other, if it is nearer."""
    for i in range(len(outline)):
        edge = outline[i]
        along = edge[UX] * (x - edge[X]) + edge[UY] * (y - edge[Y])
        along = min(max(along, 0.0), edge[LENGTH])
        px, py = edge[X] + along * edge[UX], edge[Y] + along * edge[UY]
        dx, dy = px - x, py - y
        squared = dx * dx + dy * dy
        if squared < out[0] * out[0]:
            distance = math.sqrt(squared)
            if distance > 0.0:
                nx, ny = dx / distance, dy / distance
            else:
                nx, ny = -edge[NX], -edge[NY]
            if of_first:
                out[0], out[1], out[2], out[3], out[4] = distance, x, y, nx, ny
            else:
                out[0], out[1], out[2], out[3], out[4] = distance, px, py, -nx, -ny


@kernel
def facing_end(first: Array, second: Array, at_low_end: bool, out: Array) -> bool:
    """One end of the stretch over which two outlines face each other edge to edge.

    Where edges lie side by side, the closest points are as good at one end of that stretch as
    at the other, and jump between them with the smallest turn.

    Args:
        first: (n, 7) edges.
        second: (m, 7) edges.
        at_low_end: which end.
        out: (5,) as `outline_outline` has written it; point and distance are overwritten, the
            distance by that along the normal.

    Returns:
        Whether there is such a stretch; else `out` is left as it is.
    """
    nx, ny = out[3], out[4]
    own, other = _edge_along(first, nx, ny), _edge_along(second, -nx, -ny)
    if first[own, NX] * nx + first[own, NY] * ny < _SIDE_BY_SIDE:
        return False
    if -second[other, NX] * nx - second[other, NY] * ny < _SIDE_BY_SIDE:
        return False
    a, b = first[own], second[other]
    a0, a1 = -ny * a[X] + nx * a[Y], a[LENGTH] * (-ny * a[UX] + nx * a[UY])
    b0, b1 = -ny * b[X] + nx * b[Y], b[LENGTH] * (-ny * b[UX] + nx * b[UY])
    low = max(min(a0, a0 + a1), min(b0, b0 + b1))
    high = min(max(a0, a0 + a1), max(b0, b0 + b1))
    if low >= high:
        return False
    place = low if at_low_end else high
    s, t = (place - a0) / a1 * a[LENGTH], (place - b0) / b1 * b[LENGTH]
    out[1], out[2] = a[X] + s * a[UX], a[Y] + s * a[UY]
    x, y = b[X] + t * b[UX] - out[1], b[Y] + t * b[UY] - out[2]
    out[0] = x * nx + y * ny
    return True


@inlined
def _edge_along(outline: Array, nx: float, ny: float) -> int:
    """The edge whose normal points most along a direction."""
    best, most = 0, -math.inf
    for i in range(len(outline)):
        along = outline[i, NX] * nx + outline[i, NY] * ny
        if along > most:
            best, most = i, along
    return best
