"""A robot's URDF as other libraries get it: joints and masses, and no meshes."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.arm_tree import spaced
from motm_wbc.kinematics.rotations import axis_angle, pose, rpy_from_rotation, rpy_rotation

_TURNS = 1000.0  # [rad]; a yaw joint with limits is one plain number in every library


def plain_urdf(model: RobotModel) -> str:
    """The robot with its fingers fixed as far open as they go, without shapes and meshes.

    Whoever reads it has the same variables: the base's three joints and the arm's.
    """
    robot = ET.fromstring(Path(model.urdf_path).read_text(encoding="utf-8"))
    for material in robot.findall("material"):
        robot.remove(material)
    for link in robot.iterfind("link"):
        for tag in ("visual", "collision"):
            for shape in link.findall(tag):
                link.remove(shape)
    width = model.description.gripper.max_width
    open_at = dict(zip(model.finger_joints, model.finger_positions(width), strict=True))
    for joint in robot.iterfind("joint"):
        position = open_at.get(joint.get("name", ""))
        if position is not None:
            _fix(joint, position)
        elif joint.get("type") == "continuous":
            _bound(joint)
    return ET.tostring(robot, encoding="unicode")


def _fix(joint: ET.Element, position: float) -> None:
    """Turn a joint into a fixed one at `position`, in place."""
    T = _origin(joint) @ _displacement(joint, position)
    for tag in ("origin", "axis", "limit", "mimic", "dynamics", "safety_controller"):
        for element in joint.findall(tag):
            joint.remove(element)
    joint.set("type", "fixed")
    ET.SubElement(joint, "origin", xyz=spaced(T[:3, 3]), rpy=spaced(rpy_from_rotation(T[:3, :3])))


def _displacement(joint: ET.Element, position: float) -> Array:
    axis = _vector(joint.find("axis"), "xyz", "1 0 0")
    if joint.get("type") == "prismatic":
        return pose(np.eye(3), position * axis)
    return pose(axis_angle(axis, position), np.zeros(3))


def _origin(joint: ET.Element) -> Array:
    element = joint.find("origin")
    rotation = rpy_rotation(_vector(element, "rpy", "0 0 0"))
    return pose(rotation, _vector(element, "xyz", "0 0 0"))


def _vector(element: ET.Element | None, key: str, default: str) -> Array:
    text = default if element is None else element.get(key, default)
    return np.array([float(word) for word in text.split()])


def _bound(joint: ET.Element) -> None:
    joint.set("type", "revolute")
    limit = joint.find("limit")
    if limit is None:
        limit = ET.SubElement(joint, "limit", effort="1000", velocity="100")
    limit.set("lower", repr(-_TURNS))
    limit.set("upper", repr(_TURNS))
