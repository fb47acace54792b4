"""The world that the base moves in: polygons, and what they look like to a disc."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.basenav.checks import FARTHEST, not_negative, number, numbers
from motm_wbc.basenav.floor import Floor
from motm_wbc.basenav.form import Form, turned_by
from motm_wbc.basenav.inflated import Inflated
from motm_wbc.basenav.inflation import OUTER, Box
from motm_wbc.basenav.obstacle import ObstacleLike, Solid, ring_of, simple_polygons, solids_of
from motm_wbc.basenav.outlines import APART, Ellipse, Outlines, ellipse_of, moved, pack
from motm_wbc.basenav.union import united
from motm_wbc.basenav.vicinity import (
    blocked_near,
    box_about,
    relations_grown,
    rounded_up,
)
from motm_wbc.basenav.walls import TOUCH, Indices
from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array

_KEPT_RADII = 8
_KEPT_VICINITIES = 32
_ENDLESS = 1e9  # [m] so far away, there is no telling places apart
_FEW_CORNERS = 128


class World:
    """Obstacles on a floor; immutable: what moves gives a new world.

    Obstacles are open sets: a path may run along an edge. Between two that touch there is
    no passage.

    A new world shares with the one that it comes from what has not changed: the checked
    forms, their inflated outlines (moved rigidly), and those parts of the free space that
    nothing moved in.

    Attributes:
        boundary: (n, 2) outline that the robot must stay in, counter-clockwise, or None.
        velocities: (s, 2) of the solids [m/s].
    """

    def __init__(self, obstacles: Iterable[ObstacleLike], boundary: Array | None = None) -> None:
        """Check and keep the obstacles.

        Args:
            obstacles: arrays (n, 2) [m], any winding, may overlap or be concave; or
                `Obstacle`s with holes and velocity, or `Disc`s.
            boundary: (n, 2) [m] outline of the floor; None: no end to it.

        Raises:
            InputError: a polygon has NaN, fewer than three distinct points or no area, the
                boundary crosses itself, or there is no sequence of obstacles.
        """
        floor = None
        if not isinstance(obstacles, Iterable):
            raise InputError("must be a sequence of polygons, (n, 2) each", "obstacles")
        solids = [
            solid
            for index, obstacle in enumerate(obstacles)
            for solid in solids_of(obstacle, index, f"obstacles[{index}]")
        ]
        if boundary is not None:
            parts = simple_polygons(boundary, "boundary")
            if len(parts) != 1:
                raise InputError("crosses itself; a simple polygon is needed", "boundary")
            floor = Floor(ring_of(parts[0].exterior, counter_clockwise=True))
        self._take(solids, floor)

    def _take(self, solids: Sequence[Solid], floor: Floor | None) -> None:
        forms = tuple(solid.form for solid in solids)
        poses = np.array([solid.pose for solid in solids]).reshape(-1, 3)
        velocities = np.array([solid.velocity for solid in solids]).reshape(-1, 2)
        sources = np.array([solid.source for solid in solids], dtype=np.int64)
        self._set(forms, pack([form.rings for form in forms]), poses, velocities, sources, floor)

    def _set(
        self,
        forms: tuple[Form, ...],
        given: Outlines,
        poses: Array,
        velocities: Array,
        sources: Indices,
        floor: Floor | None,
    ) -> None:
        """All that a world consists of; `given`: the forms' outlines, not moved."""
        for values in (poses, velocities):
            values.flags.writeable = False
        self._forms, self._given, self._poses = forms, given, poses
        self.velocities, self._sources, self._floor = velocities, sources, floor
        self.boundary: Array | None = None if floor is None else floor.boundary
        self._inflated: OrderedDict[float, Inflated] = OrderedDict()
        self._vicinities: OrderedDict[tuple[float, Ellipse], Inflated] = OrderedDict()

    @cached_property
    def solids(self) -> tuple[Solid, ...]:
        """Simple polygons, with holes and velocities."""
        return tuple(
            Solid(form, pose, velocity, int(source))
            for form, pose, velocity, source in zip(
                self._forms, self._poses, self.velocities, self._sources, strict=True
            )
        )

    @cached_property
    def outlines(self) -> Outlines:
        """The solids' rings, packed."""
        return moved(self._given, self._poses)

    @property
    def obstacles(self) -> tuple[Array, ...]:
        """Outlines of the solids, counter-clockwise, without their holes."""
        return tuple(solid.outline for solid in self.solids)

    @property
    def rings(self) -> tuple[Array, ...]:
        """All rings, the boundary's the last one, with what is blocked on their left."""
        rings = tuple(ring for solid in self.solids for ring in solid.rings)
        return rings if self.boundary is None else (*rings, self.boundary[::-1].copy())

    @property
    def bounded(self) -> bool:
        """Whether there is a boundary: then what is in no ring is blocked."""
        return self.boundary is not None

    def with_solids(self, solids: Iterable[Solid]) -> World:
        """The same floor with other solids, which count as checked.

        Those of this world among them keep what was derived of them.
        """
        world = object.__new__(World)
        world._take(tuple(solids), self._floor)
        return world

    def still(self) -> World:
        """The world without what moves."""
        return self.with_solids(solid for solid in self.solids if not solid.moves)

    def after(self, time: float) -> World:
        """The world `time` [s] later, each obstacle having moved with its velocity.

        Raises:
            InputError: the time is not finite, or so long that obstacles are out of the world.
        """
        poses = self._poses.copy()
        poses[:, :2] += number(time, "time") * self.velocities
        return self._at(poses, "time")

    def transformed(self, transforms: Array) -> World:
        """The world with each obstacle moved rigidly.

        Args:
            transforms: (k, 3) for each obstacle that the world was made of: x, y [m] and
                angle [rad] by which its points are turned about the origin, then shifted.

        Raises:
            InputError: there are not as many transforms as obstacles, one is not finite, or
                moves what it moves out of the world.
        """
        ways = numbers(transforms, (1 + int(self._sources.max(initial=-1)), 3), "transforms")
        return self._at(turned_by(self._poses, ways[self._sources]), "transforms")

    def _at(self, poses: Array, where: str) -> World:
        """The same solids at other poses (s, 3); `where`: what moves them."""
        if not np.abs(poses).max(initial=0.0) <= FARTHEST:
            raise InputError(f"must be finite, and move by at most {FARTHEST:g} m", where)
        world = object.__new__(World)
        world._set(self._forms, self._given, poses, self.velocities, self._sources, self._floor)
        changed = (poses != self._poses).any(axis=1)
        if not changed.any():
            world._inflated.update(self._inflated)
        for (radius, ellipse), vicinity in self._vicinities.items():
            if (vicinity.members & changed).any():
                continue
            now = relations_grown(world.outlines, ellipse, radius) != APART
            if not (now & changed).any():
                world._vicinities[radius, ellipse] = vicinity
        return world

    @cached_property
    def _is_small(self) -> bool:
        """The whole world is derived as quickly as a part of it."""
        floor = 0 if self.boundary is None else len(self.boundary)
        return len(self._given.points) + floor <= _FEW_CORNERS

    @cached_property
    def _extent(self) -> tuple[float, float, float, float]:
        """X and y of the lower, then of the upper bound of all that there is [m]."""
        boxes = self.outlines.box
        if self._floor is not None:
            boxes = np.vstack([boxes, self._floor.box])
        low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def near(self, radius: float, first: Array, second: Array, length: float) -> Inflated:
        """The free space as far as paths of a length between two places are concerned.

        What doesn't meet the ellipse |p - first| + |p - second| <= length is left out, and
        outlines of many corners are cut to a box about it. All paths of that length lie in
        the ellipse, where nothing is missing; nowhere is more blocked than in the whole
        world. So the optimum found here is a lower bound, and if it is not longer than
        `length` it is the whole world's optimum; a place that can't be reached here (and
        was not pushed out to a point outside of the ellipse) can't be reached at all. A place
        inside an inflated outline is pushed to the same point as in the whole world if that
        lies in the ellipse; but whether the goal can be reached from there, or the place has
        to be pushed elsewhere, is only known if the path from there lies in it too. For a
        ring of places of radius r about the second one, ask for the longest path plus r.

        The ellipse is widened to one of a grid, so that a robot that moves a little is given
        the same object, kept, in which all that was derived is still valid. Ask for lengths
        out of a few: each different one, like each cell of the grid, is another object. It
        is the whole world's where that is as quick.

        Args:
            radius: of the disc [m].
            first: (2,) [m].
            second: (2,) [m].
            length: [m].

        Raises:
            InputError: the radius is negative or not finite.
        """
        radius = checked_radius(radius)
        asked = ellipse_of(first, second, length)
        if self._is_small or not max(map(abs, asked)) < _ENDLESS:
            return self.inflated(radius)
        ellipse = rounded_up(asked)
        key = (radius, ellipse)
        if key in self._vicinities:
            self._vicinities.move_to_end(key)
            return self._vicinities[key]
        if self._lies_in(ellipse, radius):
            return self.inflated(radius)
        self._vicinities[key] = self._vicinity(ellipse, radius)
        if len(self._vicinities) > _KEPT_VICINITIES:
            self._vicinities.popitem(last=False)
        return self._vicinities[key]

    def _vicinity(self, ellipse: Ellipse, radius: float) -> Inflated:
        members = relations_grown(self.outlines, ellipse, radius) != APART
        parts = self._blocked(np.flatnonzero(members), radius, box_about(ellipse))
        if self._floor is not None:
            parts += self._floor.blocked_near(ellipse, radius)
        return Inflated(radius, united(parts), False, members, ellipse)

    def inflated(self, radius: float) -> Inflated:
        """The free space of a disc's centre everywhere, kept for the next call.

        Args:
            radius: of the disc, >= 0 [m].

        Raises:
            InputError: the radius is negative or not finite.
        """
        radius = checked_radius(radius)
        if radius not in self._inflated:
            if len(self._inflated) >= _KEPT_RADII:
                self._inflated.popitem(last=False)
            self._inflated[radius] = self._all(radius)
        return self._inflated[radius]

    def _all(self, radius: float) -> Inflated:
        members = np.ones(len(self._forms), dtype=bool)
        blocked = self._blocked(np.flatnonzero(members), radius, None)
        if self._floor is None:
            return Inflated(radius, united(blocked), False, members)
        free = united(self._floor.free(radius), without=blocked)
        return Inflated(radius, free, True, members)

    def _blocked(self, chosen: Indices, radius: float, clip: Box | None) -> list[Polygon]:
        return blocked_near(self._forms, self._poses, self.outlines, chosen, radius, clip)

    def _lies_in(self, ellipse: Ellipse, radius: float) -> bool:
        """Whether all that there is, inflated, lies in an ellipse."""
        x0, y0, x1, y1 = self._extent
        apart = max(ellipse.sum_to(x, y) for x in (x0, x1) for y in (y0, y1))
        return apart + 4.0 * OUTER * radius <= ellipse.length


def checked_radius(radius: float) -> float:
    """A radius to inflate by [m]; one below `TOUCH` is none.

    Raises:
        InputError: it is negative or not finite.
    """
    given = not_negative(radius, "inflation")
    return given if given > TOUCH else 0.0
