"""Whether a step's input can be used at all: a control loop must answer, not raise."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp.tasks import BaseTask, HeldObject, PostureTask, ToolTask


def what_is_unusable(
    model: RobotModel,
    state: tuple[Array, Array, tuple[Array, Array]],
    tool: ToolTask | None,
    base: BaseTask,
    posture: PostureTask | None,
    held: HeldObject | None,
    gripper_width: float | None,
) -> str:
    """One line about the first input that is of a wrong size or no number; empty if none is.

    Args:
        model: the robot.
        state: base pose, joint positions, last commanded base inputs and joint velocities.
        tool: tool task.
        base: base task.
        posture: posture task.
        held: held object.
        gripper_width: [m].
    """
    base_pose, q, (last_base, last_arm) = state
    quantities: list[tuple[str, Array, tuple[int, ...]]] = [
        ("base_pose", base_pose, (3,)),
        ("q", q, (model.n_arm,)),
        ("previous base inputs", last_base, (model.n_base,)),
        ("previous joint velocities", last_arm, (model.n_arm,)),
        ("base reference", base.reference, (model.n_base,)),
    ]
    if tool is not None:
        quantities += [
            ("tool twist", tool.twist, (6,)),
            ("tool weights", tool.weights, (6,)),
            ("R_world_task", tool.R_world_task, (3, 3)),
        ]
    if posture is not None:
        quantities += [
            ("posture target", posture.target, (model.n_arm,)),
            ("posture weights", posture.weights, (model.n_arm,)),
        ]
    if held is not None:
        quantities += [
            ("size of the held object", held.size, (3,)),
            ("T_tool_held", held.T_tool_held, (4, 4)),
        ]
    numbers = [gripper_width, None if tool is None else tool.position_error]
    return next(_complaints(quantities, posture, numbers), "")


def usable(values: Array, count: int) -> bool:
    """Whether `values` are `count` finite numbers."""
    array = np.asarray(values)
    return array.shape == (count,) and array.dtype.kind in "fiu" and bool(np.isfinite(array).all())


def _complaints(
    quantities: list[tuple[str, Array, tuple[int, ...]]],
    posture: PostureTask | None,
    numbers: list[float | None],
) -> Iterator[str]:
    for name, values, shape in quantities:
        array = np.asarray(values)
        if array.shape != shape:
            yield f"{name} has the shape {array.shape}, needs {shape}"
        elif array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            yield f"{name} is not finite"
    for bound in () if posture is None else (posture.lower, posture.upper):
        if bound is not None and (
            np.shape(bound) != np.shape(posture.target if posture else 0) or np.isnan(bound).any()
        ):
            yield "a preferred bound of the posture is not a number for each joint"
    for number in numbers:
        if number is not None and not math.isfinite(number):
            yield "gripper width or position error is not finite"
