"""The scene's bodies in a physics client: supports, obstacles, objects, the floor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import shapely

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.convex_parts import convex_parts
from motm_wbc.interfaces import MovingBody
from motm_wbc.kinematics.hulls import prism
from motm_wbc.scene.scenario import Scenario
from motm_wbc.scene.solids import Object, Solid
from motm_wbc.simulation.bullet_client import BulletClient
from motm_wbc.simulation.parameters import PhysicsParameters
from motm_wbc.simulation.quaternions import pose_matrix, quaternion, yaw_quaternion


class BulletScene:
    """Everything but the robot.

    A body's frame in the engine is its centre of mass; an object's own origin may lie
    elsewhere, so poses are turned from one into the other here and nowhere else.

    Attributes:
        floor: body of the floor.
        objects: name -> body of each object.
        centres: name -> (3,) centre of mass of each object in its own frame [m].

    Args:
        client: the physics client.
        scenario: the world.
        parameters: friction.
    """

    def __init__(
        self, client: BulletClient, scenario: Scenario, parameters: PhysicsParameters
    ) -> None:
        self._client = client
        self._friction = parameters.contact_friction
        floor = client.createCollisionShape(client.GEOM_PLANE)
        self.floor: int = client.createMultiBody(0.0, floor)
        client.changeDynamics(self.floor, -1, lateralFriction=self._friction)
        solids = (*scenario.supports, *scenario.obstacles)
        self._solids = {solid.name: self._add_solid(solid) for solid in solids}
        self._half_height = {solid.name: 0.5 * solid.top for solid in solids}
        self.centres = {thing.name: _centre(thing) for thing in scenario.objects}
        self.objects = {
            thing.name: self._add_object(thing, scenario.T_world_object(thing.name))
            for thing in scenario.objects
        }

    def move(self, bodies: Mapping[str, MovingBody]) -> None:
        """Put the solids that move by themselves where they are now."""
        for name, body in bodies.items():
            x, y, yaw = (float(value) for value in body.pose)
            self._client.resetBasePositionAndOrientation(
                self._solids[name], (x, y, self._half_height[name]), yaw_quaternion(yaw)
            )

    def T_world_object(self, name: str) -> Array:
        """(4, 4) pose of an object."""
        pose = pose_matrix(*self._client.getBasePositionAndOrientation(self.objects[name]))
        pose[:3, 3] -= pose[:3, :3] @ self.centres[name]
        return pose

    def _add_solid(self, solid: Solid) -> int:
        body: int = self._client.createMultiBody(
            0.0,
            self._shape(solid, np.zeros(3)),
            -1,
            (*solid.position, 0.5 * solid.top),
            yaw_quaternion(solid.yaw),
        )
        self._client.changeDynamics(body, -1, lateralFriction=self._friction)
        return body

    def _add_object(self, thing: Object, pose: Array) -> int:
        centre = self.centres[thing.name]
        body: int = self._client.createMultiBody(
            thing.mass,
            self._shape(thing, centre),
            -1,
            (pose[:3, 3] + pose[:3, :3] @ centre).tolist(),
            quaternion(pose[:3, :3]),
        )
        # An object must not fall asleep: it would float where its support is taken away.
        self._client.changeDynamics(
            body,
            -1,
            lateralFriction=thing.friction,
            activationState=self._client.ACTIVATION_STATE_DISABLE_SLEEPING,
        )
        return body

    def _shape(self, solid: Solid, centre: Array) -> int:
        """Collision shape about a point (3,) of the solid's own frame."""
        client = self._client
        if solid.size is not None:
            half = [0.5 * side for side in solid.size]
            return int(client.createCollisionShape(client.GEOM_BOX, halfExtents=half))
        if solid.radius is not None:
            size = {"radius": solid.radius, "height": solid.top}
            return int(client.createCollisionShape(client.GEOM_CYLINDER, **size))
        half_height = 0.5 * solid.top
        parts = [
            (prism(part, -half_height, half_height) - centre).tolist()
            for part in convex_parts(solid.outline_in_body())
        ]
        if len(parts) == 1:
            return int(client.createCollisionShape(client.GEOM_MESH, vertices=parts[0]))
        kinds = [client.GEOM_MESH] * len(parts)
        return int(client.createCollisionShapeArray(shapeTypes=kinds, vertices=parts))


def _centre(thing: Object) -> Array:
    """(3,) centre of mass of a homogeneous object in its own frame [m]."""
    if thing.outline is None:
        return np.zeros(3)
    point = shapely.Polygon(thing.outline_in_body()).centroid
    return np.array([point.x, point.y, 0.0])
