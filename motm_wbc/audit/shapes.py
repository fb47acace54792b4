"""Convex shapes for python-fcl, and bounds that tell cheaply what is far away.

Everything is a box, a cylinder or a convex polyhedron. For such pairs python-fcl 0.7 was
compared with coal, without a skin: contact or not agreed in 30,000 of 30,000 random poses;
distances were at most 2 micrometres too small and 2 mm too large (3 micrometres for the base).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import fcl
import numpy as np
import trimesh

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.convex_parts import convex_parts
from motm_wbc.kinematics.hulls import prism
from motm_wbc.scene.solids import Solid

_CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """A sphere that contains a shape.

    Attributes:
        centre: (3,) in the shape's frame [m].
        radius: [m].
    """

    centre: Array
    radius: float

    @staticmethod
    def about(corners: Array) -> Sphere:
        """A sphere about the middle of the corners' (n, 3) bounding box."""
        centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        return Sphere(centre, float(np.linalg.norm(corners - centre, axis=1).max()))


def polyhedron(corners: Array, skin: float = 0.0) -> fcl.CollisionGeometry:
    """The convex hull of corners (n, 3), grown by a skin [m].

    It is grown by the sum with a cube about a ball of that radius: every face moves out by at
    least the skin, those of a box by just the skin, and no point by more than 1.74 times it.
    """
    if skin > 0.0:
        corners = (corners[:, None, :] + skin * _CUBE).reshape(-1, 3)
    hull = trimesh.convex.convex_hull(corners)
    faces = np.asarray(hull.faces)
    listed = np.column_stack([np.full(len(faces), 3), faces])
    return fcl.Convex(np.asarray(hull.vertices, dtype=float), len(faces), listed.ravel())


def solid_geometries(solid: Solid) -> list[fcl.CollisionGeometry]:
    """Shapes about the solid's own centre: one, or the convex parts of a concave prism."""
    if solid.size is not None:
        return [fcl.Box(*solid.size)]
    if solid.radius is not None:
        return [fcl.Cylinder(solid.radius, solid.top)]
    half = 0.5 * solid.top
    parts = convex_parts(solid.outline_in_body())
    return [polyhedron(prism(part, -half, half)) for part in parts]


def solid_corners(solid: Solid) -> Array:
    """(n, 3) corners of a prism about the solid's own centre that contains it [m]."""
    half = 0.5 * solid.top
    return prism(solid.outline_in_body(), -half, half)
