"""All solids about the robot as arrays: where they are now, and the boxes that hold them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import inlined
from motm_wbc.geometry.prism import UX, UY, outline_edges, place_edges
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp.bodies import Body

_FLAT = 1e-9  # sine of an angle that counts as none
BASE = -1
"""Index that stands for the robot's own base in `SceneShapes.owner`."""


class SceneArrays(NamedTuple):
    """Convex upright solids, s of them; solid 0 is the robot's base.

    Attributes:
        first_edge: (s + 1,) where the edges of each prism begin; a cylinder has none.
        local_edges: (e, 7) edges of all prisms in their bodies' frames, as `outline_edges`.
        edges: (e, 7) the same in the world.
        radius: (s,) of cylinders [m]; zero for prisms.
        faces: (s, 2) heights of the lower and upper faces [m].
        poses: (s, 3) of the solids' bodies in the world [m, m, rad].
        velocity: (s, 3) of the solids' bodies in world axes [m/s, m/s, rad/s].
        box_low: (s, 3) least corner of the axis-aligned box about each solid [m].
        box_high: (s, 3) its largest corner [m].
    """

    first_edge: IntArray
    local_edges: Array
    edges: Array
    radius: Array
    faces: Array
    poses: Array
    velocity: Array
    box_low: Array
    box_high: Array


@inlined
def place_solids(scene: SceneArrays, begin: int, end: int) -> None:
    """Put the solids from `begin` to before `end` where `scene.poses` says."""
    for k in range(begin, end):
        x, y, yaw = scene.poses[k, 0], scene.poses[k, 1], scene.poses[k, 2]
        low, high = scene.box_low[k], scene.box_high[k]
        low[2], high[2] = scene.faces[k, 0], scene.faces[k, 1]
        first, last = scene.first_edge[k], scene.first_edge[k + 1]
        reach = scene.radius[k]
        low[0], low[1], high[0], high[1] = x - reach, y - reach, x + reach, y + reach
        if first == last:
            continue
        place_edges(scene.local_edges[first:last], x, y, yaw, scene.edges[first:last])
        low[0], low[1] = scene.edges[first, 0], scene.edges[first, 1]
        high[0], high[1] = low[0], low[1]
        for e in range(first + 1, last):
            corner = scene.edges[e]
            low[0], high[0] = min(low[0], corner[0]), max(high[0], corner[0])
            low[1], high[1] = min(low[1], corner[1]), max(high[1], corner[1])


class SceneShapes:
    """The convex parts of all bodies; the base is part 0.

    Attributes:
        bodies: the bodies as last given.
        owner: (s,) index of the body that each part belongs to, `BASE` for the base.
        arrays: the parts; the base's pose is for others to write.
        finite: whether all places and velocities are numbers.

    Args:
        footprint: (n, 2) convex outline of the base in the base frame [m].
        base_height: [m].
    """

    def __init__(self, footprint: Array, base_height: float) -> None:
        self._footprint = footprint
        self._base_height = base_height
        self.bodies: Sequence[Body] = ()
        self._build(())

    def update(self, bodies: Sequence[Body]) -> bool:
        """Take over where the bodies are. Bodies that did not move shall be the same instances.

        Returns:
            Whether the list of parts is another one than before, not just its places.
        """
        if bodies is self.bodies and isinstance(bodies, tuple):
            return False
        current = tuple(bodies)
        changed = [
            i for i, (b, k) in enumerate(zip(current, self.bodies, strict=False)) if b is not k
        ]
        rebuilt = len(current) != len(self.bodies) or any(
            not _same_parts(current[i], self.bodies[i]) for i in changed
        )
        self.bodies = current
        if rebuilt:
            self._build(current)
        elif changed:
            self._read_places(changed)
        return rebuilt

    def _build(self, bodies: tuple[Body, ...]) -> None:
        for body in bodies:
            _check_shape(body)
        outlines: list[Array | None] = [self._footprint]
        owner = [BASE]
        self._parts: list[slice] = []
        for index, body in enumerate(bodies):
            parts = [None] if body.radius is not None else list(body.outlines)
            self._parts.append(slice(len(owner), len(owner) + len(parts)))
            outlines += parts
            owner += [index] * len(parts)
        self.owner = np.array(owner)
        edges = [
            np.empty((0, 7)) if outline is None else outline_edges(outline) for outline in outlines
        ]
        local, count = np.concatenate(edges), len(owner)
        self.arrays = SceneArrays(
            first_edge=np.cumsum([0, *(len(part) for part in edges)]),
            local_edges=local,
            edges=local.copy(),
            radius=np.array([0.0 if i == BASE else bodies[i].radius or 0.0 for i in owner]),
            faces=np.tile([0.0, self._base_height], (count, 1)),
            poses=np.zeros((count, 3)),
            velocity=np.zeros((count, 3)),
            box_low=np.zeros((count, 3)),
            box_high=np.zeros((count, 3)),
        )
        self._read_places(range(len(bodies)))

    def _read_places(self, changed: Sequence[int]) -> None:
        arrays = self.arrays
        for index in changed:
            body, parts = self.bodies[index], self._parts[index]
            if np.shape(body.pose) != (3,) or np.shape(body.velocity) != (3,):
                raise InputError("pose and velocity must have three numbers", f"body {body.name!r}")
            if body.bottom > body.top:
                raise InputError("its bottom is above its top", f"body {body.name!r}")
            arrays.poses[parts] = body.pose
            arrays.velocity[parts] = body.velocity
            arrays.faces[parts] = body.bottom, body.top
            place_solids(arrays, parts.start, parts.stop)
        places = arrays.poses[1:], arrays.velocity, arrays.faces
        self.finite = all(bool(np.isfinite(values).all()) for values in places)


def _check_shape(body: Body) -> None:
    """Make sure that a body has a shape that distances can be measured to.

    Raises:
        InputError: it has not, or it is of no role.
    """
    where = f"body {body.name!r}"
    if not isinstance(body.role, SolidRole):
        raise InputError(f"its role is {body.role!r}, must be a SolidRole", where)
    if body.radius is not None:
        if not 0.0 <= body.radius < math.inf:
            raise InputError(f"its radius is {body.radius}, must be a length", where)
        return
    if not body.outlines:
        raise InputError("has neither an outline nor a radius", where)
    for outline in body.outlines:
        corners = np.asarray(outline, dtype=float)
        if not np.isfinite(corners).all():
            raise InputError("a corner of its outline is not finite", where)
        edges = outline_edges(corners)
        following = np.roll(edges, -1, axis=0)
        turns = edges[:, UX] * following[:, UY] - edges[:, UY] * following[:, UX]
        if turns.min() < -_FLAT or turns.max() < _FLAT:
            raise InputError("its outlines must be convex and counter-clockwise", where)


def _same_parts(first: Body, second: Body) -> bool:
    return (
        first.name == second.name
        and first.role is second.role
        and first.outlines is second.outlines
        and first.radius == second.radius
    )
