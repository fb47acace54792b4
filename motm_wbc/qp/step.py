"""One compiled step: from state, tasks and world to the quadratic program.

All that comes before the solver: forward kinematics, Jacobians, pose errors, manipulability
gradient, collision rows, bounds, cost.
"""

from __future__ import annotations

import math

from motm_wbc.geometry.arrays import IntArray
from motm_wbc.geometry.jit import inlined, kernel
from motm_wbc.kinematics.chain import forward, input_jacobian
from motm_wbc.kinematics.manipulability import manipulability_gradient
from motm_wbc.qp.arrays import ProblemArrays, StepArrays, Weights, named_weights, read_arrays
from motm_wbc.qp.limits import base_box, brake_on_arc, joint_box, scale_interval
from motm_wbc.qp.nearby import move_segments, rough_pairs
from motm_wbc.qp.objective import (
    add_linear,
    add_posture,
    add_residual_damping,
    add_tool,
    place_tool,
    position_error,
    scale_base,
    want_twist,
)
from motm_wbc.qp.problem import Limit
from motm_wbc.qp.rows import write_rows
from motm_wbc.qp.segments import place_segments
from motm_wbc.qp.selection import choose_pairs
from motm_wbc.qp.shapes import place_solids
from motm_wbc.qp.usable import all_usable, is_finite

READY, BRAKES_ON_ARC, PASSES_ACCELERATION, UNUSABLE = 0, 1, 2, 4
"""What `write_problem` returns, flags that may come together: a problem; the base brakes because
nothing of what navigation asks for is within its acceleration; a joint has to pass its
acceleration limit for its position or velocity; the input can't be used."""
_NOTABLE = 1e-9  # [rad/s] by which an acceleration limit counts as passed
_SPEED, _POSITION = int(Limit.SPEED), int(Limit.POSITION)
_ACCELERATION, _LOCK = int(Limit.ACCELERATION), int(Limit.LOCK)


@kernel
def write_problem(table: IntArray, led: bool, differential: bool) -> int:
    """Write the problem of one step.

    Args:
        table: of `StepArrays`, with state, tasks and world; the problem in it is written.
        led: navigation leads the base, and the first variable is the factor of its inputs;
            else the base's inputs are variables.
        differential: the base's inputs are (v, omega), else (v_x, v_y, omega).

    Returns:
        `READY`, or flags.
    """
    step = read_arrays(table)
    weights, problem, state = named_weights(step.weights), step.problem, step.state
    n_arm, n_base = len(step.posture.target), len(state.reference)
    if not all_usable(led, step):
        return UNUSABLE
    forward(step.chain, state.positions, state.rotations, state.translations)
    input_jacobian(
        step.chain, differential, state.positions, n_arm, state.rotations, state.translations,
        state.J_world,
    )  # fmt: skip
    verdict = _choose_lead(led, step)
    _write_rows(led, weights, step)
    _write_cost(led, weights, step)
    if not is_finite(step):
        return UNUSABLE
    if led:
        scale_base(
            state.H,
            state.f,
            step.rows.A,
            state.lead,
            weights.scale,
            problem.H,
            problem.f,
            problem.A,
        )
    else:
        problem.H[:, :] = state.H
        problem.f[:] = state.f
        problem.A[:, :] = step.rows.A
    first = 1 if led else n_base
    _write_box(led, first, weights.dt, step)
    n = first + n_arm
    for slot in range(len(step.rows.bound)):
        problem.upper[n + slot] = step.rows.bound[slot]
    if state.passed.max() > _NOTABLE:
        verdict |= PASSES_ACCELERATION
    return verdict


@inlined
def _choose_lead(led: bool, step: StepArrays) -> int:
    """Write the base inputs that are scaled, and the bounds of their factor.

    For free inputs: those that count as asked for.
    """
    state, problem = step.state, step.problem
    n_base = len(state.reference)
    if not led:
        state.lead[:] = state.previous[:n_base]
        return READY
    least, most = scale_interval(step.base, state.reference, state.previous[:n_base])
    locked = False
    for i in range(n_base):
        locked = locked or (state.locked[i] != 0.0 and state.reference[i] != 0.0)
    if least <= most and not locked:
        state.lead[:] = state.reference
        problem.lower[0], problem.upper[0] = least, most
        return READY
    problem.lower[0], problem.upper[0] = 1.0, 1.0
    brake_on_arc(step.base, state.previous[:n_base], state.lead)
    return BRAKES_ON_ARC


@inlined
def _write_rows(led: bool, weights: Weights, step: StepArrays) -> None:
    state = step.state
    for i in range(3):
        step.scene.poses[0, i] = state.positions[i]
    place_solids(step.scene, 0, 1)
    place_segments(step.segments, state.rotations, state.translations, step.near.ends)
    # where somebody navigates, the base's body is theirs
    count = rough_pairs(step.segments, step.scene, step.pairs, not led, step.near)
    move_segments(
        step.segments, step.scene, state.J_world, len(state.reference), state.previous, step.near
    )
    chosen = choose_pairs(
        step.segments, step.scene, step.pairs, step.near, count, step.base.change[0] / weights.dt,
        weights.retreat_speed, int(weights.held_rows), weights.dt, step.selection,
    )  # fmt: skip
    # what is asked for, also where the base brakes instead: its brakes must do for that
    asked = state.reference if led else state.lead
    write_rows(
        step.segments, step.scene, step.pairs, step.near, step.selection, chosen, step.base,
        state.J_world, asked, weights.retreat_speed, weights.dt,
        step.rows,
    )  # fmt: skip


@inlined
def _write_cost(led: bool, weights: Weights, step: StepArrays) -> None:
    """Write H and f of all inputs."""
    state, tools = step.state, step.tools
    H, f, n_base = state.H, state.f, len(state.reference)
    H[:, :] = 0.0
    f[:] = 0.0
    for k in range(len(tools.joint)):
        place_tool(tools, k, state.rotations, state.translations, state.J_world)
        limits = weights.pose_speed, weights.pose_turn_speed
        want_twist(tools, k, state.J_world, state.previous, n_base, weights.dt, limits, state.bias)
    error = 1.0
    if not led:
        error = position_error(tools, weights.servo_gain)
        error = min(max(error, weights.least_error), weights.largest_error)
    # tool 0 is the robot's own: it is there without a task, too
    for k in range(len(tools.joint)):
        linear, angular = weights.linear / error, weights.angular / error
        add_tool(H, f, tools, k, linear, angular)
        add_residual_damping(H, tools, k, state.previous, n_base, (linear, angular), weights.dt)
    for i in range(n_base, len(f)):
        H[i, i] += weights.damping
    if weights.manipulability > 0.0:
        manipulability_gradient(tools.J[0][:, n_base:], state.gradient)
        for i in range(len(state.gradient)):
            f[n_base + i] -= weights.manipulability * state.gradient[i]
    posture = (
        weights.posture, weights.posture_gain, weights.posture_speed, weights.preferred_bound,
        weights.preferred_bound_margin,
    )  # fmt: skip
    add_posture(H, f, n_base, state.positions[3 : 3 + len(f) - n_base], step.posture, posture)
    if not led:
        _add_free_base(weights, error, step)
    add_linear(H, f, state.linear_J, state.linear_target, state.linear_weights)


@inlined
def _add_free_base(weights: Weights, error: float, step: StepArrays) -> None:
    """Add what holds for free base inputs (Haviland et al., 2022, eqs. 17-24).

    The farther the goal, the more the base moves; the base turns toward the tool.
    """
    state, H, f = step.state, step.state.H, step.state.f
    n_base = len(state.reference)
    for i in range(n_base):
        H[i, i] += weights.base / error + state.input_weights[i]
        f[i] -= state.input_weights[i] * state.reference[i]
    x = step.tools.pose[0, 0, 3] - state.positions[0]
    y = step.tools.pose[0, 1, 3] - state.positions[1]
    heading = state.positions[2]
    c, s = math.cos(heading), math.sin(heading)
    turn = n_base - 1
    f[turn] -= weights.yaw * math.atan2(c * y - s * x, c * x + s * y)
    weight, gain, wish = state.heading[0], state.heading[1], state.heading[2]
    away = wish - heading
    away -= 2.0 * math.pi * round(away / (2.0 * math.pi))
    H[turn, turn] += weight
    f[turn] -= weight * gain * away


@inlined
def _write_box(led: bool, first: int, dt: float, step: StepArrays) -> None:
    """Write the bounds of all variables but the base's factor; the arm's begin at `first`."""
    problem = step.problem
    state, n = step.state, len(problem.f)
    n_base = len(state.reference)
    joint_box(
        step.joints, dt, state.positions[3 : 3 + n - first], state.previous[n_base:],
        problem.lower[first:n], problem.upper[first:n],
        problem.hard_lower[first:], problem.hard_upper[first:], state.passed,
    )  # fmt: skip
    for i in range(n - first):
        k, fastest = first + i, step.joints.v_max[i]
        problem.lower_kind[k] = _SPEED if problem.hard_lower[k] <= -fastest else _POSITION
        problem.upper_kind[k] = _SPEED if problem.hard_upper[k] >= fastest else _POSITION
        if state.locked[n_base + i] != 0.0:
            _lock(problem, k)
    if led:
        problem.lower_kind[0], problem.upper_kind[0] = _ACCELERATION, _ACCELERATION
        for i in range(n_base):
            speed, room = problem.upper[0] * state.lead[i], _NOTABLE
            if speed >= step.base.fastest[i] - room or speed <= step.base.slowest[i] + room:
                problem.upper_kind[0] = _SPEED
    else:
        base_box(step.base, state.previous[:n_base], problem.lower, problem.upper)
        for i in range(n_base):
            slowest, fastest = step.base.slowest[i], step.base.fastest[i]
            at = problem.lower[i] <= slowest
            problem.lower_kind[i] = _SPEED if at else _ACCELERATION
            at = problem.upper[i] >= fastest
            problem.upper_kind[i] = _SPEED if at else _ACCELERATION
            if state.locked[i] != 0.0:
                _lock(problem, i)
    for i in range(first):
        problem.hard_lower[i], problem.hard_upper[i] = problem.lower[i], problem.upper[i]


@inlined
def _lock(problem: ProblemArrays, k: int) -> None:
    """Make a variable stand still, or come to rest as its limits allow."""
    rest = min(max(0.0, problem.lower[k]), problem.upper[k])
    problem.lower[k], problem.upper[k] = rest, rest
    problem.hard_lower[k], problem.hard_upper[k] = rest, rest
    problem.lower_kind[k], problem.upper_kind[k] = _LOCK, _LOCK
