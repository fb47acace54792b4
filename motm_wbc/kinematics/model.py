"""A robot, ready for use: what never changes while it moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind, BaseLimits
from motm_wbc.kinematics.chain import Chain, moved_by_arm, place
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.description import Part, RobotDescription


@dataclass(frozen=True, slots=True, eq=False)
class Capsules:
    """Collision shapes: all points within `radius` of a segment that moves with a link.

    Attributes:
        names: (k,) unique names.
        frames: (k,) names of the links that they move with.
        a: (k, 3) one end of each segment in its link frame [m].
        b: (k, 3) the other end [m].
        radius: (k,) [m].
        part: (k,) arm, hand or finger.
    """

    names: tuple[str, ...]
    frames: tuple[str, ...]
    a: Array
    b: Array
    radius: Array
    part: tuple[Part, ...]

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """An upright box.

    Attributes:
        size: (3,) extents [m].
        centre: (3,) [m], in the base frame.
    """

    size: Array
    centre: Array


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Where the arm's redundancy shall keep it; (n_arm,) each.

    Attributes:
        value: preferred positions [rad or m]; the home posture where nothing is preferred.
        weight: weight of each preference, zero where there is none.
        lower: positions that a joint shall stay above where it can, -inf for none.
        upper: positions that a joint shall stay below where it can, +inf for none.
    """

    value: Array
    weight: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A robot: its description, limits, shapes and kinematics.

    Attributes:
        name: short name.
        description: the robot file's content.
        urdf_path: the generated URDF of the whole robot; meshes are absolute paths.
        base_kind: differential or omnidirectional.
        base_limits: speeds and accelerations of the base.
        footprint: (n, 2) counter-clockwise outline in the base frame [m].
        base_height: [m].
        base_box: the base's collision body.
        n_arm: number of arm joints.
        n_base: number of base inputs, 2 or 3.
        arm_joints: names, from mount to tool.
        q_lower: (n_arm,) [rad or m], -inf for continuous joints.
        q_upper: (n_arm,) [rad or m], +inf for continuous joints.
        v_max: (n_arm,) [rad/s or m/s].
        a_max: (n_arm,) [rad/s^2 or m/s^2].
        home: (n_arm,) posture to start from and to travel in.
        posture: where the redundancy shall keep the arm.
        T_base_arm: (4, 4) the arm's mount in the base frame.
        arm_base_xy: (2,) its position on the floor plan [m].
        tool_link: name of the tool's frame.
        tool_frame: joint frame that the tool is fixed to, and its pose there.
        finger_joints: names of the finger joints.
        finger_links: names of the finger links.
        capsules: collision shapes of arm, hand and fingers.
        capsule_joint: (k,) joint frame that each capsule moves with.
        capsule_ends: (k, 2, 3) ends of the segments in those joint frames [m].
        capsule_moved_by: (k, n_base + n_arm) 1.0 for each input that moves the capsule.
        self_pairs: index pairs of capsules that must keep apart.
        base_pairs: indices of capsules that must keep off the base's body.
        frames: name of each link -> the joint frame that it is fixed to, and its (4, 4) pose
            there.
        chain: the tree of joints.
    """

    name: str
    description: RobotDescription
    urdf_path: Path
    base_kind: BaseKind
    base_limits: BaseLimits
    footprint: Array
    base_height: float
    base_box: Box
    n_arm: int
    n_base: int
    arm_joints: tuple[str, ...]
    q_lower: Array
    q_upper: Array
    v_max: Array
    a_max: Array
    home: Array
    posture: Posture
    T_base_arm: Array
    arm_base_xy: Array
    tool_link: str
    tool_frame: tuple[int, Array]
    finger_joints: tuple[str, ...]
    finger_links: tuple[str, ...]
    capsules: Capsules
    capsule_joint: np.ndarray[tuple[int], np.dtype[np.intp]]
    capsule_ends: Array
    capsule_moved_by: Array
    self_pairs: tuple[tuple[int, int], ...]
    base_pairs: tuple[int, ...]
    frames: Mapping[str, tuple[int, Array]] = field(repr=False)
    chain: Chain = field(repr=False)

    def configuration(
        self, base_pose: Array, q: Array, gripper_width: float | None = None
    ) -> Configuration:
        """Forward kinematics.

        Args:
            base_pose: (3,) x [m], y [m], heading [rad] of the base.
            q: (n_arm,) arm joint positions [rad or m].
            gripper_width: distance between the fingers [m]; None: fully open, where they
                take the most room.
        """
        width = self.description.gripper.max_width if gripper_width is None else gripper_width
        positions = np.concatenate((base_pose, q, self.finger_positions(width)))
        count = len(self.chain.parent)
        rotations, translations = np.empty((count, 3, 3)), np.empty((count, 3))
        J_world = np.empty((6, self.n_base + self.n_arm))
        place(
            self.chain, self.base_kind is BaseKind.DIFFERENTIAL, self.n_arm, positions,
            rotations, translations, J_world,
        )  # fmt: skip
        return Configuration(
            self, positions[:3], positions[3 : 3 + self.n_arm], width,
            rotations, translations, J_world,
        )  # fmt: skip

    def moved_by_arm(self, joint: int) -> Array:
        """(n_arm,) 1.0 for each arm joint that moves the joint frame `joint`, else 0.0."""
        return moved_by_arm(self.chain, joint, self.n_arm)

    def finger_positions(self, width: float) -> list[float]:
        """Positions of the finger joints at a gripper width [m]."""
        return [
            finger.closed + finger.per_width * width for finger in self.description.gripper.fingers
        ]

    def frame(self, name: str) -> tuple[int, Array]:
        """Index of the joint frame that a link is fixed to, and its (4, 4) pose there.

        Raises:
            UnknownName: the robot has no such link.
        """
        try:
            return self.frames[name]
        except KeyError:
            raise UnknownName("link", name, self.frames, self.name) from None
