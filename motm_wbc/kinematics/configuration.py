"""The robot in one configuration: poses, Jacobians by inputs, manipulability, capsules."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.chain import frame_pose, jacobian_at, place_points
from motm_wbc.kinematics.manipulability import manipulability, manipulability_gradient
from motm_wbc.kinematics.rotations import inverse_pose, planar_pose

if TYPE_CHECKING:
    from motm_wbc.kinematics.model import RobotModel


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where everything is, and how the inputs move it. Immutable; made by `RobotModel`.

    Columns of every Jacobian are the base's inputs, (v, omega) or (v_x, v_y, omega) in the
    base frame, then the arm's joints; rows are world axes.

    Attributes:
        model: the robot.
        base_pose: (3,) x [m], y [m], heading [rad].
        q: (n_arm,) joint positions [rad or m].
        gripper_width: [m].
        rotations: (m, 3, 3) of the joint frames, `model.capsule_joint` indexes them.
        translations: (m, 3) of the joint frames [m].
        J_world: (6, n_base + n_arm) velocity of the point at the world's origin, then
            angular velocity, of a body that all inputs move.
    """

    model: RobotModel
    base_pose: Array
    q: Array
    gripper_width: float
    rotations: Array
    translations: Array
    J_world: Array

    @cached_property
    def T_world_base(self) -> Array:
        """(4, 4) pose of the base frame, on the floor."""
        return planar_pose(self.base_pose)

    @cached_property
    def T_world_tool(self) -> Array:
        """(4, 4) pose of the tool frame."""
        return self._placed(*self.model.tool_frame)

    @cached_property
    def T_base_tool(self) -> Array:
        """(4, 4) pose of the tool in the base frame."""
        return inverse_pose(self.T_world_base) @ self.T_world_tool

    @cached_property
    def J_tool(self) -> Array:
        """(6, n_base + n_arm) linear, then angular velocity of the tool, at its origin."""
        return self._jacobian_at(self.T_world_tool[:3, 3])

    @cached_property
    def manipulability(self) -> float:
        """Yoshikawa's measure of the arm's Jacobian, sqrt(det(J J^T))."""
        return manipulability(self.J_tool[:, self.model.n_base :])

    @cached_property
    def manipulability_gradient(self) -> Array:
        """(n_arm,) derivative of `manipulability` for each joint."""
        gradient = np.empty(self.model.n_arm)
        manipulability_gradient(self.J_tool[:, self.model.n_base :], gradient)
        return gradient

    @cached_property
    def translational_manipulability(self) -> float:
        """The same measure of the arm's three linear rows."""
        return manipulability(self.J_tool[:3, self.model.n_base :])

    def link_pose(self, name: str) -> Array:
        """(4, 4) pose of a link in the world.

        Raises:
            UnknownName: the robot has no such link.
        """
        return self._placed(*self.model.frame(name))

    def capsule_segments(self) -> Array:
        """(k, 2, 3) ends of the capsules' segments in the world [m]."""
        segments = np.empty(self.model.capsule_ends.shape)
        place_points(
            self.rotations, self.translations,
            self.model.capsule_joint, self.model.capsule_ends, segments,
        )  # fmt: skip
        return segments

    def point_jacobian(self, capsule: int, point: Array) -> Array:
        """Velocity of a point that is fixed to a capsule's link.

        Args:
            capsule: index of the capsule.
            point: (3,) where the point is now, in the world [m].

        Returns:
            (3, n_base + n_arm) linear velocity in world axes.
        """
        return np.asarray(self._jacobian_at(point)[:3] * self.model.capsule_moved_by[capsule])

    def _jacobian_at(self, point: Array) -> Array:
        J = np.empty(self.J_world.shape)
        jacobian_at(self.J_world, point, J)
        return J

    def _placed(self, joint: int, placement: Array) -> Array:
        T = np.empty((4, 4))
        frame_pose(self.rotations, self.translations, joint, placement, T)
        return T
