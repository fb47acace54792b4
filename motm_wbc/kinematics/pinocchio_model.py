"""The one place that talks to Pinocchio: forward kinematics in bulk, as plain arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio

from motm_wbc.errors import InputError, Unavailable
from motm_wbc.geometry.arrays import Array
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


class ChainModel:
    """Forward kinematics of a generated URDF: base joints, arm joints, finger joints.

    Joint positions go in by role, one number a joint also for continuous joints, whose
    place in Pinocchio's own vector is a cosine and a sine. One instance must not be used
    by two threads at once: the results live in one workspace until they are copied.
    """

    def __init__(self, urdf: Path, arm_joints: Sequence[str], fingers: Sequence[str]) -> None:
        try:
            self._model = pinocchio.buildModelFromUrdf(str(urdf))
        except (ValueError, RuntimeError) as error:
            reason = str(error).strip().partition("\n")[0]
            raise InputError(f"Pinocchio can't read the robot: {reason}", str(urdf)) from None
        self._data = self._model.createData()
        names = [*BASE_JOINTS, *arm_joints, *fingers]
        joints = [self._model.joints[self._model.getJointId(name)] for name in names]
        self._ids = [int(joint.id) for joint in joints]
        self._n_arm = len(arm_joints)
        # where each joint's number goes in Pinocchio's vector; a continuous one has two places
        turning = np.array([joint.nq == 2 for joint in joints])
        places = np.array([joint.idx_q for joint in joints])
        self._turning = np.flatnonzero(turning)
        self._plain = np.flatnonzero(~turning)
        self._cosines, self._plain_places = places[turning], places[~turning]
        self._q = np.array(pinocchio.neutral(self._model))
        self._columns = np.array([joint.idx_v for joint in joints[3 : 3 + self._n_arm]])
        self._frames = {
            frame.name: (int(frame.parentJoint), np.array(frame.placement.homogeneous))
            for frame in self._model.frames
            if frame.type == pinocchio.FrameType.BODY
        }
        # live views into the workspace: reading them all costs a tenth of asking for each
        self._rotations = [placement.rotation for placement in self._data.oMi]
        self._translations = [placement.translation for placement in self._data.oMi]

    @property
    def joint_count(self) -> int:
        """Number of joint frames that `run` gives, the fixed universe included."""
        return len(self._rotations)

    @property
    def frames(self) -> Mapping[str, tuple[int, Array]]:
        """Name of each link -> the joint frame that it is fixed to, and its (4, 4) pose there."""
        return self._frames

    def moved_by_arm(self, joint: int) -> Array:
        """(n_arm,) 1.0 for each arm joint that moves the joint frame `joint`, else 0.0."""
        support = set(self._model.supports[joint])
        return np.array([float(i in support) for i in self._ids[3 : 3 + self._n_arm]])

    def limits(self) -> JointLimits:
        """Limits of the arm's joints."""
        lower, upper, speed = [], [], []
        for index in self._ids[3 : 3 + self._n_arm]:
            joint = self._model.joints[index]
            turns = joint.nq == 2
            lower.append(-np.inf if turns else self._model.lowerPositionLimit[joint.idx_q])
            upper.append(np.inf if turns else self._model.upperPositionLimit[joint.idx_q])
            speed.append(self._model.velocityLimit[joint.idx_v])
        return JointLimits(np.array(lower), np.array(upper), np.array(speed))

    def check_order(self, where: str) -> None:
        """Make sure that the arm's joints are given from the mount to the tool.

        Raises:
            InputError: they are not.
        """
        ids = self._ids[3 : 3 + self._n_arm]
        if ids != sorted(ids):
            names = [self._model.names[index] for index in sorted(ids)]
            raise InputError(f"the order from mount to tool is {', '.join(names)}", where)

    def run(self, positions: Array) -> tuple[Array, Array, Array]:
        """Forward kinematics.

        Args:
            positions: base x, y [m], yaw [rad], arm joints, fingers.

        Returns:
            (m, 3, 3) rotations and (m, 3) positions [m] of the joint frames in the world,
            and (6, n_arm) the arm's spatial Jacobian: velocity of the point at the world's
            origin, then angular velocity, in world axes. All are copies.
        """
        q = self._q
        q[self._plain_places] = positions[self._plain]
        angles = positions[self._turning]
        q[self._cosines] = np.cos(angles)
        q[self._cosines + 1] = np.sin(angles)
        pinocchio.computeJointJacobians(self._model, self._data, q)
        return (
            np.array(self._rotations),
            np.array(self._translations),
            self._data.J[:, self._columns],
        )
