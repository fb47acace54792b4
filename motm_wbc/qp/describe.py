"""Limits by name: which of them hold a command back, and a summary of all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import IntArray
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.parameters import PairClass
from motm_wbc.qp.answer import FREE
from motm_wbc.qp.arrays import StateArrays
from motm_wbc.qp.dampers import approach_speed
from motm_wbc.qp.nearby import PairNames
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import Limit, QpProblem
from motm_wbc.qp.selection import NO_PAIR

_WORDS = {
    Limit.SPEED: "velocity",
    Limit.POSITION: "position",
    Limit.ACCELERATION: "acceleration",
    Limit.LOCK: "locked",
}


class Situation(NamedTuple):
    """What a command is held back by, in numbers; names are made when somebody asks.

    Attributes:
        report: as `read_answer` writes it.
        inputs: (n_inputs,) names of the inputs.
        pairs: names of the pairs.
    """

    report: IntArray
    inputs: tuple[str, ...]
    pairs: PairNames

    def active(self) -> tuple[str, ...]:
        """Names of the limits and pairs that the command is at."""
        codes, rows = self.report[: len(self.inputs)].tolist(), self._rows()
        limits = [
            f"{name} {_WORDS[Limit(code)]}"
            for name, code in zip(self.inputs, codes, strict=True)
            if code != FREE
        ]
        return (*limits, *(self.pairs.of(i, j) for code, i, j in rows if code != FREE))

    def closest(self) -> str:
        """Name of the closest pair, empty if there is none."""
        first, second = self.report[len(self.inputs) : len(self.inputs) + 2].tolist()
        return "" if first == NO_PAIR else self.pairs.of(first, second)

    def _rows(self) -> list[list[int]]:
        rows: list[list[int]] = self.report[len(self.inputs) + 2 :].reshape(-1, 3).tolist()
        return rows


def passed_accelerations(state: StateArrays, problem: QpProblem, joints: tuple[str, ...]) -> str:
    """Which joints have to pass their acceleration limits for which limit, and by how much."""
    parts, n = [], len(problem.f)
    for index in np.flatnonzero(state.passed).tolist():
        k = n - len(joints) + index
        fast = state.previous[index - len(joints)] > problem.box_upper[k]
        kind = Limit(int((problem.upper_kind if fast else problem.lower_kind)[k]))
        parts.append(
            f"{kind.name.lower()} of {joints[index]} against acceleration of {joints[index]}, "
            f"which gave way by {state.passed[index]:.2g}"
        )
    return "; ".join(parts)


def input_names(model: RobotModel) -> tuple[str, ...]:
    """Names of the inputs: the base's, then the arm's joints."""
    return (*(f"base {name}" for name in model.base_kind.inputs), *model.arm_joints)


def limits_summary(model: RobotModel, dt: float, parameters: WholeBodyParameters) -> str:
    """A table: bounds of every degree of freedom, base included, and of the pairs' dampers."""
    base = model.base_limits
    lines = [f"limits of {model.name}, control step {dt:g} s", "base"]
    drive = f"  speed {-base.v_reverse:g} .. {base.v_max:g} m/s, acceleration {base.a_max:g} m/s^2"
    turn = f"  speed +-{base.omega_max:g} rad/s, acceleration {base.alpha_max:g} rad/s^2"
    for name in model.base_kind.inputs:
        sideways = drive.replace(f"{-base.v_reverse:g} ..", f"{-base.v_max:g} ..")
        text = {"omega": turn, "v_y": sideways}.get(name, drive)
        lines.append(f"  {name:<24}{text}")
    lines.append("arm")
    for name, low, high, speed, acceleration in zip(
        model.arm_joints, model.q_lower, model.q_upper, model.v_max, model.a_max, strict=True
    ):
        span = f"{low:g} .. {high:g}" if np.isfinite([low, high]).all() else "continuous"
        lines.append(
            f"  {name:<24}  position {span}, speed +-{speed:g}, acceleration {acceleration:g}"
        )
    lines.append("pairs")
    for field in type(parameters.pairs).model_fields:
        pair: PairClass = getattr(parameters.pairs, field)
        speed = approach_speed(pair, model, parameters)
        lines.append(
            f"  {pair.name:<24}  kept {pair.safe:g} m, slowed from {pair.influence:g} m, "
            f"where {speed:.3g} m/s are allowed"
        )
    return "\n".join(lines)
