"""Solids that stand on the floor: boxes, upright cylinders, polygon prisms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator
from shapely import get_coordinates
from shapely.geometry import Polygon

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.files import Data

_WORLD_SIZE = 1000.0  # [m]; a coordinate beyond is a slip of unit
_OUTLINE_SIDES = 32
_GRASP_DEPTH = 0.015  # [m] from the top of an object down to where it is gripped


def _inside_world(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(abs(value) > _WORLD_SIZE for value in values):
        raise ValueError(f"coordinates are metres, at most {_WORLD_SIZE:g} from the origin")
    return values


def require_simple(outline: Sequence[tuple[float, float]], key: str) -> None:
    """Refuse what is no simple polygon with an area.

    Raises:
        ValueError: names the key.
    """
    shape = Polygon(outline) if len(outline) >= 3 else None
    if shape is None or not shape.is_valid or shape.area < 1e-9:
        raise ValueError(f"{key} must be a simple polygon with an area, of three points or more")


Length = Annotated[float, Field(gt=0.0, le=_WORLD_SIZE)]
Point = Annotated[tuple[float, float], AfterValidator(_inside_world)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Solid(Data):
    """A body with a flat bottom: an obstacle, a table, an object.

    Which of the keys are needed depends on `shape`: `box` has `size`; `cylinder` has
    `radius` and `height`; `prism` has `outline` and `height`.
    """

    name: Name
    """Unique in its scene."""
    shape: Literal["box", "cylinder", "prism"]
    """`box`, `cylinder` (upright) or `prism` (upright, over any simple polygon)."""
    size: tuple[Length, Length, Length] | None = None
    """Length, width and height of a box [m]."""
    radius: Length | None = None
    """Radius of a cylinder [m]."""
    height: Length | None = None
    """Height of a cylinder or prism [m]."""
    outline: tuple[Point, ...] | None = None
    """Corners of a prism about its position [m], any winding, not self-crossing."""
    position: Point = (0.0, 0.0)
    """Centre of the base area in the world [m]."""
    yaw: float = 0.0
    """Rotation about the vertical [rad]."""

    @model_validator(mode="after")
    def _has_its_keys(self) -> Solid:
        needed = {
            "box": {"size"},
            "cylinder": {"radius", "height"},
            "prism": {"outline", "height"},
        }[self.shape]
        given = {
            key for key in ("size", "radius", "height", "outline") if getattr(self, key) is not None
        }
        if given != needed:
            raise ValueError(
                f"a {self.shape} has the keys {' and '.join(sorted(needed))}, "
                f"got {' and '.join(sorted(given)) or 'none of them'}"
            )
        if self.outline is not None:
            require_simple(self.outline, "outline")
        return self

    @property
    def top(self) -> float:
        """Height of the solid [m]."""
        if self.size is not None:
            return self.size[2]
        assert self.height is not None
        return self.height

    @property
    def pose(self) -> Array:
        """(3,) x [m], y [m], yaw [rad] in the world."""
        return np.array([*self.position, self.yaw])

    def outline_in_body(self) -> Array:
        """(n, 2) counter-clockwise outline about the solid's own origin [m].

        A cylinder's is a polygon that contains its circle.
        """
        if self.size is not None:
            return polygons.rectangle(self.size[0], self.size[1])
        if self.radius is not None:
            return polygons.disc(self.radius, _OUTLINE_SIDES)
        return polygons.counter_clockwise(np.array(self.outline, dtype=float))

    def footprint(self) -> Array:
        """(n, 2) counter-clockwise outline in the world [m]."""
        return polygons.place(self.outline_in_body(), self.pose)


class Obstacle(Solid):
    """A solid that nothing may touch; it may move at constant velocity."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity in world axes (m/s, m/s, rad/s)."""


class Support(Solid):
    """A table or tray: an obstacle on whose top objects rest."""


class Object(Solid):
    """A body that can be picked: rests on a support at the start."""

    on: Name
    """Name of the support that it stands on."""
    mass: Annotated[float, Field(gt=0.0, le=50.0)] = 0.2
    """[kg]."""
    friction: Annotated[float, Field(gt=0.0, le=5.0)] = 0.8
    """Coefficient of friction against fingers and supports."""

    @property
    def narrowest(self) -> float:
        """Least width, seen from above [m]."""
        if self.radius is not None:
            return 2.0 * self.radius
        corners = get_coordinates(Polygon(self.outline_in_body()).minimum_rotated_rectangle)
        return float(np.hypot(*np.diff(corners, axis=0).T).min())

    @property
    def grasp_height(self) -> float:
        """Height of the grasp above the object's centre [m]: near the top of tall objects."""
        return max(0.0, 0.5 * self.top - _GRASP_DEPTH)
