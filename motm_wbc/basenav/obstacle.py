"""Obstacles as users give them: polygons, polygons with holes, discs; at rest or moving."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import Polygon

from motm_wbc.basenav.form import Form, turned_by
from motm_wbc.basenav.inflation import turning
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

_LEAST_AREA = 1e-9  # [m^2]
_SAME_ANGLE = 1e-6  # [rad]
_DISC_SIDES = 32  # the outline lies within 0.5 % of the radius outside of the circle
_AT_REST = (0.0, 0.0)

FARTHEST = 1e7
"""No coordinate may be larger [m]: beyond, doubles are coarser than what counts as touching."""


@dataclass(frozen=True)
class Obstacle:
    """A polygon that blocks the base.

    Attributes:
        outline: (n, 2) [m], any winding, may be concave.
        holes: outlines (n, 2) of what is free inside of it [m].
        velocity: (2,) in world axes, constant [m/s].
    """

    outline: Array
    holes: tuple[Array, ...] = ()
    velocity: Array | tuple[float, float] = _AT_REST


@dataclass(frozen=True)
class Disc:
    """A round obstacle; it counts as the regular polygon that its circle is inscribed in.

    Attributes:
        centre: (2,) [m].
        radius: > 0 [m].
        velocity: (2,) in world axes, constant [m/s].
    """

    centre: Array | tuple[float, float]
    radius: float
    velocity: Array | tuple[float, float] = _AT_REST


ObstacleLike: TypeAlias = Array | Obstacle | Disc


class Solid:
    """A simple polygon that blocks the base, checked; one obstacle may consist of several.

    Immutable. Where it has moved to is worked out when it is asked for.

    Attributes:
        form: its shape, where it was given, shared with the same solid elsewhere.
        pose: (3,) by which it was moved since, about the world's origin [m], [rad].
        velocity: (2,) [m/s].
        source: number of the obstacle that it is part of.
    """

    def __init__(self, form: Form, pose: Array, velocity: Array, source: int) -> None:
        self.form = form
        self.pose = pose
        self.velocity = velocity
        self.source = source

    @cached_property
    def rings(self) -> tuple[Array, ...]:
        """Outline and holes (n, 2) each [m], with what is blocked on their left."""
        return self.form.rings_at(self.pose)

    @property
    def outline(self) -> Array:
        """(n, 2) counter-clockwise [m]."""
        return self.rings[0]

    @property
    def holes(self) -> tuple[Array, ...]:
        """(n, 2) each, clockwise [m]."""
        return self.rings[1:]

    @property
    def moves(self) -> bool:
        """Whether it has a velocity."""
        return bool(self.velocity.any())

    def transformed(self, transform: Array) -> Solid:
        """Moved rigidly by (3,) x, y [m], angle [rad], about the world's origin.

        The velocity, in world axes, stays.
        """
        pose = _frozen(turned_by(self.pose[None], np.asarray(transform, dtype=float)[None])[0])
        return Solid(self.form, pose, self.velocity, self.source)


def solids_of(obstacle: ObstacleLike, source: int, where: str) -> list[Solid]:
    """The simple polygons that an obstacle consists of.

    A polygon that crosses itself counts with all that it encloses and may become several.

    Args:
        obstacle: as the user gave it.
        source: its number.
        where: its name in messages.

    Raises:
        InputError: a polygon has NaN, fewer than three distinct points or no area; a radius
            is not positive; a velocity is not finite.
    """
    if isinstance(obstacle, Disc):
        centre = _vector(obstacle.centre, f"{where}.centre")
        if not (np.isfinite(obstacle.radius) and obstacle.radius > 0.0):
            raise InputError(
                f"must be a finite number > 0, got {obstacle.radius}", f"{where}.radius"
            )
        outline = centre + polygons.disc(float(obstacle.radius), _DISC_SIDES)
        velocity = _vector(obstacle.velocity, f"{where}.velocity")
        return [Solid(Form((_frozen(outline),)), _AT_ORIGIN, _frozen(velocity), source)]
    if not isinstance(obstacle, Obstacle):
        obstacle = Obstacle(obstacle)
    velocity = _frozen(_vector(obstacle.velocity, f"{where}.velocity"))
    if len(obstacle.holes) == 0:
        ring = _convex_ring(_points(obstacle.outline, where))
        if ring is not None:
            return [Solid(Form((ring,)), _AT_ORIGIN, velocity, source)]
    parts = simple_polygons(obstacle.outline, where)
    holes = [
        hole
        for index, points in enumerate(obstacle.holes)
        for hole in simple_polygons(points, f"{where}.holes[{index}]")
    ]
    if holes:
        cut = shapely.difference(shapely.MultiPolygon(parts), shapely.union_all(holes))
        parts = _solid_parts(cut)
        if not parts:
            raise InputError("leave nothing of the obstacle", f"{where}.holes")
    return [_solid(part, velocity, source) for part in parts]


def simple_polygons(points: Array, where: str) -> list[Polygon]:
    """Simple polygons, without holes, that a polygon of the user's consists of.

    Raises:
        InputError: see `solids_of`.
    """
    outline = _points(points, where)
    if len(np.unique(outline, axis=0)) < 3:
        raise InputError("has fewer than three distinct points", where)
    shape = shapely.make_valid(Polygon(outline), method="structure", keep_collapsed=False)
    solid = [Polygon(part.exterior) for part in _solid_parts(shape)]
    if not solid:
        raise InputError(f"has no area (less than {_LEAST_AREA:g} m^2)", where)
    return solid


def _points(points: Array, where: str) -> Array:
    try:
        outline = np.array(points, dtype=float, order="C")
    except (TypeError, ValueError):
        raise InputError("must be numbers, an array of shape (n, 2)", where) from None
    if outline.ndim != 2 or outline.shape[1] != 2:
        raise InputError(f"must have shape (n, 2), got {outline.shape}", where)
    if not np.isfinite(outline).all():
        raise InputError("has a coordinate that is NaN or infinite", where)
    if np.abs(outline).max(initial=0.0) > FARTHEST:
        raise InputError(f"has a coordinate beyond {FARTHEST:g} m", where)
    return outline


def _convex_ring(points: Array) -> Array | None:
    """A polygon that turns clearly, and once only: simple, so that nothing is to be made valid.

    Counter-clockwise; None: it is not such a polygon.
    """
    if len(points) < 3:
        return None
    least, most, total = turning(points)
    if abs(abs(total) - math.tau) > _SAME_ANGLE or abs(_area(points)) < _LEAST_AREA:
        return None
    if least > _SAME_ANGLE:
        return _frozen(points)
    return _frozen(points[::-1].copy()) if most < -_SAME_ANGLE else None


def ring_of(line: shapely.LinearRing, counter_clockwise: bool) -> Array:
    """The distinct points of a ring, as an array that can't be written to."""
    points = np.array(line.coords)[:-1]
    points = points[np.any(points != np.roll(points, 1, axis=0), axis=1)]
    if (_area(points) > 0.0) != counter_clockwise:
        points = points[::-1].copy()
    return _frozen(points)


def _solid(polygon: Polygon, velocity: Array, source: int) -> Solid:
    holes = tuple(ring_of(line, counter_clockwise=False) for line in polygon.interiors)
    outline = ring_of(polygon.exterior, counter_clockwise=True)
    return Solid(Form((outline, *holes)), _AT_ORIGIN, velocity, source)


def _solid_parts(shape: shapely.Geometry) -> list[Polygon]:
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    return [part for part in parts if part.area >= _LEAST_AREA]


def _area(points: Array) -> float:
    """Signed; far from the origin the products would drown it in rounding."""
    return polygons.signed_area(points - points[0])


def _vector(values: Array | tuple[float, float], where: str) -> Array:
    try:
        vector = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError("must be two numbers", where) from None
    if vector.shape != (2,) or not np.isfinite(vector).all():
        raise InputError("must be two finite numbers", where)
    return vector


def _frozen(points: Array) -> Array:
    points.flags.writeable = False
    return points


_AT_ORIGIN = _frozen(np.zeros(3))
