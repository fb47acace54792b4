"""Limits by name: which of them hold a command back, and a summary of all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.parameters import PairClass
from motm_wbc.qp.dampers import approach_speed
from motm_wbc.qp.limits import JointBox, JointLimits
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem

_AT_BOUND = 1e-4  # [rad/s, m/s] from a bound that counts as being held by it


def active_joints(
    arm: Array, box: JointBox, limits: JointLimits, names: tuple[str, ...]
) -> list[str]:
    """Names of the joints whose velocities `arm` (n_arm,) are at a bound, and of which limit."""
    found = []
    above = arm >= box.upper - _AT_BOUND
    below = arm <= box.lower + _AT_BOUND
    for index in np.nonzero(above | below)[0].tolist():
        kind = limits.binding(index, float(arm[index]), box, upper=bool(above[index]))
        found.append(f"{names[index]} {kind}")
    return found


def active_rows(x: Array, problem: QpProblem, row_name: Callable[[int], str]) -> list[str]:
    """Names of the pairs whose collision rows `x` is at."""
    room = problem.bound - problem.A @ x
    return [row_name(slot) for slot in np.nonzero(room <= _AT_BOUND)[0].tolist()]


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
