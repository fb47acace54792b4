"""What a robot file says: a robot as data."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field, model_validator
from shapely.geometry import Polygon

from motm_wbc.errors import UnknownName
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind, BaseLimits
from motm_wbc.scene.files import Data

ROBOT_SIZE = 10.0  # [m]; a robot's dimension beyond is a slip of unit


def _inside_robot(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(abs(value) > ROBOT_SIZE for value in values):
        raise ValueError(f"lengths are metres, at most {ROBOT_SIZE:g} from the origin")
    return values


def _inside_turn(values: tuple[float, ...]) -> tuple[float, ...]:
    if any(abs(value) > math.tau for value in values):
        raise ValueError("angles are radians, at most one turn (6.28)")
    return values


def _unit(values: tuple[float, float, float]) -> tuple[float, float, float]:
    if abs(math.hypot(*values) - 1.0) > 1e-6:
        raise ValueError("an axis is a unit vector, for example [0.0, 0.0, 1.0]")
    return values


Link = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_./-]*$")]
Length = Annotated[float, Field(gt=0.0, le=ROBOT_SIZE)]
Xy = Annotated[tuple[float, float], AfterValidator(_inside_robot)]
Xyz = Annotated[tuple[float, float, float], AfterValidator(_inside_robot)]
Rpy = Annotated[tuple[float, float, float], AfterValidator(_inside_turn)]
Axis = Annotated[tuple[float, float, float], AfterValidator(_unit)]
Speed = Annotated[float, Field(gt=0.0, le=5.0)]
Acceleration = Annotated[float, Field(gt=0.0, le=10.0)]
JointSpeed = Annotated[float, Field(gt=0.0, le=20.0)]
JointAcceleration = Annotated[float, Field(gt=0.0, le=200.0)]
JointPosition = Annotated[float, Field(ge=-100.0, le=100.0)]


class Part(enum.StrEnum):
    """What a collision capsule belongs to; decides how near it may come to things."""

    ARM = "arm"
    HAND = "hand"
    FINGER = "finger"
    HELD = "held"
    """An object in the gripper: never in a robot file, it joins the hand when it is grasped."""


class Base(Data):
    """The mobile base: a box or a prism on the floor, driven along its heading."""

    kind: BaseKind
    """`differential` or `omnidirectional`."""
    length: Length | None = None
    """Extent along the base's x axis, the driving direction [m]; with `width`."""
    width: Length | None = None
    """Extent along the base's y axis [m]; with `length`."""
    outline: tuple[Xy, ...] | None = None
    """Corners of the footprint in the base frame [m], convex, in place of length and width."""
    height: Length
    """Height of the body over the floor [m]."""
    mass: Annotated[float, Field(gt=0.0, le=2000.0)]
    """[kg]."""
    v_max: Speed
    """Largest forward speed [m/s]."""
    v_reverse: Annotated[float, Field(ge=0.0, le=5.0)]
    """Largest backward speed, a positive number [m/s]; zero forbids reversing."""
    omega_max: Annotated[float, Field(gt=0.0, le=10.0)]
    """Largest turn rate [rad/s]."""
    a_max: Acceleration
    """Largest acceleration and deceleration along the heading [m/s^2]."""
    alpha_max: Annotated[float, Field(gt=0.0, le=50.0)]
    """Largest angular acceleration [rad/s^2]."""

    @model_validator(mode="after")
    def _has_one_footprint(self) -> Base:
        rectangle = self.length is not None and self.width is not None
        partly = self.length is not None or self.width is not None
        if rectangle != partly or rectangle == (self.outline is not None):
            raise ValueError("a base has either 'length' and 'width', or an 'outline'")
        if self.outline is not None:
            shape = Polygon(self.outline) if len(self.outline) >= 3 else None
            if shape is None or not shape.is_valid or shape.area < 1e-4:
                raise ValueError("outline must be a simple polygon with an area")
            if shape.convex_hull.area > shape.area + 1e-9:
                raise ValueError("outline must be convex")
        return self

    def footprint(self) -> Array:
        """(n, 2) counter-clockwise corners in the base frame [m]."""
        if self.outline is not None:
            return polygons.counter_clockwise(np.array(self.outline, dtype=float))
        assert self.length is not None and self.width is not None
        return polygons.rectangle(self.length, self.width)

    def limits(self) -> BaseLimits:
        """Speed and acceleration limits."""
        return BaseLimits(self.v_max, self.v_reverse, self.omega_max, self.a_max, self.alpha_max)


class Preference(Data):
    """Where the redundancy of the arm shall keep a joint, so that its branch never changes."""

    joint: Link
    """Name of an arm joint."""
    value: JointPosition | None = None
    """Preferred position [rad or m]."""
    weight: Annotated[float, Field(gt=0.0, le=100.0)] = 1.0
    """Weight of this joint's preference beside the others'."""
    lower: JointPosition | None = None
    """The joint shall stay above this where it can [rad or m]."""
    upper: JointPosition | None = None
    """The joint shall stay below this where it can [rad or m]."""

    @model_validator(mode="after")
    def _says_something(self) -> Preference:
        if self.value is None and self.lower is None and self.upper is None:
            raise ValueError("a preference has a 'value', a 'lower' or an 'upper'")
        return self


class Arm(Data):
    """The arm: a URDF, where it stands on the base, and which of its joints move."""

    urdf: str
    """Path relative to the robot file, or `example-robot-data:` and a path in its `robots`."""
    root: Link | None = None
    """Link that is mounted on the base; default: the root of the URDF."""
    prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]*$")] = ""
    """Put before each name in the URDF; all other keys use the names with it."""
    mount_xyz: Xyz
    """Origin of the arm's root link in the base frame [m]."""
    mount_rpy: Rpy = (0.0, 0.0, 0.0)
    """Orientation of the arm's root link in the base frame: roll, pitch, yaw [rad]."""
    joints: tuple[Link, ...] = Field(min_length=1)
    """Names of the arm's joints, from the mount to the tool."""
    a_max: tuple[JointAcceleration, ...]
    """Acceleration limits, one a joint [rad/s^2 or m/s^2]; no URDF carries them."""
    v_max: tuple[JointSpeed, ...] | None = None
    """Speed limits in place of the URDF's, one a joint [rad/s or m/s]."""
    home: tuple[JointPosition, ...]
    """Posture to start from and to travel in, one value a joint [rad or m]."""
    limits: dict[Link, tuple[JointPosition, JointPosition]] = Field(default_factory=dict)
    """Narrower ranges than the URDF's for some joints: lower, upper [rad or m]."""
    locked: dict[Link, JointPosition] = Field(default_factory=dict)
    """Joints of the URDF that don't move, and the positions they are held at [rad or m]."""
    preferences: tuple[Preference, ...] = ()
    """What the redundancy of the arm is used for."""

    @model_validator(mode="after")
    def _has_one_value_a_joint(self) -> Arm:
        _require_distinct("joints", self.joints)
        for key in ("a_max", "v_max", "home"):
            values = getattr(self, key)
            if values is not None and len(values) != len(self.joints):
                raise ValueError(f"'{key}' has {len(values)} values for {len(self.joints)} joints")
        for joint, (lower, upper) in self.limits.items():
            _require_known("joint", joint, self.joints, "limits")
            if lower >= upper:
                raise ValueError(f"limits: the range of {joint!r} is empty")
        for preference in self.preferences:
            _require_known("joint", preference.joint, self.joints, "preferences")
        _require_distinct("preferences", [preference.joint for preference in self.preferences])
        return self


class Tool(Data):
    """The frame that tasks are given for: between the finger tips."""

    parent: Link
    """Link of the URDF that the tool is fixed to."""
    xyz: Xyz = (0.0, 0.0, 0.0)
    """Origin of the tool frame in the parent link [m]."""
    rpy: Rpy = (0.0, 0.0, 0.0)
    """Orientation of the tool frame in the parent link: roll, pitch, yaw [rad]."""
    approach_axis: Axis = (0.0, 0.0, 1.0)
    """Direction in the tool frame in which the tool comes to an object."""
    closing_axis: Axis = (0.0, 1.0, 0.0)
    """Direction in the tool frame along which the fingers close."""

    @model_validator(mode="after")
    def _axes_are_square(self) -> Tool:
        if abs(float(np.dot(self.approach_axis, self.closing_axis))) > 1e-6:
            raise ValueError("'closing_axis' must be square to 'approach_axis'")
        return self


class Finger(Data):
    """One finger and the joint that moves it."""

    joint: Link
    """Joint of the URDF."""
    link: Link
    """Link of the URDF that touches objects."""
    closed: JointPosition = 0.0
    """Joint position at gripper width zero [rad or m]."""
    per_width: Annotated[float, Field(ge=-100.0, le=100.0)]
    """Joint travel per gripper width [rad/m or m/m]."""


class Gripper(Data):
    """The gripper: how far and how fast it opens and closes."""

    fingers: tuple[Finger, ...] = ()
    """Fingers that move; none: a gripper that has no moving part in the URDF."""
    max_width: Length
    """Distance between the fingers when open [m]."""
    closing_speed: Annotated[float, Field(gt=0.0, le=1.0)]
    """Rate at which the width shrinks while closing [m/s]."""
    min_closing_time: Annotated[float, Field(ge=0.0, le=5.0)] = 0.3
    """Closing on an object takes at least this long, whatever the width [s]."""
    opening_speed: Annotated[float, Field(gt=0.0, le=1.0)]
    """Rate at which the width grows while opening [m/s]."""
    force: Annotated[float, Field(gt=0.0, le=1000.0)]
    """Force of each finger on the object [N]."""


class Reach(Data):
    """Where the arm can grasp while the base moves, measured flat from the arm's base."""

    grasp_range: Length
    """Distance at which the arm can grasp [m]."""
    hold_radius: Length
    """Distance at which the arm can hold on while the base moves on [m]."""
    bearing_limit: Annotated[float, Field(gt=0.0, le=math.pi)]
    """Largest bearing to either side of the arm's x axis [rad]."""

    @model_validator(mode="after")
    def _holds_inside_range(self) -> Reach:
        if self.hold_radius > self.grasp_range:
            raise ValueError("'hold_radius' must not be larger than 'grasp_range'")
        return self


class CapsuleData(Data):
    """A capsule about a part of the robot: all points within `radius` of a segment."""

    name: Link
    """Unique in its robot."""
    link: Link
    """Link of the URDF that it moves with."""
    a: Xyz
    """One end of the segment in the link frame [m]."""
    b: Xyz
    """The other end [m]; equal to `a` for a sphere."""
    radius: Annotated[float, Field(gt=0.0, le=1.0)]
    """[m]."""
    part: Part
    """`arm`, `hand` or `finger`."""

    @model_validator(mode="after")
    def _is_no_held_object(self) -> CapsuleData:
        if self.part is Part.HELD:
            raise ValueError("'part' of a robot's capsule is arm, hand or finger")
        return self


class RobotDescription(Data):
    """A robot file's content."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
    """Short name, for listings and results."""
    description: str = ""
    """One line for listings."""
    maker: str = ""
    """Who builds the robot."""
    license: str
    """SPDX name of the licence of the arm's URDF and meshes."""
    source: str
    """Where the arm's URDF and meshes come from."""
    base: Base
    arm: Arm
    tool: Tool
    gripper: Gripper
    reach: Reach
    capsules: tuple[CapsuleData, ...] = Field(min_length=1)
    """Collision shapes of arm, hand and fingers; they contain the meshes."""
    self_pairs: tuple[tuple[Link, Link], ...]
    """Pairs of capsules that must keep apart, by name."""
    base_pairs: tuple[Link, ...]
    """Capsules that must keep off the base's body, by name."""

    @model_validator(mode="after")
    def _names_are_known(self) -> RobotDescription:
        names = [capsule.name for capsule in self.capsules]
        _require_distinct("capsules", names)
        for pair in self.self_pairs:
            for name in pair:
                _require_known("capsule", name, names, "self_pairs")
            if pair[0] == pair[1]:
                raise ValueError(f"self_pairs: {pair[0]!r} is paired with itself")
        for name in self.base_pairs:
            _require_known("capsule", name, names, "base_pairs")
        return self


def _require_distinct(key: str, names: Iterable[str]) -> None:
    listed = list(names)
    for name in listed:
        if listed.count(name) > 1:
            raise ValueError(f"{key}: {name!r} is named twice")


def _require_known(kind: str, name: str, known: Iterable[str], key: str) -> None:
    if name not in set(known):
        raise ValueError(str(UnknownName(kind, name, known, key)))
