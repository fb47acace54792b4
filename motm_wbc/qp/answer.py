"""From the solver's answer to a command, and which limits it is at."""

from __future__ import annotations

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.arrays import ProblemArrays, StepArrays, read_arrays
from motm_wbc.qp.problem import Limit
from motm_wbc.qp.step import BRAKES_ON_ARC

_SPEED, _ACCELERATION = int(Limit.SPEED), int(Limit.ACCELERATION)
FREE = -1
"""Code of an input or a row that is at no limit; else it is a `Limit`."""
ACTIVE = 0
"""Code of a row that is at its bound."""
_AT_BOUND = 1e-4  # [rad/s, m/s] from a bound that counts as being held by it
_BASE_SHARE = 1e-3  # share of an input's largest change, from a bound that counts as held by it
_UNSCALED = 1e-3  # a factor this near to a bound counts as being at it


@kernel
def read_answer(
    table: IntArray,
    led: bool,
    verdict: int,
    snap: float,
    z: Array,
    command: Array,
    report: IntArray,
) -> float:
    """Turn an answer into inputs.

    Args:
        table: as for `write_problem`.
        led: as for `write_problem`.
        verdict: what that returned.
        snap: a factor that is nearer than this to its upper bound is put there.
        z: (n,) answer, inside its limits.
        command: (n_inputs + 6,), is written: the inputs, then the twist that is asked of the
            robot's own tool less the one it gets.
        report: (n_inputs + 2 + 3 r,), is written: the `Limit` that each input is at, or
            `FREE`; the closest pair; for each row whether it is active, and its pair.

    Returns:
        Factor by which navigation's inputs are scaled; 1.0 without navigation, 0.0 where the
        base brakes on its arc instead.
    """
    step = read_arrays(table)
    state, problem, n = step.state, step.problem, len(z)
    n_base, n_inputs = len(state.reference), len(state.previous)
    first = 1 if led else n_base
    scale = 1.0
    if led:
        scale = z[0]
        if scale > problem.upper[0] - snap:
            scale = problem.upper[0]  # not by a solver's rounding off what navigation asked for
        for i in range(n_base):
            command[i] = scale * state.lead[i] + 0.0  # no negative zeros
        held = scale < 1.0 - _UNSCALED and scale >= problem.upper[0] - _UNSCALED
        for i in range(n_base):
            report[i] = _lead_code(command[i], i, step) if held else FREE
        if verdict & BRAKES_ON_ARC:
            report[:n_base] = _ACCELERATION
            scale = 0.0
    else:
        for i in range(n_base):
            command[i] = z[i] + 0.0
            report[i] = _code(z[i], i, problem, _BASE_SHARE * step.base.change[i])
    for k in range(first, n):
        command[n_base + k - first] = z[k]
        report[n_base + k - first] = _code(z[k], k, problem, _AT_BOUND)
    for i in range(6):
        slack = step.tools.wanted[0, i]
        for c in range(n_inputs):
            slack -= step.tools.J[0, i, c] * command[c]
        command[n_inputs + i] = slack
    _report_rows(step, command, report[n_inputs:])
    return scale


@kernel
def _report_rows(step: StepArrays, command: Array, report: IntArray) -> None:
    """Write the closest pair, then for each row whether it is active, and its pair."""
    rows = step.rows
    report[0], report[1] = step.selection.closest[0], step.selection.closest[1]
    for slot in range(len(rows.bound)):
        room = rows.bound[slot]
        for c in range(rows.A.shape[1]):
            room -= rows.A[slot, c] * command[c]
        at = 2 + 3 * slot
        report[at] = ACTIVE if room <= _AT_BOUND else FREE
        report[at + 1], report[at + 2] = rows.slots[slot, 0], rows.slots[slot, 1]


@kernel
def _lead_code(value: float, i: int, step: StepArrays) -> int:
    """Which limit a base input is at where navigation leads."""
    room = _BASE_SHARE * step.base.change[i]
    if value >= step.base.fastest[i] - room or value <= step.base.slowest[i] + room:
        return _SPEED
    at_limit = abs(value - step.state.previous[i]) >= step.base.change[i] - room
    return _ACCELERATION if at_limit else FREE


@kernel
def _code(value: float, k: int, problem: ProblemArrays, tolerance: float) -> int:
    """Which limit a variable is at."""
    if value >= problem.upper[k] - tolerance:
        beyond = value < problem.hard_upper[k] - tolerance
        return _ACCELERATION if beyond else problem.upper_kind[k]
    if value <= problem.lower[k] + tolerance:
        beyond = value > problem.hard_lower[k] + tolerance
        return _ACCELERATION if beyond else problem.lower_kind[k]
    return FREE
