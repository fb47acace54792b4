"""Whether what comes from outside can be used: numbers, and no negative weights."""

from __future__ import annotations

import math

from motm_wbc.geometry.jit import inlined
from motm_wbc.qp.arrays import StepArrays
from motm_wbc.qp.objective import PostureArrays, ToolArrays

# A sum with a number that is not finite in it is not finite, or not a number.


@inlined
def all_usable(led: bool, step: StepArrays) -> bool:
    """Whether state and tasks of a step can be used; preferred bounds may be infinite."""
    state = step.state
    total = state.positions.sum() + state.previous.sum() + state.reference.sum()
    total += state.linear_J.sum() + state.linear_target.sum()
    least = 0.0
    for weight in state.linear_weights:
        total += weight
        least = min(least, weight)
    if not led:
        total += state.heading.sum()
        least = min(least, state.heading[0])
        for weight in state.input_weights:
            total += weight
            least = min(least, weight)
    fits = math.isfinite(total) and least >= 0.0
    return fits and _usable_tools(step.tools) and _usable_posture(step.posture)


@inlined
def is_finite(step: StepArrays) -> bool:
    """Whether the cost of all inputs is numbers: tasks may be too large for that."""
    return math.isfinite(step.state.H.sum() + step.state.f.sum())


@inlined
def _usable_tools(tools: ToolArrays) -> bool:
    total = tools.gain.sum() + tools.position_error.sum() + tools.axes.sum()
    total += tools.twist.sum() + tools.acceleration.sum()
    for k in range(len(tools.joint)):
        for weight in tools.weights[k]:
            total += weight
            if weight < 0.0:
                return False
        if tools.has_target[k] != 0.0:
            total += tools.target[k].sum()
    return math.isfinite(total)


@inlined
def _usable_posture(posture: PostureArrays) -> bool:
    for k in range(len(posture.target)):
        if math.isnan(posture.lower[k]) or math.isnan(posture.upper[k]):
            return False
        if posture.weights[k] < 0.0:
            return False
    return math.isfinite(posture.target.sum() + posture.weights.sum())
