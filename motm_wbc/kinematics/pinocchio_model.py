"""The one place that talks to Pinocchio: it reads a URDF, once, into plain arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio

from motm_wbc.errors import InputError, Unavailable
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.chain import FIXED, SLIDING, TURNING, Chain
from motm_wbc.kinematics.urdf import BASE_JOINTS

if not hasattr(pinocchio, "buildModelFromUrdf"):
    raise Unavailable(
        "the module 'pinocchio' that is installed is another package; "
        "uninstall it and install 'pin' (pip install pin)",
        "pinocchio",
    )


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What the URDF says of some joints; (n,) each.

    Attributes:
        lower: positions [rad or m], -inf for continuous joints.
        upper: positions, +inf for continuous joints.
        speed: [rad/s or m/s], inf where there is none.
    """

    lower: Array
    upper: Array
    speed: Array


@dataclass(frozen=True, slots=True)
class UrdfModel:
    """What a generated URDF says of a robot.

    Attributes:
        chain: base joints, arm joints and finger joints.
        frames: name of each link -> the joint frame that it is fixed to, and its (4, 4) pose
            there.
        limits: of the arm's joints.
        joint_names: (m,) names of the joint frames.
    """

    chain: Chain
    frames: Mapping[str, tuple[int, Array]]
    limits: JointLimits
    joint_names: tuple[str, ...]


def read_model(urdf: Path, arm_joints: Sequence[str], fingers: Sequence[str]) -> UrdfModel:
    """Read a generated URDF.

    Args:
        urdf: the file.
        arm_joints: names of the arm's joints.
        fingers: names of the finger joints.

    Raises:
        InputError: Pinocchio can't read the file.
    """
    try:
        model = pinocchio.buildModelFromUrdf(str(urdf))
    except (ValueError, RuntimeError) as error:
        reason = str(error).strip().partition("\n")[0]
        raise InputError(f"Pinocchio can't read the robot: {reason}", str(urdf)) from None
    frames = {
        frame.name: (int(frame.parentJoint), np.array(frame.placement.homogeneous))
        for frame in model.frames
        if frame.type == pinocchio.FrameType.BODY
    }
    chain = _chain(model, [*BASE_JOINTS, *arm_joints, *fingers])
    return UrdfModel(chain, frames, _limits(model, arm_joints), tuple(model.names))


def _chain(model: Any, roles: Sequence[str]) -> Chain:
    """The tree of joints; `roles` names the joints in the order of the vector of positions."""
    kinds, axes, sources = [FIXED], [np.zeros(3)], [-1]
    neutral = pinocchio.neutral(model)
    for index in range(1, model.njoints):
        linear, angular = _joint_axis(model.joints[index], neutral)
        kinds.append(TURNING if angular.any() else SLIDING)
        axes.append(angular if angular.any() else linear)
        sources.append(roles.index(model.names[index]))
    return Chain(
        parent=np.array(list(model.parents), dtype=np.intp),
        kind=np.array(kinds, dtype=np.intp),
        rotation=np.array([placement.rotation for placement in model.jointPlacements]),
        translation=np.array([placement.translation for placement in model.jointPlacements]),
        axis=np.array(axes),
        source=np.array(sources, dtype=np.intp),
    )


def _joint_axis(joint: Any, neutral: Array) -> tuple[Array, Array]:
    """(3,) linear and (3,) angular velocity of a joint at unit speed, in its own frame."""
    data = joint.createData()
    joint.calc(data, neutral)
    motion = np.array(data.S, dtype=float).reshape(6)
    return motion[:3], motion[3:]


def _limits(model: Any, arm_joints: Sequence[str]) -> JointLimits:
    lower, upper, speed = [], [], []
    for joint in (model.joints[model.getJointId(name)] for name in arm_joints):
        turns_without_end = joint.nq == 2
        lower.append(-np.inf if turns_without_end else model.lowerPositionLimit[joint.idx_q])
        upper.append(np.inf if turns_without_end else model.upperPositionLimit[joint.idx_q])
        speed.append(model.velocityLimit[joint.idx_v])
    return JointLimits(np.array(lower), np.array(upper), np.array(speed))
