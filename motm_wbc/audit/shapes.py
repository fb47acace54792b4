"""Convex shapes for python-fcl, and bounds that tell cheaply what is far away.

Everything is a box, a cylinder or a convex polyhedron. For these pairs python-fcl 0.7 was
compared with coal: contact or not agreed in 29,000 of 29,000 random pairs, and distances
were never too small and at most 2 mm too large (3 micrometres for the base).
"""

from __future__ import annotations

from dataclasses import dataclass

import fcl
import numpy as np
import trimesh

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.convex_parts import convex_parts
from motm_wbc.kinematics.hulls import prism
from motm_wbc.scene.solids import Solid


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
    """The convex hull of corners (n, 3), each face moved out by at least `skin` [m]."""
    hull = trimesh.convex.convex_hull(corners)
    points = np.asarray(hull.vertices, dtype=float)
    faces = np.asarray(hull.faces)
    if skin > 0.0:
        points = _grown(points, faces, np.asarray(hull.face_normals, dtype=float), skin)
    listed = np.column_stack([np.full(len(faces), 3), faces])
    return fcl.Convex(points, len(faces), listed.ravel())


def _grown(points: Array, faces: Array, normals: Array, skin: float) -> Array:
    """Corners moved so far that every face at them has moved out by at least `skin`."""
    grown = points.copy()
    for index in range(len(points)):
        around = normals[(faces == index).any(axis=1)]
        outward = around.sum(axis=0)
        # Faces that meet at a corner of a convex body all look away from it.
        grown[index] += skin * outward / max(float((around @ outward).min()), 1e-9)
    return grown


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
