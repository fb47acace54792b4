"""State and tasks of one step, taken over into the arrays that the compiled step reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba import types

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import strict
from motm_wbc.geometry.views import AddressTable, reader
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp.arrays import PROTOTYPE, StateArrays
from motm_wbc.qp.check import State, Tasks
from motm_wbc.qp.describe import input_names
from motm_wbc.qp.objective import PostureArrays, ToolArrays
from motm_wbc.qp.tasks import (
    BaseTask,
    FreeBase,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
)

_NOT_GIVEN = -1.0
_NO_TARGET = np.zeros((4, 4))
Task = TypeVar("Task", bound=ToolTask | PostureTask | NavigatedBase | FreeBase)


class InputArrays:
    """Room for state and tasks; the robot's own tool is always tool 0.

    Attributes:
        state: of the robot.
        tools: tool tasks.
        posture: posture task.

    Args:
        model: the robot.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._names = input_names(model)
        self._start_anew()

    def _start_anew(self) -> None:
        """Empty room, as nothing had been taken over yet."""
        model = self._model
        self._frames: tuple[str | None, ...] = ()
        self._locked: tuple[str, ...] = ()
        self._width: float | None = -1.0
        self._has_posture = self._base_preferred = False
        n_base, n_arm = model.n_base, model.n_arm
        self._no_lower, self._no_upper = np.full(n_arm, -np.inf), np.full(n_arm, np.inf)
        self._no_inputs = np.zeros(n_base)
        count, frames = n_base + n_arm, len(model.chain.parent)
        self.posture = PostureArrays(
            np.zeros(n_arm), np.zeros(n_arm), np.full(n_arm, -np.inf), np.full(n_arm, np.inf)
        )
        self.tools, self._slots = self._empty_tools(())
        self.state = StateArrays(
            positions=np.zeros(3 + n_arm + len(model.finger_joints)),
            previous=np.zeros(count),
            reference=np.zeros(n_base),
            input_weights=np.zeros(n_base),
            heading=np.zeros(3),
            locked=np.zeros(count),
            linear_J=np.zeros((0, count)),
            linear_target=np.zeros(0),
            linear_weights=np.zeros(0),
            passed=np.zeros(n_arm),
            lead=np.zeros(n_base),
            rotations=np.zeros((frames, 3, 3)),
            translations=np.zeros((frames, 3)),
            J_world=np.zeros((6, count)),
            gradient=np.zeros(n_arm),
            bias=np.zeros(6),
            H=np.zeros((count, count)),
            f=np.zeros(count),
        )
        self._name_arrays()
        self._whole = True

    def take(
        self, state: State, tasks: Tasks, locked: Sequence[str], gripper_width: float | None
    ) -> None:
        """Take over one step's input; see the controller's `step`.

        Where something needs other room, `state` and `tools` are other arrays afterwards.

        Raises:
            Exception: of many kinds, if something has a wrong shape or type.
        """
        if not self._whole:  # what was interrupted, or refused, left something half done
            self._start_anew()
        self._whole = False
        base, tools, posture, extra = tasks
        if gripper_width != self._width:
            self._take_width(gripper_width)
        frames = tuple([task.frame for task in tools])
        if frames != self._frames:
            self.tools, self._slots = self._empty_tools(frames)
            self._name_arrays()
            self._frames = frames
        try:
            self._take_arrays(state, base, tools, posture)
        except TypeError:  # lists, integers and the like: legal, but not at full speed
            self._take_arrays(*_as_floats(state, base, tools, posture))
        if locked or self._locked:
            self._take_locked((locked,) if isinstance(locked, str) else tuple(locked))
        if extra or len(self.state.linear_target):
            self._take_extra(extra)
        self._whole = True

    def _name_arrays(self) -> None:
        """Where the compiled copying writes to."""
        room = _Room(self.state, self.tools, self.posture)
        self._table, self._room = _TABLE.write(room), room  # which keeps the arrays alive

    def _take_arrays(
        self,
        state: State,
        base: BaseTask,
        tools: Sequence[ToolTask],
        posture: PostureTask | None,
    ) -> None:
        base_pose, q, (last_base, last_arm) = state
        reference = self._preferred(base) if isinstance(base, FreeBase) else base.reference
        fits = take_state(self._table, base_pose, q, last_base, last_arm, reference)
        for slot, task in zip(self._slots, tools, strict=True):
            target, error = task.T_world_target, task.position_error
            fits &= take_tool(
                self._table, slot, task.twist, task.acceleration, task.weights,
                task.R_world_task, _NO_TARGET if target is None else target, target is not None,
                task.gain, _NOT_GIVEN if error is None else error,
            )  # fmt: skip
        if posture is not None:
            lower = self._no_lower if posture.lower is None else posture.lower
            upper = self._no_upper if posture.upper is None else posture.upper
            fits &= take_posture(self._table, posture.target, posture.weights, lower, upper)
        elif self._has_posture:
            self.posture.target[:], self.posture.weights[:] = 0.0, 0.0
            self.posture.lower[:], self.posture.upper[:] = self._no_lower, self._no_upper
        self._has_posture = posture is not None
        if not fits:
            raise ValueError("an array has a wrong shape")

    def _preferred(self, base: FreeBase) -> Array:
        """Take over what a free base prefers; returns its inputs."""
        prefers = base.inputs is not None or base.heading is not None
        if not prefers and not self._base_preferred:
            return self._no_inputs
        self._base_preferred = prefers
        state, inputs = self.state, base.inputs
        weights = 1.0 if base.input_weights is None else base.input_weights
        state.input_weights[:] = 0.0 if inputs is None else weights
        state.heading[:] = 0.0
        if base.heading is not None:
            state.heading[:] = base.heading_weight, base.heading_gain, base.heading
        return self._no_inputs if inputs is None else inputs

    def _take_width(self, width: float | None) -> None:
        most = self._model.description.gripper.max_width
        whole = most if width is None else min(max(float(width), 0.0), most)
        self.state.positions[3 + self._model.n_arm :] = self._model.finger_positions(whole)
        self._width = width

    def _empty_tools(self, frames: tuple[str | None, ...]) -> tuple[ToolArrays, list[int]]:
        """Room for tasks of these frames, and the tool that each task is for.

        The first task of the robot's own tool is tool 0.
        """
        model, count = self._model, self._model.n_base + self._model.n_arm
        own = frames.index(None) if None in frames else -1
        slots: list[int] = []
        links: list[str | None] = [None]
        for index, frame in enumerate(frames):
            slots.append(0 if index == own else len(links))
            if index != own:
                links.append(frame)
        places = [model.tool_frame if link is None else model.frame(link) for link in links]
        t = len(links)
        moved_by = [np.append(np.ones(model.n_base), model.moved_by_arm(j)) for j, _ in places]
        arrays = ToolArrays(
            joint=np.array([joint for joint, _ in places], dtype=np.int64),
            placement=np.array([placement for _, placement in places]),
            moved_by=np.array(moved_by),
            twist=np.zeros((t, 6)),
            acceleration=np.zeros((t, 6)),
            target=np.zeros((t, 4, 4)),
            has_target=np.zeros(t),
            gain=np.zeros(t),
            weights=np.zeros((t, 6)),
            axes=np.tile(np.eye(3), (t, 1, 1)),
            position_error=np.full(t, _NOT_GIVEN),
            pose=np.tile(np.eye(4), (t, 1, 1)),
            J=np.zeros((t, 6, count)),
            wanted=np.zeros((t, 6)),
            scaled=np.zeros((6, count)),
        )
        return arrays, slots

    def _take_locked(self, locked: tuple[str, ...]) -> None:
        for name in locked:
            if name not in self._names:
                raise UnknownName("input", name, self._names, self._model.name)
        self.state.locked[:] = [name in locked for name in self._names]
        self._locked = locked

    def _take_extra(self, extra: Sequence[LinearTask]) -> None:
        count = self.state.J_world.shape[1]
        J = np.concatenate([np.zeros((0, count)), *(np.asarray(task.J, float) for task in extra)])
        target = np.concatenate([np.zeros(0), *(np.asarray(task.target, float) for task in extra)])
        weights = np.concatenate([np.zeros(0), *(np.asarray(t.weights, float) for t in extra)])
        if not J.shape == (len(target), count) or len(weights) != len(target):
            raise ValueError("J, target and weights of an extra task don't fit each other")
        if J.shape == self.state.linear_J.shape:
            self.state.linear_J[:], self.state.linear_target[:] = J, target
            self.state.linear_weights[:] = weights
            return
        self.state = self.state._replace(
            linear_J=np.ascontiguousarray(J), linear_target=target, linear_weights=weights
        )
        self._name_arrays()


class _Room(NamedTuple):
    """What the compiled copying writes to."""

    state: StateArrays
    tools: ToolArrays
    posture: PostureArrays


_ROOM = _Room(PROTOTYPE.state, PROTOTYPE.tools, PROTOTYPE.posture)
_TABLE = AddressTable(_ROOM)
_read = reader(_ROOM)
_table = types.Array(types.int64, 1, "C")
# of any strides, and read-only ones, too
_vector = types.Array(types.float64, 1, "A", readonly=True)
_matrix = types.Array(types.float64, 2, "A", readonly=True)


@strict(_table, _vector, _vector, _vector, _vector, _vector)
def take_state(
    table: IntArray, base_pose: Array, q: Array, last_base: Array, last_arm: Array, reference: Array
) -> bool:
    """Copy the state; whether all shapes fit."""
    state = _read(table).state
    n_base, n_arm = len(state.reference), len(state.gradient)
    if len(base_pose) != 3 or len(q) != n_arm or len(last_arm) != n_arm:
        return False
    if len(last_base) != n_base or len(reference) != n_base:
        return False
    for i in range(3):
        state.positions[i] = base_pose[i]
    for i in range(n_arm):
        state.positions[3 + i], state.previous[n_base + i] = q[i], last_arm[i]
    for i in range(n_base):
        state.previous[i], state.reference[i] = last_base[i], reference[i]
    return True


@strict(
    _table, types.int64, _vector, _vector, _vector, _matrix, _matrix, types.boolean,
    types.float64, types.float64,
)  # fmt: skip
def take_tool(
    table: IntArray,
    slot: int,
    twist: Array,
    acceleration: Array,
    weights: Array,
    axes: Array,
    target: Array,
    has_target: bool,
    gain: float,
    error: float,
) -> bool:
    """Copy a tool task; whether all shapes fit."""
    tools = _read(table).tools
    if len(twist) != 6 or len(acceleration) != 6 or len(weights) != 6:
        return False
    if axes.shape != (3, 3) or target.shape != (4, 4):
        return False
    for i in range(6):
        tools.twist[slot, i], tools.weights[slot, i] = twist[i], weights[i]
        tools.acceleration[slot, i] = acceleration[i]
    for i in range(3):
        for j in range(3):
            tools.axes[slot, i, j] = axes[i, j]
    for i in range(4):
        for j in range(4):
            tools.target[slot, i, j] = target[i, j]
    tools.has_target[slot] = 1.0 if has_target else 0.0
    tools.gain[slot], tools.position_error[slot] = gain, error
    return True


@strict(_table, _vector, _vector, _vector, _vector)
def take_posture(
    table: IntArray, target: Array, weights: Array, lower: Array, upper: Array
) -> bool:
    """Copy a posture task; whether all shapes fit."""
    posture = _read(table).posture
    n = len(posture.target)
    if len(target) != n or len(weights) != n or len(lower) != n or len(upper) != n:
        return False
    for i in range(n):
        posture.target[i], posture.weights[i] = target[i], weights[i]
        posture.lower[i], posture.upper[i] = lower[i], upper[i]
    return True


def _as_floats(
    state: State, base: BaseTask, tools: Sequence[ToolTask], posture: PostureTask | None
) -> tuple[State, BaseTask, Sequence[ToolTask], PostureTask | None]:
    """The same with all arrays as arrays of floats."""
    base_pose, q, (last_base, last_arm) = state
    return (
        (_floats(base_pose), _floats(q), (_floats(last_base), _floats(last_arm))),
        _with_floats(base),
        [_with_floats(task) for task in tools],
        None if posture is None else _with_floats(posture),
    )


def _floats(values: Any) -> Array:
    return np.array(values, dtype=float)


def _with_floats(task: Task) -> Task:
    """A task whose arrays and numbers are floats."""
    values: dict[str, Any] = {field.name: getattr(task, field.name) for field in fields(task)}
    for name, value in values.items():
        if value is not None and not isinstance(value, str):
            values[name] = _floats(value) if np.ndim(value) else float(value)
    return replace(task, **values)
