"""Reading an arm's URDF and cutting it to what a robot file asks for."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.assets import find_mesh
from motm_wbc.kinematics.description import Arm
from motm_wbc.kinematics.rotations import axis_angle, pose, rpy_from_rotation, rpy_rotation

_MOVING = ("revolute", "continuous", "prismatic")


def read_arm(path: Path) -> ET.Element:
    """The `robot` element of a URDF.

    Raises:
        InputError: unreadable, not XML, or not a URDF.
    """
    try:
        root = ET.fromstring(path.read_bytes())
    except OSError as error:
        raise InputError(f"can't be read: {error.strerror}", str(path)) from None
    except ET.ParseError as error:
        raise InputError(f"is not valid XML: {error}", str(path)) from None
    if root.tag != "robot":
        raise InputError(f"is no URDF: its root element is <{root.tag}>, not <robot>", str(path))
    _check_tree(root, str(path))
    return root


def _check_tree(robot: ET.Element, where: str) -> None:
    """Make sure that joints join known links to one tree, and that names are unique."""
    links = names(robot, "link")
    for tag in ("link", "joint"):
        listed = names(robot, tag)
        for name in listed:
            if listed.count(name) > 1:
                raise InputError(f"two {tag}s are named {name!r}", where)
    for joint in robot.iterfind("joint"):
        for end in ("parent", "child"):
            link = _end(joint, end)
            if link not in links:
                raise UnknownName("link", link, links, f"{where}: joint {joint.get('name')!r}")
    above = parent_joints(robot)
    roots = [name for name in links if name not in above]
    if len(roots) != 1 or len(above) != len(robot.findall("joint")):
        raise InputError(
            f"is not one tree: {len(roots)} links have no parent ({', '.join(roots)})", where
        )
    for name in links:
        link = name
        for _ in links:
            link = _end(above[link], "parent") if link in above else link
        if link != roots[0]:
            raise InputError(f"is not a tree: link {name!r} hangs on a loop", where)


def add_prefix(robot: ET.Element, prefix: str) -> None:
    """Put `prefix` before the names of all links and joints, in place."""
    for element in [*robot.iterfind("link"), *robot.iterfind("joint")]:
        element.set("name", prefix + element.get("name", ""))
    for end in [*robot.iterfind("joint/parent"), *robot.iterfind("joint/child")]:
        end.set("link", prefix + end.get("link", ""))


def parent_joints(robot: ET.Element) -> dict[str, ET.Element]:
    """Name of each link that has a parent -> the joint above it."""
    return {_end(joint, "child"): joint for joint in robot.iterfind("joint")}


def root_link(robot: ET.Element) -> str:
    """Name of the link that has no parent."""
    children = parent_joints(robot)
    return next(name for name in names(robot, "link") if name not in children)


def names(robot: ET.Element, tag: str) -> list[str]:
    """Names of all `link` or `joint` elements, in the file's order."""
    return [element.get("name", "") for element in robot.iterfind(tag)]


def cut_below(robot: ET.Element, root: str) -> None:
    """Remove, in place, every link that is not `root` or below it, and the joints between."""
    above = parent_joints(robot)

    def hangs_on_root(link: str) -> bool:
        while link != root:
            if link not in above:
                return False
            link = _end(above[link], "parent")
        return True

    for joint in robot.findall("joint"):
        if not hangs_on_root(_end(joint, "parent")):
            robot.remove(joint)
    for link in robot.findall("link"):
        if not hangs_on_root(link.get("name", "")):
            robot.remove(link)


def fix_joints(robot: ET.Element, arm: Arm, fingers: tuple[str, ...], where: str) -> None:
    """Turn locked joints into fixed ones at their positions, in place.

    Mimic rules are taken out: a gripper's fingers are all driven, and pybullet ignores them.

    Raises:
        InputError: a joint that moves has no role in the robot file, or the wrong type.
    """
    joints = names(robot, "joint")
    for key, asked in (
        ("arm.joints", arm.joints),
        ("gripper.fingers", fingers),
        ("arm.locked", tuple(arm.locked)),
    ):
        for name in asked:
            if name not in joints:
                raise UnknownName("joint", name, joints, f"{where}: {key}")
    for joint in robot.iterfind("joint"):
        name = joint.get("name", "")
        for extra in ("mimic", "safety_controller", "calibration"):
            for element in joint.findall(extra):
                joint.remove(element)
        roles = (name in arm.joints) + (name in fingers) + (name in arm.locked)
        if roles > 1:
            raise InputError(f"joint {name!r} has more than one role", f"{where}: arm")
        if joint.get("type") == "fixed" and roles == 0:
            continue
        if joint.get("type") not in _MOVING:
            raise InputError(
                f"joint {name!r} is {joint.get('type')}; legal: {', '.join(_MOVING)}",
                f"{where}: arm",
            )
        if roles == 0:
            raise InputError(
                f"joint {name!r} moves but is no arm joint and no finger; "
                "give it a position under arm.locked",
                f"{where}: arm",
            )
        if name in arm.locked:
            _lock(joint, arm.locked[name])
        if name in arm.limits:
            _narrow(joint, arm.limits[name], f"{where}: arm.limits.{name}")


def resolve_meshes(robot: ET.Element, urdf: Path) -> None:
    """Make the file names of all meshes absolute paths, in place.

    Raises:
        InputError: a mesh is missing.
    """
    for mesh in robot.iterfind(".//mesh"):
        mesh.set("filename", str(find_mesh(mesh.get("filename", ""), urdf)))


def vector(element: ET.Element | None, key: str, default: str) -> Array:
    """Three numbers of an attribute, or the default where element or attribute is missing."""
    text = default if element is None else element.get(key, default)
    return np.array([float(value) for value in text.split()])


def origin_pose(element: ET.Element) -> Array:
    """(4, 4) pose of an element's `origin`."""
    origin = element.find("origin")
    return pose(rpy_rotation(vector(origin, "rpy", "0 0 0")), vector(origin, "xyz", "0 0 0"))


def set_origin(element: ET.Element, T: Array) -> None:
    """Write a (4, 4) pose as the element's `origin`."""
    origin = element.find("origin")
    if origin is None:
        origin = ET.SubElement(element, "origin")
    origin.set("xyz", spaced(T[:3, 3]))
    origin.set("rpy", spaced(rpy_from_rotation(T[:3, :3])))


def spaced(values: Array | tuple[float, ...]) -> str:
    """Numbers with blanks between, exact to the bit."""
    return " ".join(repr(float(value)) for value in values)


def _end(joint: ET.Element, which: str) -> str:
    element = joint.find(which)
    return "" if element is None else element.get("link", "")


def _narrow(joint: ET.Element, wanted: tuple[float, float], where: str) -> None:
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        raise InputError("a continuous joint has no range to be narrowed", where)
    lower, upper = float(limit.get("lower", "0")), float(limit.get("upper", "0"))
    if not lower <= wanted[0] < wanted[1] <= upper:
        raise InputError(
            f"[{wanted[0]:g}, {wanted[1]:g}] is not inside the URDF's range "
            f"[{lower:g}, {upper:g}] rad or m",
            where,
        )
    limit.set("lower", repr(wanted[0]))
    limit.set("upper", repr(wanted[1]))


def _lock(joint: ET.Element, position: float) -> None:
    axis = vector(joint.find("axis"), "xyz", "1 0 0")
    if joint.get("type") == "prismatic":
        motion = pose(np.eye(3), position * axis)
    else:
        motion = pose(axis_angle(axis, position), np.zeros(3))
    set_origin(joint, origin_pose(joint) @ motion)
    joint.set("type", "fixed")
    for extra in ("axis", "limit", "dynamics"):
        for element in joint.findall(extra):
            joint.remove(element)
