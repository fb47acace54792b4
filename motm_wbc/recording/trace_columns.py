"""The columns of a trace: name, unit, meaning, and where the value comes from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import BaseReport, GroundTruth, StepReport

Kind: TypeAlias = Literal["number", "count", "flag", "word", "words"]


@dataclass(frozen=True, slots=True)
class Sample:
    """One control step.

    Attributes:
        truth: the plant's state.
        report: what was decided then.
        goal: (3,) the base's goal that is in force, or None.
    """

    truth: GroundTruth
    report: StepReport
    goal: Array | None


@dataclass(frozen=True, slots=True)
class Column:
    """One column.

    Attributes:
        name: unique in its table.
        unit: for example `m/s`; empty where there is none.
        meaning: one line.
        kind: what its values are.
        value: takes it from a sample; None is stored as null.
    """

    name: str
    unit: str
    meaning: str
    kind: Kind
    value: Callable[[Sample], Any]

    def field(self) -> Any:
        """The column's `pyarrow.Field`."""
        return arrow_field(self.name, self.unit, self.meaning, self.kind)


def arrow_field(name: str, unit: str, meaning: str, kind: Kind = "number") -> Any:
    """A `pyarrow.Field` with unit and meaning in its metadata."""
    import pyarrow as pa

    types = {
        "number": pa.float64(),
        "count": pa.int64(),
        "flag": pa.bool_(),
        "word": pa.string(),
        "words": pa.list_(pa.string()),
    }
    return pa.field(name, types[kind], metadata={"unit": unit, "meaning": meaning})


def columns(arm_joints: Sequence[str], base_inputs: Sequence[str]) -> list[Column]:
    """All columns but those of objects, moving solids and distances.

    Args:
        arm_joints: n names.
        base_inputs: names of the base's inputs, the last is the turn rate.
    """
    return [
        Column("time", "s", "simulated time", "number", lambda s: s.report.time),
        *_base_columns(base_inputs),
        *_arm_columns(arm_joints),
        *_tool_columns(),
        *_goal_columns(),
        *_progress_columns(),
        *_search_columns(),
    ]


def _item(pick: Callable[[Sample], Array], index: int) -> Callable[[Sample], float]:
    return lambda sample: float(pick(sample)[index])


def _target_item(axis: int) -> Callable[[Sample], float | None]:
    def value(sample: Sample) -> float | None:
        target = sample.report.T_world_target
        return None if target is None else float(target[axis, 3])

    return value


def _goal_item(index: int) -> Callable[[Sample], float | None]:
    return lambda sample: None if sample.goal is None else float(sample.goal[index])


def _base_columns(inputs: Sequence[str]) -> list[Column]:
    pose = (("base_x", "m"), ("base_y", "m"), ("base_heading", "rad"))
    result = [
        Column(name, unit, "true pose of the base", "number", _item(_base_pose, k))
        for k, (name, unit) in enumerate(pose)
    ]
    sources = (
        ("", "true velocity of the base in its frame", _base_velocity),
        ("_command", "base input sent to the plant", _base_command),
        ("_reference", "base input that navigation asked for", _base_reference),
    )
    for suffix, meaning, pick in sources:
        for k, name in enumerate(inputs):
            unit = "rad/s" if name == inputs[-1] else "m/s"
            result.append(Column(f"base_{name}{suffix}", unit, meaning, "number", _item(pick, k)))
    return result


def _arm_columns(joints: Sequence[str]) -> list[Column]:
    sources = (
        ("q", "rad or m", "true joint position", _q),
        ("v", "rad/s or m/s", "true joint velocity", _v),
        ("v_command", "rad/s or m/s", "joint velocity sent to the plant", _arm_command),
    )
    return [
        Column(f"{prefix}_{joint}", unit, meaning, "number", _item(pick, k))
        for prefix, unit, meaning, pick in sources
        for k, joint in enumerate(joints)
    ]


def _tool_columns() -> list[Column]:
    target = [
        Column(
            f"tool_target_{axis}",
            "m",
            "place that the tool is after, in the world",
            "number",
            _target_item(k),
        )
        for k, axis in enumerate("xyz")
    ]
    return [
        *target,
        Column(
            "tool_error",
            "m",
            "distance from tool to target, NaN without a target",
            "number",
            lambda s: float(s.report.tool_error),
        ),
        Column(
            "gripper_width",
            "m",
            "true distance between the fingers",
            "number",
            lambda s: float(s.truth.gripper_width),
        ),
        Column(
            "gripper_command",
            "m",
            "distance that the fingers shall move to",
            "number",
            lambda s: float(s.report.command.gripper_width),
        ),
        Column("held", "", "name of the object in the gripper", "word", lambda s: s.truth.held),
    ]


def _goal_columns() -> list[Column]:
    return [
        Column(
            f"goal_{name}",
            unit,
            "pose that the base is driven to, null if it stands",
            "number",
            _goal_item(k),
        )
        for k, (name, unit) in enumerate((("x", "m"), ("y", "m"), ("heading", "rad")))
    ]


def _progress_columns() -> list[Column]:
    return [
        Column("step_index", "", "step of the task", "count", lambda s: s.report.step_index),
        Column("stage", "", "what the mission is at", "word", lambda s: s.report.stage),
        Column("rung", "", "rung of the controller's ladder", "word", lambda s: s.report.rung),
        Column(
            "active",
            "",
            "limits that held the command back",
            "words",
            lambda s: list(s.report.active),
        ),
        Column(
            "arm_step_s",
            "s",
            "wall time of the arm's step",
            "number",
            lambda s: float(s.report.compute_time),
        ),
    ]


def _search_columns() -> list[Column]:
    def of_base(pick: Callable[[BaseReport], Any]) -> Callable[[Sample], Any]:
        return lambda sample: None if sample.report.base is None else pick(sample.report.base)

    return [
        Column(
            "base_step_s",
            "s",
            "wall time of the base's step, null if there was none",
            "number",
            of_base(lambda base: float(base.compute_time)),
        ),
        Column(
            "selected",
            "",
            "index of the chosen candidate, -1 for none",
            "count",
            of_base(lambda base: int(base.selected)),
        ),
        Column(
            "selected_cost",
            "s",
            "cost of the chosen candidate",
            "number",
            of_base(lambda base: float(base.costs[base.selected]) if base.selected >= 0 else None),
        ),
        Column(
            "expansions",
            "",
            "nodes that the local search expanded",
            "count",
            of_base(lambda base: int(base.expansions)),
        ),
        Column(
            "clock_guard_fired",
            "",
            "the local search was ended by the clock",
            "flag",
            of_base(lambda base: bool(base.clock_guard_fired)),
        ),
    ]


def _base_pose(sample: Sample) -> Array:
    return sample.truth.base_pose


def _base_velocity(sample: Sample) -> Array:
    return sample.truth.base_velocity


def _base_command(sample: Sample) -> Array:
    return sample.report.command.base


def _base_reference(sample: Sample) -> Array:
    return sample.report.base_reference


def _arm_command(sample: Sample) -> Array:
    return sample.report.command.arm


def _q(sample: Sample) -> Array:
    return sample.truth.q


def _v(sample: Sample) -> Array:
    return sample.truth.v
