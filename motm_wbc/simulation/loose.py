"""Objects that nobody holds, without a physics engine: they rest, fall, slide and are pushed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely

from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.scenario import Scenario, upright_pose
from motm_wbc.simulation.bodies import ObjectShape

_STEP_UP = 0.01  # [m] below a top from which an object still comes to rest on it


class Ground:
    """What objects can come to rest on: tops of supports and resting obstacles, and the floor.

    Args:
        scenario: the world.
    """

    def __init__(self, scenario: Scenario) -> None:
        resting = [o for o in scenario.obstacles if not any(o.velocity)]
        solids = [*scenario.supports, *resting]
        self._areas = np.array([shapely.Polygon(solid.footprint()) for solid in solids])
        self._tops = np.array([solid.top for solid in solids])
        shapely.prepare(self._areas)

    def height(self, point: Array, bottom: float) -> float:
        """Height of what lies under a point (2,) for a body whose bottom is at `bottom` [m]."""
        under = shapely.contains_xy(self._areas, point[0], point[1])
        legal = under & (self._tops <= bottom + _STEP_UP)
        return float(self._tops[legal].max(initial=0.0))


@dataclass(slots=True)
class LooseBody:
    """An object under gravity and dry friction, upright.

    Attributes:
        shape: its shape.
        friction: coefficient of friction with what it stands on.
        pose: (4, 4) T_world_object; replaced as a whole, never written into.
        velocity: (3,) of its centre [m/s].
        moving: it falls or slides.
    """

    shape: ObjectShape
    friction: float
    pose: Array
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    moving: bool = False

    def throw(self, pose: Array, velocity: Array) -> None:
        """Let it go at this pose with this velocity (3,) [m/s]; it turns upright at once."""
        yaw = math.atan2(pose[1, 0], pose[0, 0])
        self.pose = upright_pose(pose[:3, 3], yaw)
        self.velocity = velocity
        self.moving = True

    def push(self, offset: Array) -> None:
        """Move it in the plane by (2,) [m] without leaving it any speed."""
        self.pose = self.pose.copy()
        self.pose[:2, 3] += offset
        self.velocity = np.array([0.0, 0.0, self.velocity[2]])
        self.moving = True

    def advance(self, ground: Ground, gravity: float, dt: float) -> None:
        """One step of falling, of landing without bouncing, or of sliding to rest.

        Args:
            ground: what it can land on.
            gravity: [m/s^2].
            dt: [s].
        """
        if not self.moving:
            return
        half = 0.5 * self.shape.height
        floor = ground.height(self.pose[:2, 3], self.pose[2, 3] - half)
        slowed = self._slowed(gravity * dt, self.pose[2, 3] - half <= floor + 1e-9)
        position = self.pose[:3, 3] + 0.5 * (self.velocity + slowed) * dt
        if position[2] - half <= floor:
            position[2] = floor + half
            slowed[2] = 0.0
            self.moving = bool(np.any(slowed))
        self.velocity = slowed
        self.pose = self.pose.copy()
        self.pose[:3, 3] = position

    def _slowed(self, impulse: float, stands: bool) -> Array:
        """Velocity after gravity, and friction where it stands, have acted for a step."""
        velocity = self.velocity.copy()
        if not stands:
            velocity[2] -= impulse
            return velocity
        velocity[2] = 0.0
        speed = math.hypot(velocity[0], velocity[1])
        loss = self.friction * impulse
        velocity[:2] *= 0.0 if speed <= loss else 1.0 - loss / speed
        return velocity
