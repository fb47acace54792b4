"""Which pairs of bodies the audit looks at."""

from __future__ import annotations

import numpy as np

from motm_wbc.audit.broad_phase import Mask
from motm_wbc.audit.robot import RobotBodies, RobotBody
from motm_wbc.audit.scene import SceneBodies, SceneBody
from motm_wbc.kinematics.description import Part
from motm_wbc.kinematics.pairs import SolidRole, classify


def checked_pairs(robot: RobotBodies, scene: SceneBodies, held: str | None) -> Mask:
    """Pairs of the robot's bodies and the scene's that must not touch.

    The last row is the held object's, as a part of the robot; all false if none is held.
    Legal are: fingers at objects, which are all there to be picked; the hand at what it
    holds; the last links of the arm, next to the hand, at what it holds. Whether a held
    object may touch a support depends on heights and is decided contact by contact.

    Returns:
        (p + 1, s) true where contact is a collision.
    """
    mask = np.zeros((len(robot.bodies) + 1, len(scene.bodies)), dtype=bool)
    for j, solid in enumerate(scene.bodies):
        is_held = solid.name == held
        for i, body in enumerate(robot.bodies):
            mask[i, j] = _is_checked(body, solid, is_held, robot.hand_level)
        if held is not None and not is_held:
            mask[-1, j] = classify(Part.HELD, solid.role) is not None
    return mask


def _is_checked(body: RobotBody, solid: SceneBody, is_held: bool, hand_level: int) -> bool:
    if body.part is None:
        return True
    if body.part is Part.ARM and is_held and hand_level - body.level < 3:
        return False
    is_target = solid.role is SolidRole.OBJECT
    return classify(body.part, solid.role, is_target=is_target, is_held=is_held) is not None


def may_rest(held: SceneBody, support: SceneBody, lift: float) -> bool:
    """Whether a held object touches a support legally: it stands on it, or nearly."""
    return abs(held.lowest() - support.top) <= lift
