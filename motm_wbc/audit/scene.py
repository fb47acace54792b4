"""The scene as bodies for python-fcl, kept where the truth says that they are."""

from __future__ import annotations

import fcl
import numpy as np

from motm_wbc.audit.shapes import Sphere, solid_corners, solid_geometries
from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import GroundTruth, MovingBody
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.scene.scenario import Scenario, upright_pose
from motm_wbc.scene.solids import Solid


class SceneBody:
    """A solid of the scene.

    Attributes:
        name: its name.
        role: support, obstacle or object.
        top: height of the solid [m].
        sphere: contains it, about its own centre.
        corners: (n, 3) of a prism about its own centre that contains it [m].
        pose: (4, 4) of its centre in the world.
    """

    def __init__(self, solid: Solid, role: SolidRole, pose: Array) -> None:
        self.name = solid.name
        self.role = role
        self.top = solid.top
        self.corners = solid_corners(solid)
        self.sphere = Sphere.about(self.corners)
        self.pose = pose
        self._pieces = [
            fcl.CollisionObject(shape, fcl.Transform()) for shape in solid_geometries(solid)
        ]
        self._placed: Array | None = None

    @property
    def pieces(self) -> list[fcl.CollisionObject]:
        """Its convex parts, where it is now; they are moved only when somebody looks."""
        if self._placed is not self.pose:
            transform = fcl.Transform(self.pose[:3, :3], self.pose[:3, 3])
            for piece in self._pieces:
                piece.setTransform(transform)
            self._placed = self.pose
        return self._pieces

    def centre(self) -> Array:
        """(3,) centre of its sphere in the world [m]."""
        return np.asarray(self.pose[:3, 3] + self.pose[:3, :3] @ self.sphere.centre)

    def lowest(self) -> float:
        """Height of its lowest point over the floor [m]."""
        return float((self.corners @ self.pose[2, :3]).min() + self.pose[2, 3])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner (3,) of a box in world axes that contains it [m]."""
        corners = self.corners @ self.pose[:3, :3].T + self.pose[:3, 3]
        return corners.min(axis=0), corners.max(axis=0)


class SceneBodies:
    """All solids, and arrays over them for the broad phase.

    Attributes:
        bodies: supports, obstacles, then objects.
        index: name -> index into `bodies`.
        lower: (s, 3) lower corners of boxes in world axes that contain them [m].
        upper: (s, 3) upper corners [m].

    Args:
        scenario: the world at the start.
    """

    def __init__(self, scenario: Scenario) -> None:
        solids = [(solid, SolidRole.SUPPORT) for solid in scenario.supports]
        obstacles = [(solid, SolidRole.OBSTACLE) for solid in scenario.obstacles]
        self.bodies = [
            *(SceneBody(solid, role, _standing(solid)) for solid, role in (*solids, *obstacles)),
            *(
                SceneBody(thing, SolidRole.OBJECT, scenario.T_world_object(thing.name))
                for thing in scenario.objects
            ),
        ]
        self.index = {body.name: i for i, body in enumerate(self.bodies)}
        bounds = [body.bounds() for body in self.bodies]
        self.lower = np.array([lower for lower, _ in bounds])
        self.upper = np.array([upper for _, upper in bounds])

    def update(self, truth: GroundTruth) -> None:
        """Move what has moved."""
        for name, pose in truth.objects.items():
            i = self.index[name]
            body = self.bodies[i]
            if body.pose is not pose:
                body.pose = pose
                centre = body.centre()
                self.lower[i] = centre - body.sphere.radius
                self.upper[i] = centre + body.sphere.radius
        for name, moving in truth.moving.items():
            i = self.index[name]
            self.bodies[i].pose = _pose_of(moving, self.bodies[i].top)
            self.lower[i], self.upper[i] = self.bodies[i].bounds()


def _standing(solid: Solid) -> Array:
    return upright_pose(np.array([*solid.position, 0.5 * solid.top]), solid.yaw)


def _pose_of(moving: MovingBody, top: float) -> Array:
    x, y, yaw = (float(value) for value in moving.pose)
    return upright_pose(np.array([x, y, 0.5 * top]), yaw)
