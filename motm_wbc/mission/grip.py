"""The grip frame, and the yaws at which an object can be gripped from above.

Grip frame: z is the direction of approach, y the one along which the fingers close.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely.geometry import Polygon

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotDescription
from motm_wbc.scene.solids import Object

_CLEARANCE = 0.01  # [m] that an open gripper is wider than what it goes about


def grip_in_tool(description: RobotDescription) -> Array:
    """(3, 3) R_tool_grip: columns x, y, z of the grip frame in the tool frame."""
    z = np.array(description.tool.approach_axis)
    y = np.array(description.tool.closing_axis)
    return np.column_stack([np.cross(y, z), y, z])


def grasp_yaws(thing: Object, max_width: float) -> tuple[float, ...]:
    """Yaws of the grip frame, relative to the object, at which the fingers fit about it.

    Args:
        thing: the object.
        max_width: opening of the gripper [m].

    Returns:
        Yaws in [0, 2 pi) [rad]; empty for a round object, which any yaw fits.

    Raises:
        InputError: the object is too wide for the gripper.
    """
    usable = max_width - _CLEARANCE
    if thing.radius is not None:
        if 2.0 * thing.radius > usable:
            raise InputError(_too_wide(2.0 * thing.radius, usable), f"object {thing.name!r}")
        return ()
    axis, along, across = _principal_rectangle(thing.outline_in_body())
    yaws: list[float] = []
    # Fingers close along y of the grip frame, a quarter turn behind its x in the world.
    if along <= usable:
        yaws += [axis + 0.5 * math.pi, axis - 0.5 * math.pi]
    if across <= usable:
        yaws += [axis, axis + math.pi]
    if not yaws:
        raise InputError(_too_wide(min(along, across), usable), f"object {thing.name!r}")
    return tuple(sorted(yaw % math.tau for yaw in yaws))


def _too_wide(width: float, usable: float) -> str:
    return f"is {width:.3f} m wide at its narrowest, the gripper takes at most {usable:.3f} m"


def _principal_rectangle(outline: Array) -> tuple[float, float, float]:
    """Direction of the first side [rad], length and width of the least rectangle about it."""
    corners = shapely.get_coordinates(Polygon(outline).minimum_rotated_rectangle)
    first, second = corners[1] - corners[0], corners[2] - corners[1]
    return (
        math.atan2(first[1], first[0]),
        float(np.hypot(*first)),
        float(np.hypot(*second)),
    )
