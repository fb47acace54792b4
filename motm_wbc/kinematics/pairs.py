"""Which pairs of bodies must keep how far apart: one list for controller and audit."""

from __future__ import annotations

import enum

from motm_wbc.kinematics.description import Part
from motm_wbc.kinematics.parameters import PairClass, PairClasses

_DEFAULT = PairClasses()


class SolidRole(enum.StrEnum):
    """What a solid of the scene is to the robot."""

    SUPPORT = "support"
    OBSTACLE = "obstacle"
    OBJECT = "object"


def classify(
    part: Part,
    role: SolidRole,
    *,
    is_target: bool = False,
    is_held: bool = False,
    contact_allowed: bool = False,
    classes: PairClasses = _DEFAULT,
) -> PairClass | None:
    """The class of a part of the robot and a solid of the scene.

    Args:
        part: part of the robot; a held object counts as one, `Part.HELD`.
        role: what the solid is.
        is_target: the solid is the object to be grasped or just released.
        is_held: the solid is the object in the gripper (seen as a solid, not as a part).
        contact_allowed: a held object may touch its support now: from the grasp to the end
            of the lift, and at the drop.
        classes: the distances.

    Returns:
        None where contact is allowed: fingers and their target, hand and held object, a held
        object on its support.
    """
    if part is Part.ARM:
        if is_held:
            return classes.self_collision
        return classes.hand_scene if is_target else classes.arm_scene
    if is_held:
        return None
    if role is SolidRole.OBJECT and is_target:
        return None if part in (Part.FINGER, Part.HELD) else classes.hand_target
    if role is SolidRole.SUPPORT:
        return None if part is Part.HELD and contact_allowed else classes.hand_support
    return classes.hand_scene
