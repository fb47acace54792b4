"""Whether a step's input can be used at all: a control loop must answer, not raise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp.tasks import (
    BaseTask,
    FreeBase,
    HeldObject,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
)

State: TypeAlias = tuple[Array, Array, tuple[Array, Array]]
"""Base pose, joint positions, last commanded base inputs and joint velocities."""
Tasks: TypeAlias = tuple[BaseTask, Sequence[ToolTask], PostureTask | None, Sequence[LinearTask]]
"""Base task, tool tasks, posture task, tasks of the user's own."""
Quantity: TypeAlias = tuple[str, Any, tuple[int, ...]]


def what_is_unusable(
    model: RobotModel,
    state: State,
    tasks: Tasks,
    held: HeldObject | None,
    gripper_width: float | None,
) -> str:
    """One line about the first input that is of a wrong size or no number; empty if none is.

    Args:
        model: the robot.
        state: of the robot.
        tasks: of the step.
        held: held object.
        gripper_width: [m].
    """
    base, tools, posture, extra = tasks
    try:
        quantities = [
            *_of_state(model, state),
            *_of_base(model, base),
            *(quantity for task in tools for quantity in _of_tool(task)),
            *_of_posture(model, posture),
            *_of_extra(model, extra),
            *_of_held(held),
            *_number("gripper width", gripper_width),
        ]
        return next(_complaints(quantities), "") or next(_not_numbers(posture), "")
    except Exception as error:  # whatever it is: a control loop goes on with a reason
        return f"an argument is of a wrong kind: {error}"


def usable(values: Any, count: int) -> bool:
    """Whether `values` are `count` finite numbers."""
    try:
        return next(_complaints([("", values, (count,))]), None) is None
    except Exception:  # whatever an array of somebody's own raises
        return False


def _of_state(model: RobotModel, state: State) -> Iterator[Quantity]:
    base_pose, q, (last_base, last_arm) = state
    yield "base_pose", base_pose, (3,)
    yield "q", q, (model.n_arm,)
    yield "previous base inputs", last_base, (model.n_base,)
    yield "previous joint velocities", last_arm, (model.n_arm,)


def _of_base(model: RobotModel, base: BaseTask) -> Iterator[Quantity]:
    if isinstance(base, NavigatedBase):
        yield "base reference", base.reference, (model.n_base,)
    elif isinstance(base, FreeBase):
        for name, values in (("inputs", base.inputs), ("input weights", base.input_weights)):
            if values is not None:
                yield f"preferred base {name}", values, (model.n_base,)
        yield from _number("heading", base.heading)
        yield from _number("heading weight", base.heading_weight)
        yield from _number("heading gain", base.heading_gain)
    else:
        raise TypeError(f"base is a {type(base).__name__}, not NavigatedBase or FreeBase")


def _of_tool(task: ToolTask) -> Iterator[Quantity]:
    yield "tool twist", task.twist, (6,)
    yield "tool acceleration", task.acceleration, (6,)
    yield "tool weights", task.weights, (6,)
    yield "R_world_task", task.R_world_task, (3, 3)
    if task.T_world_target is not None:
        yield "T_world_target", task.T_world_target, (4, 4)
    yield from _number("tool gain", task.gain)
    yield from _number("position error", task.position_error)


def _of_posture(model: RobotModel, posture: PostureTask | None) -> Iterator[Quantity]:
    if posture is not None:
        yield "posture target", posture.target, (model.n_arm,)
        yield "posture weights", posture.weights, (model.n_arm,)


def _of_extra(model: RobotModel, extra: Sequence[LinearTask]) -> Iterator[Quantity]:
    for task in extra:
        rows = len(task.target)
        yield "J of an extra task", task.J, (rows, model.n_base + model.n_arm)
        yield "target of an extra task", task.target, (rows,)
        yield "weights of an extra task", task.weights, (rows,)


def _of_held(held: HeldObject | None) -> Iterator[Quantity]:
    if held is not None:
        yield "size of the held object", held.size, (3,)
        yield "T_tool_held", held.T_tool_held, (4, 4)


def _number(name: str, value: float | None) -> Iterator[Quantity]:
    if value is not None:
        yield name, value, ()


def _complaints(quantities: Sequence[Quantity]) -> Iterator[str]:
    for name, values, shape in quantities:
        array = np.asarray(values)
        if array.shape != shape:
            yield f"{name} has the shape {array.shape}, needs {shape}"
        elif array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            yield f"{name} is not finite"
        elif "weight" in name and (array < 0).any():
            yield f"{name} must not be negative"


def _not_numbers(posture: PostureTask | None) -> Iterator[str]:
    """Preferred bounds may be infinite, but must be numbers."""
    for bound in () if posture is None else (posture.lower, posture.upper):
        if bound is not None and (
            np.shape(bound) != np.shape(posture.target if posture else 0)
            or any(math.isnan(value) for value in np.asarray(bound, dtype=float))
        ):
            yield "a preferred bound of the posture is not a number for each joint"
