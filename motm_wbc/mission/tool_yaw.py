"""Which way the gripper is turned for a grasp that has to last while the base drives by.

Seen from the arm's base the object stands at a bearing in the *world* that changes along
the pass. A gripper that stands still turns against that bearing, and the wrist runs out of
range at some offset. The yaw, among those that the object's symmetry makes equal, is the
one whose whole sweep of offsets lies best in the wrist's range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.inverse import solve_ik
from motm_wbc.mission.cylinder import arm_base_position
from motm_wbc.mission.grip import grip_in_tool
from motm_wbc.mission.orientation import top_down, yaw_of

_QUARTER = 0.5 * math.pi
_STRAY = 0.2  # [rad or m] that a preferred joint may be off in a posture that can be held
_SAMPLES = 48  # offsets sampled around the circle


@dataclass(frozen=True, slots=True)
class YawRange:
    """Offsets of the tool's yaw from the bearing that the arm can hold.

    Attributes:
        lower: [rad].
        upper: [rad], above `lower`; the range may lead through pi.
    """

    lower: float
    upper: float

    @property
    def middle(self) -> float:
        """Centre of the range [rad]."""
        return 0.5 * (self.lower + self.upper)


def yaw_range(model: RobotModel, radius: float, height: float) -> YawRange:
    """The offsets at which the tool, straight down, can be held in front of the arm.

    Args:
        model: the robot.
        radius: distance of the tool from the arm's base axis [m].
        height: of the tool above the floor [m].

    Returns:
        The range about the offset of the arm's home posture, walked outward from there,
        so that all of it is reached without changing the arm's branch.
    """
    home = model.configuration(np.zeros(3), model.home)
    offset = yaw_of(home.T_world_tool[:3, :3] @ grip_in_tool(model.description))
    step = math.tau / _SAMPLES
    upper = offset + step * _walk(model, radius, height, offset, step)
    lower = offset - step * _walk(model, radius, height, offset, -step)
    return YawRange(lower, upper)


def choose_yaw(choices: Sequence[float], sweep: Array, allowed: YawRange, current: float) -> float:
    """The yaw whose offsets over the pass lie best within the arm's range.

    Args:
        choices: yaws in the world at which the object can be gripped [rad]; none: any will do.
        sweep: (k,) world bearings of the object from the arm's base along the pass,
            continuous [rad].
        allowed: what the arm can hold.
        current: the tool's yaw now [rad], which wins among equals.

    Returns:
        Yaw in the world [rad].
    """
    centred = 0.5 * (float(sweep.min()) + float(sweep.max())) + allowed.middle
    if not choices:
        return wrap(centred)
    return wrap(min(choices, key=lambda yaw: _strain(yaw, centred, current)))


def yaw_on_the_way(
    goal: float, now: float, goal_bearing: float, bearing: float, allowed: YawRange
) -> float:
    """The yaw to turn to next, so that the wrist turns inside its range, never across its end.

    The shorter way round is not always open to a wrist; its range of offsets tells which is.

    Args:
        goal: yaw that the tool shall have at its target [rad].
        now: its yaw [rad].
        goal_bearing: of the target from the arm's base, in the world [rad].
        bearing: of the tool [rad].
        allowed: what the arm can hold.

    Returns:
        Yaw at most a quarter turn from `now` [rad].
    """
    middle = allowed.middle
    turn = wrap(goal - goal_bearing - middle) - wrap(now - bearing - middle)
    turn += wrap(goal_bearing - bearing)
    return now + min(max(turn, -_QUARTER), _QUARTER)


def bearing_sweep(poses: Array, arm_xy: Array, target_xy: Array, reach: float) -> Array:
    """(k,) world bearings [rad] of a target along a path, where it is in reach.

    Args:
        poses: (n, 3) base poses along the pass.
        arm_xy: (2,) the arm's base axis in the base frame [m].
        target_xy: (2,) the target [m].
        reach: [m].

    Returns:
        Unwrapped bearings; of the nearest pose alone if none is in reach.
    """
    centres = np.array([arm_base_position(pose, arm_xy) for pose in poses])
    away = np.asarray(target_xy) - centres
    distances = np.hypot(away[:, 0], away[:, 1])
    inside = distances <= reach
    if not inside.any():
        inside = distances <= distances.min()
    return np.asarray(np.unwrap(np.arctan2(away[inside, 1], away[inside, 0])))


def _strain(yaw: float, centred: float, current: float) -> float:
    """How far the sweep lies from the middle of the range, with a slight wish to stay."""
    return abs(wrap(yaw - centred)) + 0.05 * abs(wrap(yaw - current))


def _strays(model: RobotModel, q: Array) -> bool:
    """Whether a joint has left its preferred position to win some range for the wrist."""
    preferred = model.posture.weight > 0.0
    return bool((np.abs(q - model.posture.value)[preferred] > _STRAY).any())


def _walk(model: RobotModel, radius: float, height: float, start: float, step: float) -> int:
    """Number of steps that the tool can be turned, each solution leading to the next."""
    R_grip_tool = grip_in_tool(model.description).T
    q = model.home
    for count in range(_SAMPLES):
        target = np.eye(4)
        target[:3, :3] = top_down(start + count * step) @ R_grip_tool
        target[:3, 3] = [model.arm_base_xy[0] + radius, model.arm_base_xy[1], height]
        answer = solve_ik(model, target, q)
        if not answer.converged or _strays(model, answer.q):
            return max(0, count - 1)
        q = answer.q
    return _SAMPLES // 2
