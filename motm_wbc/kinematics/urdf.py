"""One URDF for the whole robot, made at run time, for Pinocchio, pybullet and rerun alike.

The base moves on three ordinary joints (x, y, yaw) below a fixed link `world`, so that no
reader needs a root joint of its own; that a differential drive can't slide sideways is
said elsewhere. Links and joints of the base and the tool have the names below.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import arm_tree
from motm_wbc.kinematics.arm_tree import spaced
from motm_wbc.kinematics.assets import find_urdf
from motm_wbc.kinematics.cache import store
from motm_wbc.kinematics.description import Base, RobotDescription

WORLD_LINK = "world"
BASE_LINKS = ("base_x_link", "base_y_link", "base_link")
BASE_LINK = "base_link"
BASE_JOINTS = ("base_x", "base_y", "base_yaw")
MOUNT_JOINT = "arm_mount"
TOOL_LINK = "tool"
TOOL_JOINT = "tool_joint"

_FLOOR_SIZE = 1000.0  # [m] from the origin, as far as scenes reach
_MIN_MASS = 1e-3  # [kg]; pybullet takes a link without inertia for 1 kg, and mass 0 for fixed
_MIN_INERTIA = 1e-6  # [kg m^2]
_CARRIAGE_MASS = 0.1  # [kg]; of the links between world and base, light beside any base
_BASE_EFFORT = 1e5  # [N, N m]; no limit here: whoever drives the joints limits their force


def write_urdf(description: RobotDescription, folder: Path, where: str) -> Path:
    """Generate the robot's URDF into the cache.

    Args:
        description: the robot.
        folder: the robot file's folder, for relative paths.
        where: the robot file, for messages.

    Returns:
        Path of the file; its name carries the hash of its content.

    Raises:
        InputError: names that the URDF lacks, missing meshes, joints without a role.
    """
    return store(build_urdf(description, folder, where), description.name, ".urdf")


def build_urdf(description: RobotDescription, folder: Path, where: str) -> str:
    """The text of the robot's URDF; see `write_urdf`."""
    arm = description.arm
    path = find_urdf(arm.urdf, folder, f"{where}: arm.urdf")
    try:
        source = _arm_of(description, path, where)
    except ValueError as error:
        raise InputError(f"has a number that can't be read: {error}", str(path)) from None
    robot = ET.Element("robot", name=description.name)
    _add_base(robot, description.base)
    _add_fixed_joint(
        robot, MOUNT_JOINT, BASE_LINK, arm_tree.root_link(source), arm.mount_xyz, arm.mount_rpy
    )
    for element in source:
        if element.tag in ("material", "link", "joint"):
            robot.append(element)
    tool = description.tool
    _add_link(robot, TOOL_LINK, _MIN_MASS, np.full(3, _MIN_INERTIA), np.zeros(3))
    _add_fixed_joint(robot, TOOL_JOINT, tool.parent, TOOL_LINK, tool.xyz, tool.rpy)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _arm_of(description: RobotDescription, path: Path, where: str) -> ET.Element:
    """The arm's part of the robot, made ready to be joined to the base."""
    arm = description.arm
    robot = arm_tree.read_arm(path)
    arm_tree.add_prefix(robot, arm.prefix)
    links = arm_tree.names(robot, "link")
    if not links:
        raise InputError("has no links", str(path))
    root = arm.root or arm_tree.root_link(robot)
    if root not in links:
        raise UnknownName("link", root, links, f"{where}: arm.root")
    arm_tree.cut_below(robot, root)
    _check_names(robot, description, where)
    fingers = tuple(finger.joint for finger in description.gripper.fingers)
    arm_tree.fix_joints(robot, arm, fingers, where)
    arm_tree.resolve_meshes(robot, path)
    for link in robot.iterfind("link"):
        _give_inertia(link)
    return robot


def _check_names(robot: ET.Element, description: RobotDescription, where: str) -> None:
    links = arm_tree.names(robot, "link")
    ours = {WORLD_LINK, *BASE_LINKS, TOOL_LINK, *BASE_JOINTS, MOUNT_JOINT, TOOL_JOINT}
    for name in [*links, *arm_tree.names(robot, "joint")]:
        if name in ours:
            raise InputError(
                f"{name!r} of the arm's URDF is a name that the base or tool has; "
                "set arm.prefix, or arm.root to a link below it",
                f"{where}: arm.urdf",
            )
    asked = [("tool.parent", description.tool.parent)]
    asked += [("gripper.fingers", finger.link) for finger in description.gripper.fingers]
    asked += [(f"capsules: {shape.name}", shape.link) for shape in description.capsules]
    for key, link in asked:
        if link not in links:
            raise UnknownName("link", link, links, f"{where}: {key}")


def _add_base(robot: ET.Element, base: Base) -> None:
    _add_link(robot, WORLD_LINK, _MIN_MASS, np.full(3, _MIN_INERTIA), np.zeros(3))
    for name in BASE_LINKS[:2]:
        _add_link(robot, name, _CARRIAGE_MASS, np.full(3, 0.01 * _CARRIAGE_MASS), np.zeros(3))
    outline = base.footprint()
    size = np.append(np.ptp(outline, axis=0), base.height)
    centre = np.append(0.5 * (outline.min(axis=0) + outline.max(axis=0)), 0.5 * base.height)
    squares = size**2
    inertia = base.mass / 12.0 * (squares.sum() - squares)
    link = _add_link(robot, BASE_LINK, base.mass, inertia, centre)
    for tag in ("visual", "collision"):
        body = ET.SubElement(link, tag)
        geometry = ET.SubElement(body, "geometry")
        if base.outline is None:
            ET.SubElement(body, "origin", xyz=spaced(centre), rpy="0 0 0")
            ET.SubElement(geometry, "box", size=spaced(size))
        else:
            mesh = store(_prism(outline, base.height), "base", ".obj")
            ET.SubElement(geometry, "mesh", filename=str(mesh))
    visual = link.find("visual")
    assert visual is not None
    material = ET.SubElement(visual, "material", name="base_grey")
    ET.SubElement(material, "color", rgba="0.35 0.37 0.4 1")
    _add_base_joints(robot, base)


def _prism(outline: Array, height: float) -> str:
    """A Wavefront mesh of a prism over a convex outline (n, 2), from the floor up [m]."""
    count = len(outline)
    lines = [f"v {x!r} {y!r} {z!r}" for z in (0.0, height) for x, y in outline.tolist()]
    floor, top = range(count, 0, -1), range(count + 1, 2 * count + 1)
    sides = [
        (k + 1, (k + 1) % count + 1, (k + 1) % count + count + 1, k + count + 1)
        for k in range(count)
    ]
    lines += [
        f"f {face[0]} {face[i]} {face[i + 1]}"
        for face in (floor, top, *sides)
        for i in range(1, len(face) - 1)
    ]
    return "\n".join(lines) + "\n"


def _add_base_joints(robot: ET.Element, base: Base) -> None:
    parents = (WORLD_LINK, *BASE_LINKS[:2])
    kinds = (("prismatic", "1 0 0"), ("prismatic", "0 1 0"), ("continuous", "0 0 1"))
    for name, parent, child, (kind, axis) in zip(
        BASE_JOINTS, parents, BASE_LINKS, kinds, strict=True
    ):
        joint = ET.SubElement(robot, "joint", name=name, type=kind)
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        ET.SubElement(joint, "axis", xyz=axis)
        limit = {"effort": repr(_BASE_EFFORT), "velocity": repr(base.omega_max)}
        if kind == "prismatic":
            limit["velocity"] = repr(max(base.v_max, base.v_reverse))
            limit["lower"], limit["upper"] = repr(-_FLOOR_SIZE), repr(_FLOOR_SIZE)
        ET.SubElement(joint, "limit", limit)


def _add_link(
    robot: ET.Element, name: str, mass: float, inertia: Array, centre: Array
) -> ET.Element:
    link = ET.SubElement(robot, "link", name=name)
    _write_inertia(link, mass, inertia, centre)
    return link


def _write_inertia(link: ET.Element, mass: float, inertia: Array, centre: Array) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=spaced(centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(float(mass)))
    moments = {"ixy": "0", "ixz": "0", "iyz": "0"}
    for key, value in zip(("ixx", "iyy", "izz"), inertia, strict=True):
        moments[key] = repr(float(value))
    ET.SubElement(inertial, "inertia", moments)


def _give_inertia(link: ET.Element) -> None:
    """Replace a missing or massless inertia, in place."""
    mass = link.find("inertial/mass")
    if mass is not None and float(mass.get("value", "0")) > 0.0:
        return
    for inertial in link.findall("inertial"):
        link.remove(inertial)
    _write_inertia(link, _MIN_MASS, np.full(3, _MIN_INERTIA), np.zeros(3))


def _add_fixed_joint(
    robot: ET.Element,
    name: str,
    parent: str,
    child: str,
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float],
) -> None:
    joint = ET.SubElement(robot, "joint", name=name, type="fixed")
    ET.SubElement(joint, "origin", xyz=spaced(xyz), rpy=spaced(rpy))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
