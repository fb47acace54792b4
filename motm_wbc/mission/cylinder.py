"""Cylinder coordinates about the arm's base: radius, bearing, height.

A straight reach in the world leads over the robot's own shoulder when the target lies
behind; in these coordinates the arm turns about its base, as it is built to do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array

_AXIS_RADIUS = 0.05  # [m] closer to the axis a bearing's rate has no bound


@dataclass(frozen=True, slots=True)
class CylinderPoint:
    """A point and its rates in the arm base's frame, which moves with the base.

    Attributes:
        radius: distance from the arm base's vertical axis [m].
        bearing: angle from the base's heading, in [-pi, pi] [rad].
        height: in the world [m].
        radius_rate: [m/s].
        bearing_rate: [rad/s].
        height_rate: [m/s].
    """

    radius: float
    bearing: float
    height: float
    radius_rate: float
    bearing_rate: float
    height_rate: float


def arm_base_position(base_pose: Array, arm_xy: Array) -> Array:
    """(2,) position of the arm's base axis in the world [m]."""
    c, s = math.cos(base_pose[2]), math.sin(base_pose[2])
    return np.array(
        [
            base_pose[0] + c * arm_xy[0] - s * arm_xy[1],
            base_pose[1] + s * arm_xy[0] + c * arm_xy[1],
        ]
    )


def as_cylinder(
    point: Array, velocity: Array, base_pose: Array, base_twist: Array, arm_xy: Array
) -> CylinderPoint:
    """A world point in cylinder coordinates of the arm's base.

    Args:
        point: (3,) in the world [m].
        velocity: (3,) in the world [m/s].
        base_pose: (3,) x, y, heading.
        base_twist: (3,) v_x, v_y [m/s] in the base frame and omega [rad/s].
        arm_xy: (2,) the arm's base axis in the base frame [m].
    """
    heading, omega = base_pose[2], base_twist[2]
    c, s = math.cos(heading), math.sin(heading)
    centre = arm_base_position(base_pose, arm_xy)
    dx, dy = point[0] - centre[0], point[1] - centre[1]
    vx_arm = base_twist[0] - omega * arm_xy[1]
    vy_arm = base_twist[1] + omega * arm_xy[0]
    ux = velocity[0] - (c * vx_arm - s * vy_arm)
    uy = velocity[1] - (s * vx_arm + c * vy_arm)
    radius = math.hypot(dx, dy)
    safe = max(radius, _AXIS_RADIUS)
    return CylinderPoint(
        radius=radius,
        bearing=math.atan2(c * dy - s * dx, c * dx + s * dy),
        height=float(point[2]),
        radius_rate=(dx * ux + dy * uy) / safe,
        bearing_rate=(dx * uy - dy * ux) / safe**2 - omega,
        height_rate=float(velocity[2]),
    )


def relative_velocity(
    tool_xy: Array, centre: Array, radius_rate: float, bearing_rate: float, height_rate: float
) -> Array:
    """(3,) world-axes velocity, relative to the moving arm base, of given rates at the tool."""
    dx, dy = tool_xy[0] - centre[0], tool_xy[1] - centre[1]
    radius = max(math.hypot(dx, dy), _AXIS_RADIUS)
    ex, ey = dx / radius, dy / radius
    across = radius * bearing_rate
    return np.array([ex * radius_rate - ey * across, ey * radius_rate + ex * across, height_rate])


def carried_velocity(point: Array, base_pose: Array, base_twist: Array) -> Array:
    """(3,) world velocity of a world point that is fixed to the base [m/s]."""
    c, s = math.cos(base_pose[2]), math.sin(base_pose[2])
    vx, vy, omega = base_twist
    dx, dy = point[0] - base_pose[0], point[1] - base_pose[1]
    return np.array([c * vx - s * vy - omega * dy, s * vx + c * vy + omega * dx, 0.0])
