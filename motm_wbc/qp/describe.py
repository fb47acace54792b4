"""Limits by name: which of them hold a command back, and a summary of all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import IntArray
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.parameters import PairClass
from motm_wbc.qp.answer import FREE
from motm_wbc.qp.dampers import approach_speed
from motm_wbc.qp.nearby import PairNames
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import Kinds, Limit
from motm_wbc.qp.rows import NO_PAIR

_WORDS = {
    Limit.SPEED: "velocity",
    Limit.POSITION: "position",
    Limit.ACCELERATION: "acceleration",
    Limit.LOCK: "locked",
}


class Situation(NamedTuple):
    """What a command is held back by, in numbers; names are made when somebody asks.

    Attributes:
        codes: (n_inputs + r,) `Limit` that each input and row is at, or `FREE`.
        slots: (r, 2) pairs of the rows.
        nearest: (2,) the closest pair, or `NO_PAIR`.
        inputs: (n_inputs,) names of the inputs.
        pairs: names of the pairs.
    """

    codes: Kinds
    slots: IntArray
    nearest: IntArray
    inputs: tuple[str, ...]
    pairs: PairNames

    def active(self) -> tuple[str, ...]:
        """Names of the limits and pairs that the command is at."""
        codes, count = self.codes.tolist(), len(self.inputs)
        limits = [
            f"{name} {_WORDS[Limit(code)]}"
            for name, code in zip(self.inputs, codes[:count], strict=True)
            if code != FREE
        ]
        rows = [self.pair(slot) for slot, code in enumerate(codes[count:]) if code != FREE]
        return (*limits, *rows)

    def pair(self, slot: int) -> str:
        """Name of the pair in a row's slot."""
        return self.pairs.of(int(self.slots[slot, 0]), int(self.slots[slot, 1]))

    def closest(self) -> str:
        """Name of the closest pair, empty if there is none."""
        first, second = self.nearest.tolist()
        return "" if first == NO_PAIR else self.pairs.of(first, second)


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
