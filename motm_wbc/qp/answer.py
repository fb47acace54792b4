"""From the solver's answer to a command, and which limits it is at."""

from __future__ import annotations

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.arrays import Codes, ProblemArrays, StepArrays, read_arrays
from motm_wbc.qp.problem import Limit
from motm_wbc.qp.step import BRAKES_ON_ARC

_SPEED, _ACCELERATION = int(Limit.SPEED), int(Limit.ACCELERATION)
FREE = -1
"""Code of an input or a row that is at no limit; else it is a `Limit`."""
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
    slack: Array,
    codes: Codes,
) -> float:
    """Turn an answer into inputs.

    Args:
        table: as for `write_problem`.
        led: as for `write_problem`.
        verdict: what that returned.
        snap: a factor that is nearer than this to its upper bound is put there.
        z: (n,) answer, inside its limits.
        command: (n_inputs,), is written.
        slack: (6,) wanted less got twist of the robot's own tool, is written.
        codes: (n_inputs + r,) `Limit` that each input and row is at, or `FREE`, is written.

    Returns:
        Factor by which navigation's inputs are scaled; 1.0 without navigation, 0.0 where the
        base brakes on its arc instead.
    """
    step = read_arrays(table)
    state, problem, n = step.state, step.problem, len(z)
    n_base = len(state.reference)
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
            codes[i] = _lead_code(command[i], i, step) if held else FREE
        if verdict == BRAKES_ON_ARC:
            codes[:n_base] = _ACCELERATION
            scale = 0.0
    else:
        for i in range(n_base):
            command[i] = z[i] + 0.0
            codes[i] = _code(z[i], i, problem, 0.0)
    for k in range(first, n):
        command[n_base + k - first] = z[k]
        codes[n_base + k - first] = _code(z[k], k, problem, _AT_BOUND)
    for i in range(6):
        slack[i] = step.tools.wanted[0, i]
        for c in range(len(command)):
            slack[i] -= step.tools.J[0, i, c] * command[c]
    for slot in range(len(step.rows.bound)):
        room = step.rows.bound[slot]
        for c in range(len(command)):
            room -= step.rows.A[slot, c] * command[c]
        codes[len(command) + slot] = _SPEED if room <= _AT_BOUND else FREE
    return scale


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
