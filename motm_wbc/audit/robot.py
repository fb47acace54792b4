"""The robot as convex bodies that contain its meshes."""

from __future__ import annotations

from collections.abc import Sequence

import fcl
import numpy as np

from motm_wbc.audit.broad_phase import Indices
from motm_wbc.audit.shapes import Sphere, polyhedron
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.description import Part
from motm_wbc.kinematics.hulls import collision_hulls, prism
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.urdf import BASE_LINK


class RobotBody:
    """One convex piece of a link.

    Attributes:
        name: the link's name.
        part: arm, hand or finger; None for the base.
        joint: index of the joint frame that it moves with.
        level: number of arm joints that move it.
        corners: (n, 3) in the joint frame [m].
        sphere: contains it, in the joint frame.
    """

    def __init__(
        self, name: str, part: Part | None, joint: int, level: int, corners: Array, skin: float
    ) -> None:
        self.name = name
        self.part = part
        self.joint = joint
        self.level = level
        self.corners = corners
        self.sphere = Sphere.about(corners)
        self._grown = fcl.CollisionObject(polyhedron(corners, skin), fcl.Transform())
        self._exact = fcl.CollisionObject(polyhedron(corners), fcl.Transform())
        self._placed: tuple[Configuration | None, Configuration | None] = (None, None)

    def grown(self, configuration: Configuration) -> fcl.CollisionObject:
        """The body with its skin, where it is now; for contact."""
        return self._at(self._grown, 0, configuration)

    def exact(self, configuration: Configuration) -> fcl.CollisionObject:
        """The body without its skin, where it is now; for distances."""
        return self._at(self._exact, 1, configuration)

    def lowest(self, configuration: Configuration) -> float:
        """Height of its lowest point over the floor [m]."""
        up = configuration.rotations[self.joint][2]
        return float((self.corners @ up).min() + configuration.translations[self.joint, 2])

    def _at(
        self, body: fcl.CollisionObject, slot: int, configuration: Configuration
    ) -> fcl.CollisionObject:
        if self._placed[slot] is not configuration:
            joint = self.joint
            pose = fcl.Transform(configuration.rotations[joint], configuration.translations[joint])
            body.setTransform(pose)
            first, second = self._placed
            self._placed = (configuration, second) if slot == 0 else (first, configuration)
        return body


class RobotBodies:
    """All bodies of the robot, and arrays over them for the broad phase.

    The base is one prism, of the very footprint that planning uses.

    Attributes:
        bodies: the base first, then links in the URDF's order.
        radii: (p,) radii of their spheres [m].
        self_pairs: (m, 2) indices of bodies of the robot that must not touch.
        hand_level: number of arm joints that move the tool.

    Args:
        model: the robot.
        skin: how far shapes are grown for contact [m].
    """

    def __init__(self, model: RobotModel, skin: float) -> None:
        self.bodies = _bodies(model, skin)
        self.radii = np.array([body.sphere.radius for body in self.bodies])
        self.hand_level = int(model.moved_by_arm(model.tool_frame[0]).sum())
        self._centres = np.array([body.sphere.centre for body in self.bodies])
        self._joints = np.array([body.joint for body in self.bodies])
        self.self_pairs = self._self_pairs(model)

    def centres(self, configuration: Configuration) -> Array:
        """(p, 3) centres of the spheres in the world [m]."""
        rotations = configuration.rotations[self._joints]
        turned = np.einsum("pij,pj->pi", rotations, self._centres)
        turned += configuration.translations[self._joints]
        return np.asarray(turned)

    def _self_pairs(self, model: RobotModel) -> Indices:
        """Pairs that can touch: not neighbours in the chain, not in touch at home.

        Neighbours are up to two arm joints apart, as their joints' limits keep them apart
        where their meshes don't touch anyway. What touches at home does so because a hull
        holds more than its mesh.
        """
        home = model.configuration(np.zeros(3), model.home)
        request = fcl.CollisionRequest()
        pairs = []
        for i, first in enumerate(self.bodies):
            for j in range(i + 1, len(self.bodies)):
                second = self.bodies[j]
                if _are_neighbours(first, second):
                    continue
                result = fcl.CollisionResult()
                if not fcl.collide(first.grown(home), second.grown(home), request, result):
                    pairs.append((i, j))
        return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def _are_neighbours(first: RobotBody, second: RobotBody) -> bool:
    apart = abs(first.level - second.level)
    return apart < (2 if first.part is None else 3)


def _bodies(model: RobotModel, skin: float) -> Sequence[RobotBody]:
    roles = {shape.link: shape.part for shape in model.description.capsules}
    base_joint, placement = model.frame(BASE_LINK)
    base = _moved(prism(model.footprint, 0.0, model.base_height), placement)
    bodies = [RobotBody(BASE_LINK, None, base_joint, 0, base, skin)]
    for link, pieces in collision_hulls(model.urdf_path).items():
        if link == BASE_LINK:
            continue
        joint, placement = model.frame(link)
        level = int(model.moved_by_arm(joint).sum())
        part = roles.get(link, Part.ARM)
        for piece in pieces:
            bodies.append(RobotBody(link, part, joint, level, _moved(piece, placement), skin))
    return bodies


def _moved(corners: Array, pose: Array) -> Array:
    return np.asarray(corners @ pose[:3, :3].T + pose[:3, 3])
