"""Fingers against objects without a physics engine: who touches whom, and who is pushed."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.hulls import collision_hulls
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.simulation.bodies import ObjectShape

_FLAT = 1e-3  # length below which an axis, seen from above, has no direction


class FingerShapes:
    """The convex parts of the fingers, and how far from the tool they reach.

    Args:
        model: the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        hulls = collision_hulls(model.urdf_path)
        parts: list[tuple[int, Array]] = []
        for link in model.finger_links:
            joint, placement = model.frame(link)
            for part in hulls.get(link, ()):
                parts.append((joint, part @ placement[:3, :3].T + placement[:3, 3]))
        sizes = [len(part) for _, part in parts]
        self._joints = np.repeat([joint for joint, _ in parts], sizes).astype(np.intp)
        self._corners = np.concatenate([np.zeros((0, 3)), *(part for _, part in parts)])
        self._starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.intp)
        self.reach = self._reach(model)

    def _reach(self, model: RobotModel) -> float:
        """Largest distance of a finger's corner from the tool, fingers open [m]."""
        width = model.description.gripper.max_width
        configuration = model.configuration(np.zeros(3), model.home, width)
        away = self._placed(configuration) - configuration.T_world_tool[:3, 3]
        return float(np.linalg.norm(away, axis=1).max(initial=0.0))

    def near(self, configuration: Configuration, lower: Array, upper: Array) -> list[Array]:
        """Corners (n, 3) of the parts that may reach into a box in world axes [m].

        Args:
            configuration: the robot.
            lower: (3,) lower corner of the box [m].
            upper: (3,) upper corner [m].
        """
        corners, starts = self._placed(configuration), self._starts
        if len(corners) == 0:
            return []
        low = np.minimum.reduceat(corners, starts[:-1])
        high = np.maximum.reduceat(corners, starts[:-1])
        meets = np.flatnonzero(((low < upper) & (high > lower)).all(axis=1))
        return [corners[starts[i] : starts[i + 1]] for i in meets]

    def _placed(self, configuration: Configuration) -> Array:
        """(k, 3) all corners in the world [m]."""
        rotations = configuration.rotations[self._joints]
        placed = np.einsum("kij,kj->ki", rotations, self._corners)
        return np.asarray(placed + configuration.translations[self._joints])


def push_out(corners: Array, shape: ObjectShape, pose: Array, R_world_tool: Array) -> Array:
    """The least horizontal move that frees an upright object from a convex body.

    Separating axes in the plane: the normals of the object's outline and the tool's own axes,
    along which the sides of fingers lie. Only the slice of the body at the object's height
    counts.

    Args:
        corners: (n, 3) corners of the body in the world [m].
        shape: the object's shape.
        pose: (4, 4) T_world_object.
        R_world_tool: (3, 3).

    Returns:
        (2,) [m]; zero if they don't overlap.
    """
    half = 0.5 * shape.height
    points = _slice(corners, pose[2, 3] - half, pose[2, 3] + half)
    if len(points) == 0:
        return np.zeros(2)
    outline = shape.outline_in_world(pose)
    axes = _axes(outline, R_world_tool)
    body, thing = points @ axes.T, outline @ axes.T
    forward = body.max(axis=0) - thing.min(axis=0)
    backward = thing.max(axis=0) - body.min(axis=0)
    depth = np.minimum(forward, backward)
    least = int(np.argmin(depth))
    if depth[least] <= 0.0:
        return np.zeros(2)
    sign = 1.0 if forward[least] <= backward[least] else -1.0
    return np.asarray(sign * depth[least] * axes[least])


def _slice(corners: Array, bottom: float, top: float) -> Array:
    """Points (k, 2) whose convex hull is the body between two heights, seen from above."""
    z = corners[:, 2]
    if z.min() >= top or z.max() <= bottom:
        return np.zeros((0, 2))
    parts = [corners[(z >= bottom) & (z <= top), :2]]
    for level in (bottom, top):
        low, high = corners[z < level], corners[z > level]
        if len(low) and len(high):
            share = (level - low[:, None, 2]) / (high[None, :, 2] - low[:, None, 2])
            cut = low[:, None, :2] + share[..., None] * (high[None, :, :2] - low[:, None, :2])
            parts.append(cut.reshape(-1, 2))
    return np.concatenate(parts)


def _axes(outline: Array, R_world_tool: Array) -> Array:
    """(k, 2) unit axes to test."""
    sides = np.roll(outline, -1, axis=0) - outline
    normals = np.column_stack([sides[:, 1], -sides[:, 0]])
    axes = np.concatenate([normals, R_world_tool[:2, :].T])
    length = np.linalg.norm(axes, axis=1)
    keep = length > _FLAT
    return np.asarray(axes[keep] / length[keep, None])
