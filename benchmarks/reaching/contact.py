"""Contact by python-fcl: the audit's bodies of the robot against boxes and cylinders."""

from __future__ import annotations

from collections.abc import Sequence

import fcl
import numpy as np

from motm_wbc.audit.broad_phase import SpherePairs, squared_gaps
from motm_wbc.audit.parameters import AuditParameters
from motm_wbc.audit.robot import RobotBodies
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.rotations import planar_pose
from motm_wbc.qp import Body

_FLOOR = "floor"


class ContactCheck:
    """Finds every pair that touches; all contact is forbidden.

    The robot's bodies, which contain its collision meshes and have a skin, are the audit's.
    Scenario files know solids on the floor only, so those of the scene are made here.

    Args:
        model: the robot.
        bodies: of the scene, at rest.
    """

    def __init__(self, model: RobotModel, bodies: Sequence[Body]) -> None:
        skin = AuditParameters().skin
        self._model = model
        self._robot = RobotBodies(model, skin)
        self._bodies = [(body.name, _fcl_object(body)) for body in bodies]
        corners = [_corners(body) for body in bodies]
        self._lower = np.array([points.min(axis=0) for points in corners])
        self._upper = np.array([points.max(axis=0) for points in corners])
        self._limit = (self._robot.radii + 2.0 * skin)[:, None] ** 2
        self._own = SpherePairs(self._robot.self_pairs, self._robot.radii, 2.0 * skin)

    def contacts(self, base_pose: Array, q: Array) -> list[str]:
        """Names of the pairs that touch in a configuration."""
        at = self._model.configuration(base_pose, q)
        centres = self._robot.centres(at)
        near = squared_gaps(centres, self._lower, self._upper) <= self._limit
        found = []
        for i, j in zip(*(side.tolist() for side in near.nonzero()), strict=True):
            body, (name, solid) = self._robot.bodies[i], self._bodies[j]
            stands = name == _FLOOR and body.level == 0  # the base and what is fixed to it
            if not stands and _touch(body.grown(at), solid):
                found.append(f"{body.name} - {name}")
        for i, j in self._own.near(centres):
            first, second = self._robot.bodies[i], self._robot.bodies[j]
            if _touch(first.grown(at), second.grown(at)):
                found.append(f"{first.name} - {second.name}")
        return found


def _touch(first: fcl.CollisionObject, second: fcl.CollisionObject) -> bool:
    return bool(fcl.collide(first, second, fcl.CollisionRequest(), fcl.CollisionResult()))


def _fcl_object(body: Body) -> fcl.CollisionObject:
    height = body.top - body.bottom
    T = planar_pose(body.pose)
    T[2, 3] = body.bottom + 0.5 * height
    if body.radius is not None:
        shape = fcl.Cylinder(body.radius, height)
    else:
        shape = fcl.Box(*np.ptp(body.outlines[0], axis=0), height)
    return fcl.CollisionObject(shape, fcl.Transform(T[:3, :3], T[:3, 3]))


def _corners(body: Body) -> Array:
    outline = body.outlines[0] if body.radius is None else polygons.disc(body.radius)
    flat = polygons.place(outline, body.pose)
    return np.concatenate(
        [np.column_stack((flat, np.full(len(flat), z))) for z in (body.bottom, body.top)]
    )
