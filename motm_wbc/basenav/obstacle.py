"""Obstacles as users give them: polygons, polygons with holes, discs; at rest or moving."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import Polygon

from motm_wbc.basenav.checks import FARTHEST, checked_velocity, coordinates, positive
from motm_wbc.basenav.form import Form, turned_by
from motm_wbc.basenav.inflation import turning
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

_LEAST_AREA = 1e-9  # [m^2]
_LEAST_WIDTH = 1e-8  # [m] on average; thinner, both sides of it would touch
_SAME_ANGLE = 1e-6  # [rad]
_DISC_SIDES = 32  # the outline lies within 0.5 % of the radius outside of the circle
_AT_REST = (0.0, 0.0)


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
            is not positive, or too small; a velocity is not finite.
    """
    if isinstance(obstacle, Disc):
        return [_round(obstacle, source, where)]
    if not isinstance(obstacle, Obstacle):
        obstacle = Obstacle(obstacle)
    velocity = _frozen(checked_velocity(obstacle.velocity, f"{where}.velocity"))
    if not isinstance(obstacle.holes, Sequence | np.ndarray):
        raise InputError("must be outlines, (n, 2) each", f"{where}.holes")
    if len(obstacle.holes) == 0:
        ring = _convex_ring(coordinates(obstacle.outline, (-1, 2), where))
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


def _round(disc: Disc, source: int, where: str) -> Solid:
    centre = coordinates(disc.centre, (2,), f"{where}.centre")
    radius = positive(disc.radius, f"{where}.radius")
    if not _LEAST_AREA <= math.pi * radius * radius <= FARTHEST * FARTHEST:
        raise InputError(
            f"has no area (less than {_LEAST_AREA:g} m^2), or too large a one, got {radius:g}",
            f"{where}.radius",
        )
    velocity = checked_velocity(disc.velocity, f"{where}.velocity")
    outline = _frozen(centre + polygons.disc(radius, _DISC_SIDES))
    return Solid(Form((outline,)), _AT_ORIGIN, _frozen(velocity), source)


def simple_polygons(points: Array, where: str) -> list[Polygon]:
    """Simple polygons, without holes, that a polygon of the user's consists of.

    Raises:
        InputError: see `solids_of`.
    """
    outline = coordinates(points, (-1, 2), where)
    if len(np.unique(outline, axis=0)) < 3:
        raise InputError("has fewer than three distinct points", where)
    shape = shapely.make_valid(Polygon(outline), method="structure", keep_collapsed=False)
    solid = [Polygon(part.exterior) for part in _solid_parts(shape)]
    if not solid:
        raise InputError(f"has no area (less than {_LEAST_AREA:g} m^2)", where)
    return solid


def _convex_ring(points: Array) -> Array | None:
    """A polygon that turns clearly, and once only: simple, so that nothing is to be made valid.

    Counter-clockwise; None: it is not such a polygon.
    """
    if len(points) < 3:
        return None
    least, most, total = turning(points)
    if abs(abs(total) - math.tau) > _SAME_ANGLE or not _is_solid(Polygon(points)):
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
    return [part for part in parts if _is_solid(part)]


def _is_solid(part: Polygon) -> bool:
    """Whether there is enough of it to be in the way."""
    return bool(part.area >= max(_LEAST_AREA, 0.5 * _LEAST_WIDTH * part.length))


def _area(points: Array) -> float:
    """Signed; far from the origin the products would drown it in rounding."""
    return polygons.signed_area(points - points[0])


def _frozen(points: Array) -> Array:
    points.flags.writeable = False
    return points


_AT_ORIGIN = _frozen(np.zeros(3))
