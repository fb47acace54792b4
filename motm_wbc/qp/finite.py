"""Whether all that comes from outside is numbers."""

from __future__ import annotations

import math

from motm_wbc.geometry.jit import inlined
from motm_wbc.qp.arrays import StepArrays
from motm_wbc.qp.objective import PostureArrays, ToolArrays

# A sum with a number that is not finite in it is not finite, or not a number.


@inlined
def all_finite(led: bool, step: StepArrays) -> bool:
    """Whether state and tasks of a step are numbers; preferred bounds may be infinite."""
    state = step.state
    total = state.positions.sum() + state.previous.sum() + state.reference.sum()
    if not led:
        total += state.input_weights.sum() + state.heading.sum()
    total += state.linear_J.sum() + state.linear_target.sum() + state.linear_weights.sum()
    return math.isfinite(total) and _finite_tools(step.tools) and _finite_posture(step.posture)


@inlined
def _finite_tools(tools: ToolArrays) -> bool:
    total = tools.gain.sum() + tools.position_error.sum() + tools.axes.sum()
    total += tools.twist.sum() + tools.acceleration.sum() + tools.weights.sum()
    for k in range(len(tools.joint)):
        if tools.has_target[k] != 0.0:
            total += tools.target[k].sum()
    return math.isfinite(total)


@inlined
def _finite_posture(posture: PostureArrays) -> bool:
    for k in range(len(posture.target)):
        if math.isnan(posture.lower[k]) or math.isnan(posture.upper[k]):
            return False
    return math.isfinite(posture.target.sum() + posture.weights.sum())
