"""State and tasks of one step, taken over into the arrays that the compiled step reads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp.arrays import StateArrays
from motm_wbc.qp.check import State, Tasks
from motm_wbc.qp.describe import input_names
from motm_wbc.qp.objective import PostureArrays, ToolArrays
from motm_wbc.qp.tasks import BaseTask, FreeBase, LinearTask, PostureTask, ToolTask

_NOT_GIVEN = -1.0


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
        self._frames: tuple[str | None, ...] = ()
        self._locked: tuple[str, ...] = ()
        self._width: float | None = -1.0
        self._posture: PostureTask | None = None
        n_base, n_arm = model.n_base, model.n_arm
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
        # views, so that each step only copies
        self._base_pose, self._q = self.state.positions[:3], self.state.positions[3 : 3 + n_arm]
        self._fingers = self.state.positions[3 + n_arm :]
        self._last_base, self._last_arm = self.state.previous[:n_base], self.state.previous[n_base:]

    def take(
        self, state: State, tasks: Tasks, locked: Sequence[str], gripper_width: float | None
    ) -> None:
        """Take over one step's input; see the controller's `step`.

        Where something needs other room, `state` and `tools` are other arrays afterwards.

        Raises:
            ValueError: something has a wrong shape.
            UnknownName: there is no such link or input.
        """
        base_pose, q, previous = state
        base, tools, posture, extra = tasks
        _copy(self._base_pose, base_pose)
        _copy(self._q, q)
        last_base, last_arm = previous
        _copy(self._last_base, last_base)
        _copy(self._last_arm, last_arm)
        if gripper_width != self._width:
            self._take_width(gripper_width)
        self._take_base(base)
        self._take_tools(tools)
        self._take_posture(posture)
        if locked or self._locked:
            self._take_locked(tuple(locked))
        if extra or len(self.state.linear_target):
            self._take_extra(extra)

    def _take_width(self, width: float | None) -> None:
        whole = self._model.description.gripper.max_width if width is None else float(width)
        self._fingers[:] = self._model.finger_positions(whole)
        self._width = width

    def _take_base(self, base: BaseTask) -> None:
        state = self.state
        if not isinstance(base, FreeBase):
            _copy(state.reference, base.reference)
            return
        state.reference[:], state.input_weights[:] = 0.0, 0.0
        if base.inputs is not None:
            _copy(state.reference, base.inputs)
            state.input_weights[:] = 1.0
            if base.input_weights is not None:
                _copy(state.input_weights, base.input_weights)
        state.heading[:] = 0.0
        if base.heading is not None:
            state.heading[:] = base.heading_weight, base.heading_gain, base.heading

    def _take_tools(self, tasks: Sequence[ToolTask]) -> None:
        frames = tuple([task.frame for task in tasks])
        if frames != self._frames:
            self.tools, self._slots = self._empty_tools(frames)
            self._frames = frames
        tools = self.tools
        for slot, task in zip(self._slots, tasks, strict=True):
            _copy(tools.twist[slot], task.twist)
            _copy(tools.acceleration[slot], task.acceleration)
            _copy(tools.weights[slot], task.weights)
            _copy(tools.axes[slot], task.R_world_task)
            target = task.T_world_target
            tools.has_target[slot] = target is not None
            if target is not None:
                _copy(tools.target[slot], target)
            tools.gain[slot] = task.gain
            error = task.position_error
            tools.position_error[slot] = _NOT_GIVEN if error is None else error

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

    def _take_posture(self, task: PostureTask | None) -> None:
        posture = self.posture
        if task is None:
            if self._posture is not None:
                posture.target[:], posture.weights[:] = 0.0, 0.0
                posture.lower[:], posture.upper[:] = -np.inf, np.inf
        else:
            _copy(posture.target, task.target)
            _copy(posture.weights, task.weights)
            for room, bound, none in (
                (posture.lower, task.lower, -np.inf),
                (posture.upper, task.upper, np.inf),
            ):
                if bound is None:
                    room[:] = none
                else:
                    _copy(room, bound)
        self._posture = task

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
        self.state = self.state._replace(
            linear_J=np.ascontiguousarray(J), linear_target=target, linear_weights=weights
        )


def _copy(room: Array, values: Array) -> None:
    """Write values into `room`; they must have its shape."""
    try:
        shape = values.shape
    except AttributeError:
        values = np.asarray(values)
        shape = values.shape
    if shape != room.shape:
        raise ValueError
    room[...] = values
