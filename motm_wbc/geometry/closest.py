"""Closest points between line segments and upright convex solids, for many pairs at once.

A capsule is a segment with a radius: subtract the radius from the distance. Every function
takes arrays with one pair a row. Where a segment and a solid overlap, the distance is the
penetration depth with a minus sign: the least translation that separates the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry import penetration
from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.upright import UprightCylinders, UprightPrisms
from motm_wbc.geometry.vectors import TINY, TOUCHING, across, dot

_PARALLEL = 1e-12  # squared sine below which two segments count as parallel
_STEEP = 1e300  # stands for a slope that there is not
_NEWTON_STEPS = 60  # each at least halves the bracket; 4 are usual
_NEWTON_TOLERANCE = 1e-8  # of the segment's length; the error left is its square


@dataclass(frozen=True, slots=True)
class ClosestPoints:
    """Closest points of m pairs (segment, other).

    Attributes:
        distance: (m,) [m], negative where they overlap.
        on_segment: (m, 3) point of the segment [m].
        on_other: (m, 3) point of the other body [m]; where they overlap it is `on_segment`
            moved out of the solid by the depth.
        normal: (m, 3) unit vector from the segment to the other body, also where they
            overlap: moving the segment against it increases the distance.
    """

    distance: Array
    on_segment: Array
    on_other: Array
    normal: Array


def segment_segment(a: Array, b: Array, c: Array, d: Array) -> ClosestPoints:
    """Closest points of segments a-b and c-d (Ericson, Real-Time Collision Detection, 5.1.9).

    Segments of no length are legal. The distance is never negative; where two segments
    cross, the normal is square to both.

    Args:
        a: (m, 3) first end of the segment [m].
        b: (m, 3) its second end.
        c: (m, 3) first end of the other segment.
        d: (m, 3) its second end.
    """
    u, v, r = b - a, d - c, a - c
    uu, vv, uv, ur, vr = dot(u, u), dot(v, v), dot(u, v), dot(u, r), dot(v, r)
    determinant = uu * vv - uv * uv
    skew = determinant > _PARALLEL * uu * vv
    s = _unit_interval((uv * vr - ur * vv) * skew / np.where(skew, determinant, 1.0))
    t = _unit_interval((uv * s + vr) / (vv + TINY))
    s = _unit_interval((uv * t - ur) / (uu + TINY))
    points = _separated(a + s[:, None] * u, c + t[:, None] * v)
    crossing = points.distance < TOUCHING
    if crossing.any():
        points.normal[crossing] = across(u[crossing], v[crossing])
    return points


def segment_prism(a: Array, b: Array, prisms: UprightPrisms) -> ClosestPoints:
    """Closest points of segments and upright prisms over convex polygons; boxes are such.

    The squared distance along the segment is convex and piecewise quadratic. It changes its
    piece only where the segment crosses a boundary of the polygon's Voronoi regions or the
    height of a face, so its slope at these points brackets the minimum, and one linear
    interpolation gives it exactly.

    Args:
        a: (m, 3) first end [m].
        b: (m, 3) second end [m].
        prisms: the m solids.
    """
    edges, faces = prisms.edges, prisms.faces
    n = edges.shape[1]
    length = edges[:, :, 6]
    direction = b - a
    x, y = a[:, 0, None] - edges[:, :, 0], a[:, 1, None] - edges[:, :, 1]
    dx, dy, rise = direction[:, 0, None], direction[:, 1, None], direction[:, 2, None]
    # place along each edge and height above it: linear in the segment's parameter
    along = _Linear(
        edges[:, :, 2] * x + edges[:, :, 3] * y, edges[:, :, 2] * dx + edges[:, :, 3] * dy
    )
    above = _Linear(
        edges[:, :, 4] * x + edges[:, :, 5] * y, edges[:, :, 4] * dx + edges[:, :, 5] * dy
    )
    numerator, denominator = np.empty((2, len(a), 3 * n + 2))
    numerator[:, :n], denominator[:, :n] = -above.start, above.rate
    numerator[:, n : 2 * n], denominator[:, n : 2 * n] = -along.start, along.rate
    numerator[:, 2 * n : -2], denominator[:, 2 * n : -2] = length - along.start, along.rate
    numerator[:, -2:], denominator[:, -2:] = faces - a[:, 2, None], rise
    breaks = _breakpoints(numerator, denominator)
    slope = _polygon_slope(breaks, along, above, length)
    slope += _slab_slope(breaks, a[:, 2, None], rise, faces)
    bracket = _bracket(breaks, slope)
    t = bracket.secant()
    on_segment = a + t[:, None] * direction
    points = _separated(on_segment, _nearest_in_prism(on_segment, prisms))
    overlapping = np.nonzero(points.distance < TOUCHING)[0]
    if overlapping.size:
        ends = a[overlapping], b[overlapping]
        depth, outward = penetration.prism_depth(*ends, prisms.take(overlapping))
        _write_overlap(points, overlapping, ends, depth, outward)
    return points


def segment_cylinder(a: Array, b: Array, cylinders: UprightCylinders) -> ClosestPoints:
    """Closest points of segments and upright cylinders.

    The squared distance along the segment is convex. Its slope where the segment crosses the
    cylinder's mantle and the heights of its faces brackets the minimum; a safeguarded Newton
    iteration finds it (beside a rim it is the root of a quartic).

    Args:
        a: (m, 3) first end [m].
        b: (m, 3) second end [m].
        cylinders: the m solids.
    """
    discs, faces = cylinders.discs, cylinders.faces
    direction = b - a
    profile = _CylinderProfile.of(a, direction, cylinders)
    reach = np.sqrt(
        np.maximum(profile.half**2 - profile.dd * (profile.cc - profile.radius**2), 0.0)
    )
    numerator, denominator = np.empty((2, len(a), 5))
    numerator[:, :1], numerator[:, 1:2] = -profile.half, -profile.half - reach
    numerator[:, 2:3], denominator[:, :3] = reach - profile.half, profile.dd
    numerator[:, 3:], denominator[:, 3:] = faces - profile.z, profile.rise
    breaks = _breakpoints(numerator, denominator)
    slope, _ = profile.slope(breaks)
    t = _newton(profile, _bracket(breaks, slope))
    on_segment = a + t[:, None] * direction
    on_other = np.empty_like(on_segment)
    radial = on_segment[:, :2] - discs[:, :2]
    far = np.sqrt(dot(radial, radial))
    inward = np.maximum(1.0 - discs[:, 2] / np.maximum(far, TINY), 0.0)
    on_other[:, :2] = on_segment[:, :2] - inward[:, None] * radial
    on_other[:, 2] = _clamp(on_segment[:, 2], faces[:, 0], faces[:, 1])
    points = _separated(on_segment, on_other)
    overlapping = np.nonzero(points.distance < TOUCHING)[0]
    if overlapping.size:
        ends = a[overlapping], b[overlapping]
        depth, outward = penetration.cylinder_depth(*ends, cylinders.take(overlapping))
        _write_overlap(points, overlapping, ends, depth, outward)
    return points


class _Linear(NamedTuple):
    """Quantities that change linearly along the segment: start + t rate."""

    start: Array
    rate: Array


class _Bracket(NamedTuple):
    """Where the slope changes its sign: (m,) parameters and slopes (<= 0, > 0) there."""

    low: Array
    high: Array
    slope_low: Array
    slope_high: Array

    def secant(self) -> Array:
        """The zero of a slope that is linear inside."""
        share = self.slope_low / (self.slope_low - self.slope_high)
        return np.asarray(self.low + share * (self.high - self.low))


def _unit_interval(values: Array) -> Array:
    return np.asarray(np.minimum(np.maximum(values, 0.0), 1.0))


def _clamp(values: Array, low: Array, high: Array) -> Array:
    return np.asarray(np.minimum(np.maximum(values, low), high))


def _breakpoints(numerator: Array, denominator: Array) -> Array:
    """(m, k + 2) parameters in [0, 1]: both ends, and the quotients, clipped.

    Where a denominator is zero the quotient is some number: one breakpoint too many.
    """
    breaks = np.empty((len(numerator), numerator.shape[1] + 2))
    breaks[:, 0], breaks[:, 1] = 0.0, 1.0
    quotient = numerator / np.where(denominator == 0.0, 1.0, denominator)
    breaks[:, 2:] = _unit_interval(quotient)
    return breaks


def _bracket(breaks: Array, slope: Array) -> _Bracket:
    """The last break with a falling slope and the first with a rising one.

    The slope rises along the segment. Where it never falls or never rises, both ends of the
    bracket are the end of the segment that has the minimum.
    """
    falling = slope <= 0.0
    return _Bracket(
        np.maximum.reduce(np.where(falling, breaks, 0.0), axis=1),
        np.minimum.reduce(np.where(falling, 1.0, breaks), axis=1),
        np.maximum.reduce(np.where(falling, slope, -_STEEP), axis=1),
        np.minimum.reduce(np.where(falling, _STEEP, slope), axis=1),
    )


def _polygon_slope(t: Array, along: _Linear, above: _Linear, length: Array) -> Array:
    """(m, k) half the derivative of the squared distance to the polygon at `t` (m, k)."""
    time = t[:, :, None]
    height = above.start[:, None, :] + time * above.rate[:, None, :]
    over = along.start[:, None, :] + time * along.rate[:, None, :]
    over -= np.minimum(np.maximum(over, 0.0), length[:, None, :])
    nearest = (height * height + over * over).argmin(axis=2)
    slopes = height * above.rate[:, None, :] + over * along.rate[:, None, :]
    rows = np.arange(nearest.size) * length.shape[1]
    slope = slopes.reshape(-1)[rows + nearest.reshape(-1)].reshape(t.shape)
    return np.asarray(slope * (np.maximum.reduce(height, axis=2) > 0.0))


def _slab_slope(t: Array, z: Array, rise: Array, faces: Array) -> Array:
    """(m, k) half the derivative of the squared distance to the heights between the faces."""
    height = z + t * rise
    return np.asarray((height - _clamp(height, faces[:, :1], faces[:, 1:])) * rise)


def _nearest_in_prism(point: Array, prisms: UprightPrisms) -> Array:
    """(m, 3) nearest points of the prisms."""
    edges, faces = prisms.edges, prisms.faces
    x, y = point[:, 0, None] - edges[:, :, 0], point[:, 1, None] - edges[:, :, 1]
    height = edges[:, :, 4] * x + edges[:, :, 5] * y
    along = edges[:, :, 2] * x + edges[:, :, 3] * y
    clipped = _clamp(along, np.zeros(1), edges[:, :, 6])
    over = along - clipped
    rows = np.arange(len(point))
    nearest = (height * height + over * over).argmin(axis=1)
    edge = edges[rows, nearest]
    outside = (np.maximum.reduce(height, axis=1) > 0.0)[:, None]
    on_edge = edge[:, :2] + clipped[rows, nearest][:, None] * edge[:, 2:4]
    result = np.empty_like(point)
    result[:, :2] = np.where(outside, on_edge, point[:, :2])
    result[:, 2] = _clamp(point[:, 2], faces[:, 0], faces[:, 1])
    return result


def _separated(on_segment: Array, on_other: Array) -> ClosestPoints:
    difference = on_other - on_segment
    distance = np.sqrt(dot(difference, difference))
    normal = difference / np.maximum(distance, TINY)[:, None]
    return ClosestPoints(distance, on_segment, on_other, normal)


def _write_overlap(
    points: ClosestPoints,
    rows: IntArray,
    ends: tuple[Array, Array],
    depth: Array,
    outward: Array,
) -> None:
    """Put depth and normal of the overlapping pairs `rows` into `points`.

    The segment's point is its deepest end, or, where it lies square to the way out, the
    point inside that was found.
    """
    tilt = dot(outward, ends[1] - ends[0])
    point = points.on_segment[rows]
    point[tilt > TOUCHING] = ends[0][tilt > TOUCHING]
    point[tilt < -TOUCHING] = ends[1][tilt < -TOUCHING]
    points.distance[rows] = -np.maximum(depth, 0.0)
    points.on_segment[rows] = point
    points.on_other[rows] = point + depth[:, None] * outward
    points.normal[rows] = -outward


class _CylinderProfile(NamedTuple):
    """What the distance of a segment's points from a cylinder depends on, all (m, 1).

    With t along the segment, the squared distance from the axis is cc + 2 half t + dd t^2,
    the height z + rise t.
    """

    cc: Array
    half: Array
    dd: Array
    z: Array
    rise: Array
    radius: Array
    bottom: Array
    top: Array

    @classmethod
    def of(cls, a: Array, direction: Array, cylinders: UprightCylinders) -> _CylinderProfile:
        x, y = a[:, :1] - cylinders.discs[:, :1], a[:, 1:2] - cylinders.discs[:, 1:2]
        dx, dy = direction[:, :1], direction[:, 1:2]
        return cls(
            x * x + y * y,
            x * dx + y * dy,
            dx * dx + dy * dy,
            a[:, 2:],
            direction[:, 2:],
            cylinders.discs[:, 2:],
            cylinders.faces[:, :1],
            cylinders.faces[:, 1:],
        )

    def slope(self, t: Array) -> tuple[Array, Array]:
        """Half the first and second derivative of the squared distance at `t` (m, k)."""
        half = self.half + t * self.dd
        squared = np.maximum(self.cc + t * (half + self.half), TINY)
        out = np.maximum(1.0 - self.radius / np.sqrt(squared), 0.0)
        height = self.z + t * self.rise
        over = height - _clamp(height, self.bottom, self.top)
        slope = half * out + over * self.rise
        turn = np.where(out > 0.0, (1.0 - out) * half * half / squared, 0.0)
        curvature = self.dd * out + turn + (over != 0.0) * self.rise**2
        return slope, curvature


def _newton(profile: _CylinderProfile, bracket: _Bracket) -> Array:
    """(m,) parameter of the minimum: Newton's steps, kept inside a shrinking bracket."""
    low, high, t = bracket.low[:, None], bracket.high[:, None], bracket.secant()[:, None]
    for _ in range(_NEWTON_STEPS):
        slope, curvature = profile.slope(t)
        low, high = np.where(slope <= 0.0, t, low), np.where(slope >= 0.0, t, high)
        step = t - slope / np.maximum(curvature, TINY)
        legal = (step >= low) & (step <= high)
        following = np.where(legal, step, 0.5 * (low + high))
        moved = float(np.abs(following - t).max(initial=0.0))
        t = following
        if moved <= _NEWTON_TOLERANCE:
            break
    return np.asarray(t[:, 0])
