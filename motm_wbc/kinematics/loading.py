"""From a robot file to a robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics.chain import moved_by_arm
from motm_wbc.kinematics.description import Arm, Base, RobotDescription
from motm_wbc.kinematics.model import Box, Capsules, Posture, RobotModel
from motm_wbc.kinematics.pinocchio_model import UrdfModel, read_model
from motm_wbc.kinematics.rotations import pose, rpy_rotation
from motm_wbc.kinematics.urdf import TOOL_LINK, write_urdf
from motm_wbc.scene.files import parse, read_toml
from motm_wbc.scene.finder import find_robot

_MAX_JOINT_SPEED = 100.0  # [rad/s or m/s]; beyond, a URDF means "no limit"


def load_robot(name: str | Path) -> RobotModel:
    """Read a robot.

    Args:
        name: a name from the shipped `robots/`, or a path to a robot file or its folder.

    Raises:
        InputError: file not found, not valid, or it names what the URDF lacks.
    """
    path = find_robot(name)
    return build_model(load_description(path), path.parent, str(path))


def load_description(name: str | Path) -> RobotDescription:
    """What a robot file says, without building the robot.

    Args:
        name: a name from the shipped `robots/`, or a path to a robot file or its folder.

    Raises:
        InputError: file not found, or not valid.
    """
    path = find_robot(name)
    return parse(RobotDescription, read_toml(path), str(path))


def build_model(description: RobotDescription, folder: Path, where: str) -> RobotModel:
    """A robot from its description.

    Args:
        description: the robot file's content.
        folder: where relative paths start.
        where: the robot file's name for messages.

    Raises:
        InputError: the description does not fit the URDF.
    """
    arm, base, fingers = description.arm, description.base, description.gripper.fingers
    urdf = write_urdf(description, folder, where)
    read = read_model(urdf, arm.joints, [finger.joint for finger in fingers])
    tool_frame = read.frames[TOOL_LINK]
    _check_arm(read, arm, tool_frame[0], where)
    limits = read.limits
    v_max = limits.speed if arm.v_max is None else np.array(arm.v_max)
    _check_limits(arm, limits.lower, limits.upper, v_max, where)
    capsules = _capsules(description)
    n_base = 2 if base.kind is BaseKind.DIFFERENTIAL else 3
    joints, ends, moved_by = _placed(capsules, read, n_base)
    index = {name: i for i, name in enumerate(capsules.names)}
    return RobotModel(
        name=description.name,
        description=description,
        urdf_path=urdf,
        base_kind=base.kind,
        base_limits=base.limits(),
        footprint=base.footprint(),
        base_height=base.height,
        base_box=_base_box(base),
        n_arm=len(arm.joints),
        n_base=n_base,
        arm_joints=arm.joints,
        q_lower=limits.lower,
        q_upper=limits.upper,
        v_max=v_max,
        a_max=np.array(arm.a_max),
        home=np.array(arm.home),
        posture=_posture(arm),
        T_base_arm=pose(rpy_rotation(arm.mount_rpy), arm.mount_xyz),
        arm_base_xy=np.array(arm.mount_xyz[:2]),
        tool_link=TOOL_LINK,
        tool_frame=tool_frame,
        finger_joints=tuple(finger.joint for finger in fingers),
        finger_links=tuple(finger.link for finger in fingers),
        capsules=capsules,
        capsule_joint=joints,
        capsule_ends=ends,
        capsule_moved_by=moved_by,
        self_pairs=tuple((index[a], index[b]) for a, b in description.self_pairs),
        base_pairs=tuple(index[name] for name in description.base_pairs),
        frames=read.frames,
        chain=read.chain,
    )


def _check_arm(read: UrdfModel, arm: Arm, tool_joint: int, where: str) -> None:
    """Make sure that all arm joints move the tool and are given from the mount to it."""
    moves = moved_by_arm(read.chain, tool_joint, len(arm.joints))
    for name, moved in zip(arm.joints, moves, strict=True):
        if not moved:
            raise InputError(
                f"joint {name!r} does not move the tool; lock it or choose another tool.parent",
                f"{where}: arm.joints",
            )
    in_order = tuple(name for name in read.joint_names if name in arm.joints)
    if in_order != arm.joints:
        raise InputError(
            f"the order from mount to tool is {', '.join(in_order)}", f"{where}: arm.joints"
        )


def _check_limits(arm: Arm, lower: Array, upper: Array, v_max: Array, where: str) -> None:
    values = [("home", name, q) for name, q in zip(arm.joints, arm.home, strict=True)]
    values += [
        ("preferences", item.joint, value)
        for item in arm.preferences
        for value in (item.value, item.lower, item.upper)
        if value is not None
    ]
    for key, name, q in values:
        i = arm.joints.index(name)
        if not lower[i] <= q <= upper[i]:
            raise InputError(
                f"{name} = {q:g} is outside the joint's range "
                f"[{lower[i]:g}, {upper[i]:g}] rad or m",
                f"{where}: arm.{key}",
            )
    for name, speed in zip(arm.joints, v_max, strict=True):
        if not 0.0 < speed < _MAX_JOINT_SPEED:
            raise InputError(
                f"the URDF has no speed limit for {name!r}; give one for each joint",
                f"{where}: arm.v_max",
            )


def _capsules(description: RobotDescription) -> Capsules:
    shapes = description.capsules
    return Capsules(
        names=tuple(shape.name for shape in shapes),
        frames=tuple(shape.link for shape in shapes),
        a=np.array([shape.a for shape in shapes]),
        b=np.array([shape.b for shape in shapes]),
        radius=np.array([shape.radius for shape in shapes]),
        part=tuple(shape.part for shape in shapes),
    )


def _placed(
    capsules: Capsules, read: UrdfModel, n_base: int
) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Array, Array]:
    """Joint frames of the capsules, their ends in them, and the inputs that move them."""
    joints, ends, moved_by = [], [], []
    n_arm = len(read.limits.lower)
    for frame, a, b in zip(capsules.frames, capsules.a, capsules.b, strict=True):
        joint, placement = read.frames[frame]
        joints.append(joint)
        ends.append(np.array([a, b]) @ placement[:3, :3].T + placement[:3, 3])
        arm = moved_by_arm(read.chain, joint, n_arm)
        moved_by.append(np.concatenate([np.ones(n_base), arm]))
    return np.array(joints, dtype=np.intp), np.array(ends), np.array(moved_by)


def _base_box(base: Base) -> Box:
    outline = base.footprint()
    low, high = outline.min(axis=0), outline.max(axis=0)
    return Box(
        size=np.append(high - low, base.height),
        centre=np.append(0.5 * (low + high), 0.5 * base.height),
    )


def _posture(arm: Arm) -> Posture:
    count = len(arm.joints)
    posture = Posture(
        value=np.array(arm.home),
        weight=np.zeros(count),
        lower=np.full(count, -np.inf),
        upper=np.full(count, np.inf),
    )
    for item in arm.preferences:
        i = arm.joints.index(item.joint)
        if item.value is not None:
            posture.value[i], posture.weight[i] = item.value, item.weight
        if item.lower is not None:
            posture.lower[i] = item.lower
        if item.upper is not None:
            posture.upper[i] = item.upper
    return posture
