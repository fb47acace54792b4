"""Shapes of the objects that can be picked, as far as grasping and pushing need them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.solids import Object


@dataclass(frozen=True, slots=True)
class ObjectShape:
    """An upright prism about its own centre.

    Attributes:
        outline: (n, 2) counter-clockwise outline of the base area [m].
        height: [m].
        grasp_height: height of the grasp above the centre [m].
        radius: of a sphere about the centre that contains it [m].
    """

    outline: Array
    height: float
    grasp_height: float
    radius: float

    @staticmethod
    def of(thing: Object) -> ObjectShape:
        """The shape of an object of the scene."""
        outline = thing.outline_in_body()
        reach = float(np.hypot(outline[:, 0], outline[:, 1]).max())
        radius = math.hypot(reach, 0.5 * thing.top)
        return ObjectShape(outline, thing.top, thing.grasp_height, radius)

    def grasp_point(self, T_world_object: Array) -> Array:
        """(3,) point where the tool's origin has to be [m]."""
        return np.asarray(T_world_object[:3, 3] + self.grasp_height * T_world_object[:3, 2])

    def width(self, T_world_object: Array, axis: Array) -> float:
        """Extent of the base area along a world direction (3,), made horizontal [m]."""
        along = T_world_object[:3, :2].T @ axis
        size = float(np.linalg.norm(along))
        if size < 1e-6:  # the fingers close along the object's own axis
            return self.height
        shadows = self.outline @ (along / size)
        return float(shadows.max() - shadows.min())

    def outline_in_world(self, T_world_object: Array) -> Array:
        """(n, 2) outline seen from above, of an object that stands upright [m]."""
        return np.asarray(self.outline @ T_world_object[:2, :2].T + T_world_object[:2, 3])

    def bounds(self, T_world_object: Array) -> tuple[Array, Array]:
        """Lower and upper corner (3,) of an upright object's box in world axes [m]."""
        outline = self.outline_in_world(T_world_object)
        half, z = 0.5 * self.height, T_world_object[2, 3]
        return (
            np.array([*outline.min(axis=0), z - half]),
            np.array([*outline.max(axis=0), z + half]),
        )
