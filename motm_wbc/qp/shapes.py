"""All solids about the robot as arrays: where they are now, and a first rough distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.upright import UprightCylinders, UprightPrisms
from motm_wbc.qp.bodies import Body

BASE = -1
"""Index that stands for the robot's own base in `SceneShapes.owner`."""


class SceneShapes:
    """The convex parts of all bodies, prisms first, then cylinders; the base is prism 0.

    Attributes:
        bodies: the bodies as last given.
        owner: (s,) index of the body that each part belongs to, `BASE` for the base.
        prism_count: how many of the parts are prisms.
        prisms: the prisms in the world.
        cylinders: the cylinders in the world.
        velocity: (s, 3) velocity of each part's body [m/s, m/s, rad/s].
        centre: (s, 2) what each part's body turns about [m].

    Args:
        footprint: (n, 2) convex outline of the base in the base frame [m].
        base_height: [m].
    """

    def __init__(self, footprint: Array, base_height: float) -> None:
        self._footprint = footprint
        self._base_height = base_height
        self.bodies: tuple[Body, ...] = ()
        self._build(())

    @property
    def finite(self) -> bool:
        """Whether all places and velocities are numbers."""
        return self._finite

    def update(self, bodies: Sequence[Body], base_pose: Array) -> bool:
        """Take over where the bodies and the base are.

        Returns:
            Whether the list of parts is another one than before, not just its places.
        """
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
            self._read_places()
        self._poses[0] = base_pose
        if rebuilt or changed:
            self._place(slice(None))
        else:
            self._place(slice(0, 1))
        return rebuilt

    def gaps(self, centres: Array, radii: Array) -> Array:
        """(k, s) distances [m] of balls from the parts' bounding boxes: never too large."""
        beyond = np.abs(centres[:, None, :] - self._box_centre) - self._box_half
        np.maximum(beyond, 0.0, out=beyond)
        squared = beyond[:, :, 0] ** 2 + beyond[:, :, 1] ** 2 + beyond[:, :, 2] ** 2
        return np.asarray(np.sqrt(squared) - radii[:, None])

    def _build(self, bodies: tuple[Body, ...]) -> None:
        outlines, owner = [self._footprint], [BASE]
        for index, body in enumerate(bodies):
            outlines += body.outlines
            owner += [index] * len(body.outlines)
        round_ones = [index for index, body in enumerate(bodies) if body.radius is not None]
        self.prism_count = len(outlines)
        self.owner = np.array([*owner, *round_ones])
        local = UprightPrisms.stack(outlines, np.zeros((len(outlines), 2)))
        # corner, direction and normal of each edge, one vector a row
        self._local = np.ascontiguousarray(local.edges[:, :, :6]).reshape(len(outlines), -1, 2)
        self.prisms = UprightPrisms(local.edges.copy(), local.faces)
        discs = np.zeros((len(round_ones), 3))
        discs[:, 2] = [bodies[index].radius or 0.0 for index in round_ones]
        self.cylinders = UprightCylinders(discs, np.zeros((len(round_ones), 2)))
        total = len(self.owner)
        self._poses, self.velocity = np.zeros((total, 3)), np.zeros((total, 3))
        self._box_centre, self._box_half = np.zeros((total, 3)), np.zeros((total, 3))
        self.prisms.faces[0] = 0.0, self._base_height
        self._read_places()

    def _read_places(self) -> None:
        for part, index in enumerate(self.owner.tolist()):
            if index == BASE:
                continue
            body = self.bodies[index]
            self._poses[part] = body.pose
            self.velocity[part] = body.velocity
            if part < self.prism_count:
                self.prisms.faces[part] = body.bottom, body.top
            else:
                self.cylinders.faces[part - self.prism_count] = body.bottom, body.top
        self.centre = self._poses[:, :2]
        places = self._poses[1:], self.velocity, self.prisms.faces, self.cylinders.faces
        self._finite = all(bool(np.isfinite(values).all()) for values in places)

    def _place(self, rows: slice) -> None:
        """Put the parts of `rows` where their bodies are; all, or the base alone."""
        world = self.prisms.edges[rows]
        pose = self._poses[: self.prism_count][rows]
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        turn = np.array([[c, s], [-s, c]]).transpose(2, 0, 1)  # for vectors in rows
        world[:, :, :6] = (self._local[rows] @ turn).reshape(len(world), -1, 6)
        world[:, :, :2] += pose[:, None, :2]
        low, high = world[:, :, :2].min(axis=1), world[:, :, :2].max(axis=1)
        centre, half = (
            self._box_centre[: self.prism_count][rows],
            self._box_half[: self.prism_count][rows],
        )
        faces = self.prisms.faces[rows]
        centre[:, :2], half[:, :2] = 0.5 * (low + high), 0.5 * (high - low)
        centre[:, 2], half[:, 2] = faces.mean(axis=1), 0.5 * (faces[:, 1] - faces[:, 0])
        if rows.stop is None and len(self.cylinders.discs):
            self._place_cylinders()

    def _place_cylinders(self) -> None:
        self.cylinders.discs[:, :2] = self._poses[self.prism_count :, :2]
        faces = self.cylinders.faces
        centre, half = self._box_centre[self.prism_count :], self._box_half[self.prism_count :]
        centre[:, :2], half[:, :2] = self.cylinders.discs[:, :2], self.cylinders.discs[:, 2:]
        centre[:, 2], half[:, 2] = faces.mean(axis=1), 0.5 * (faces[:, 1] - faces[:, 0])


def _same_parts(first: Body, second: Body) -> bool:
    return (
        first.name == second.name
        and first.role is second.role
        and first.outlines is second.outlines
        and first.radius == second.radius
    )
