"""The cost of one step, with the tools' slack eliminated.

With slack delta = nu - J x, weighed by W, and weights lambda on x, the cost is
1/2 x^T H x + f^T x with H = diag(lambda) + J^T W J and f = -J^T W nu + further linear terms:
the optimum of the form with slack variables (Haviland et al., 2022), at 9 variables for 15.
Ours: damping that follows the slack, see `add_residual_damping`.

All tasks are written for the inputs: the base's, then the arm's. Where navigation leads the
base, `scale_base` turns the base's inputs into one factor of navigation's.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.jit import inlined
from motm_wbc.kinematics.chain import bias_acceleration
from motm_wbc.kinematics.rotations import rotation_error

_LEAST_LEAD = 1e-3  # [m/s] keeps the factor's weight positive where the base stands


class ToolArrays(NamedTuple):
    """Tool tasks, t of them, and what is worked out of them.

    Attributes:
        joint: (t,) joint frame that each tool is fixed to.
        placement: (t, 4, 4) the tool in that frame.
        moved_by: (t, n_inputs) 1.0 for each input that moves it.
        twist: (t, 6) wanted [m/s, rad/s].
        acceleration: (t, 6) of the target [m/s^2, rad/s^2].
        target: (t, 4, 4) pose to take.
        has_target: (t,) 1.0 where there is one.
        gain: (t,) speed per error [1/s].
        weights: (t, 6) of the task's own axes.
        axes: (t, 3, 3) these axes in the world.
        position_error: (t,) distance that is left [m], 1-norm; negative: not given.
        pose: (t, 4, 4) of the tools in the world, is written.
        J: (t, 6, n_inputs) Jacobians at the tools' origins, is written.
        wanted: (t, 6) mean twist that is asked for, is written.
        scaled: (6, n_inputs) work space.
    """

    joint: IntArray
    placement: Array
    moved_by: Array
    twist: Array
    acceleration: Array
    target: Array
    has_target: Array
    gain: Array
    weights: Array
    axes: Array
    position_error: Array
    pose: Array
    J: Array
    wanted: Array
    scaled: Array


class PostureArrays(NamedTuple):
    """The posture task, (n_arm,) each; weights of zero where there is none."""

    target: Array
    weights: Array
    lower: Array
    upper: Array


@inlined
def place_tool(
    tools: ToolArrays, k: int, rotations: Array, translations: Array, J_world: Array
) -> None:
    """Write pose and Jacobian of tool `k` from the joint frames and the spatial Jacobian."""
    R, p, T = rotations[tools.joint[k]], translations[tools.joint[k]], tools.pose[k]
    M = tools.placement[k]
    for i in range(3):
        for j in range(3):
            T[i, j] = R[i, 0] * M[0, j] + R[i, 1] * M[1, j] + R[i, 2] * M[2, j]
        T[i, 3] = p[i] + R[i, 0] * M[0, 3] + R[i, 1] * M[1, 3] + R[i, 2] * M[2, 3]
    x, y, z = T[0, 3], T[1, 3], T[2, 3]
    J = tools.J[k]
    for c in range(J.shape[1]):
        moves = tools.moved_by[k, c]
        a, b, d = moves * J_world[3, c], moves * J_world[4, c], moves * J_world[5, c]
        J[0, c] = moves * J_world[0, c] + b * z - d * y
        J[1, c] = moves * J_world[1, c] + d * x - a * z
        J[2, c] = moves * J_world[2, c] + a * y - b * x
        J[3, c], J[4, c], J[5, c] = a, b, d


@inlined
def want_twist(
    tools: ToolArrays,
    k: int,
    J_world: Array,
    previous: Array,
    n_base: int,
    dt: float,
    largest: tuple[float, float],
    bias: Array,
) -> None:
    """Write the twist of tool `k` at the step's beginning that gives the wanted mean twist.

    With constant inputs x the tool's acceleration is Jdot x, so its mean twist over the step
    is J x + dt/2 Jdot x. The last inputs stand for x in the second term.

    Args:
        tools: tool tasks.
        k: which.
        J_world: (6, n_inputs) spatial Jacobian.
        previous: (n_inputs,) last commanded inputs.
        n_base: number of base inputs.
        dt: control step [s].
        largest: speed [m/s] and turn rate [rad/s] that an error may ask for.
        bias: (6,) work space.
    """
    T, wanted = tools.pose[k], tools.wanted[k]
    bias_acceleration(J_world, tools.moved_by[k], n_base, previous, T[:3, 3], bias)
    for i in range(6):
        wanted[i] = tools.twist[k, i] + 0.5 * dt * (tools.acceleration[k, i] - bias[i])
    if tools.has_target[k] == 0.0:
        return
    goal, gain = tools.target[k], tools.gain[k]
    x, y, z = goal[0, 3] - T[0, 3], goal[1, 3] - T[1, 3], goal[2, 3] - T[2, 3]
    share = gain * _shortened(gain * math.sqrt(x * x + y * y + z * z), largest[0])
    wanted[0], wanted[1], wanted[2] = (
        wanted[0] + share * x,
        wanted[1] + share * y,
        wanted[2] + share * z,
    )
    turn = rotation_error(goal[:3, :3], T[:3, :3])
    x, y, z = turn[0], turn[1], turn[2]
    share = gain * _shortened(gain * math.sqrt(x * x + y * y + z * z), largest[1])
    wanted[3], wanted[4], wanted[5] = (
        wanted[3] + share * x,
        wanted[4] + share * y,
        wanted[5] + share * z,
    )


@inlined
def add_residual_damping(
    H: Array,
    tools: ToolArrays,
    k: int,
    previous: Array,
    n_base: int,
    weights: tuple[float, float],
    dt: float,
) -> None:
    """Damp the joints by what tool `k` does not get of its wanted twist.

    Where a wish can't be had, as at the end of the arm's reach, the least squares are only
    held by the curvature of the tool's motion, residual times lever, that linear tasks leave
    out: without damping of that size the commands overshoot it from step to step. (The
    damping of Sugihara, "Solvability-unconcerned inverse kinematics by the
    Levenberg-Marquardt method", T-RO 2011, follows the residual for the same reason.)
    A tool that gets what it wants is not damped.

    Args:
        H: (n_inputs, n_inputs) is added to.
        tools: tool tasks, with their wanted twists.
        k: which.
        previous: (n_inputs,) last commanded inputs, which stand for those to come.
        n_base: number of base inputs.
        weights: of linear and angular velocities.
        dt: control step [s].
    """
    J, wanted, R = tools.J[k], tools.wanted[k], tools.axes[k]
    for half in range(2):
        o, square = 3 * half, 0.0
        for i in range(3):
            part = 0.0
            for row in range(3):
                missing = wanted[o + row]
                for c in range(len(previous)):
                    missing -= J[o + row, c] * previous[c]
                part += R[row, i] * missing
            square += tools.weights[k, o + i] * part * part
        size = dt * weights[half] * math.sqrt(square)
        for c in range(n_base, len(previous)):
            lever = math.sqrt(J[o, c] ** 2 + J[o + 1, c] ** 2 + J[o + 2, c] ** 2)
            H[c, c] += size * lever


@inlined
def _shortened(length: float, largest: float) -> float:
    """Factor that makes a length no larger than `largest`."""
    return largest / length if length > largest else 1.0


@inlined
def position_error(tools: ToolArrays, servo_gain: float) -> float:
    """Distance that is left to the first tool's goal [m], 1-norm."""
    given = float(tools.position_error[0])
    if given >= 0.0:
        return given
    T, goal, twist = tools.pose[0], tools.target[0], tools.twist[0]
    if tools.has_target[0] != 0.0:
        x, y, z = goal[0, 3] - T[0, 3], goal[1, 3] - T[1, 3], goal[2, 3] - T[2, 3]
        return float(abs(x) + abs(y) + abs(z))
    return float(abs(twist[0]) + abs(twist[1]) + abs(twist[2])) / servo_gain


@inlined
def add_tool(H: Array, f: Array, tools: ToolArrays, k: int, linear: float, angular: float) -> None:
    """Add tool task `k`, its axes weighed in the task's own frame."""
    R, J, wanted, scaled = tools.axes[k], tools.J[k], tools.wanted[k], tools.scaled
    n = J.shape[1]
    for half in range(2):
        o = 3 * half
        for i in range(3):
            weight = tools.weights[k, o + i] * (angular if half else linear)
            root = math.sqrt(weight)
            a, b, d = root * R[0, i], root * R[1, i], root * R[2, i]
            wish = a * wanted[o] + b * wanted[o + 1] + d * wanted[o + 2]
            for c in range(n):
                scaled[o + i, c] = a * J[o, c] + b * J[o + 1, c] + d * J[o + 2, c]
                f[c] -= wish * scaled[o + i, c]
    for r in range(n):
        for c in range(r + 1):
            total = 0.0
            for i in range(6):
                total += scaled[i, r] * scaled[i, c]
            H[r, c] += total
            if c < r:
                H[c, r] += total


@inlined
def add_posture(
    H: Array,
    f: Array,
    n_base: int,
    q: Array,
    posture: PostureArrays,
    weights: tuple[float, float, float, float, float],
) -> None:
    """Add 1/2 w (v - gain (target - q))^2 for each joint, and pulls back over soft bounds.

    Args:
        H: (n, n) is added to.
        f: (n,) is added to.
        n_base: number of base inputs.
        q: (n_arm,) joint positions [rad or m].
        posture: the task.
        weights: weight, gain [1/s], largest speed [rad/s], weight of soft bounds, and
            distance before a soft bound over which that grows from zero [rad].
    """
    factor, gain, fastest, bound_weight, margin = weights
    for i in range(len(q)):
        c = n_base + i
        weight = factor * posture.weights[i]
        wish = min(max(gain * (posture.target[i] - q[i]), -fastest), fastest)
        H[c, c] += weight
        f[c] -= weight * wish
        for side, bound in ((1.0, posture.lower[i]), (-1.0, posture.upper[i])):
            if not math.isfinite(bound):
                continue
            room = side * (q[i] - bound)  # positive inside
            near = min(max(1.0 - room / margin, 0.0), 1.0)
            back = min(max(-gain * room, 0.0), fastest)
            H[c, c] += bound_weight * near
            f[c] -= bound_weight * near * side * back


@inlined
def add_linear(H: Array, f: Array, J: Array, target: Array, weights: Array) -> None:
    """Add 1/2 w (target - J x)^2 for each row of J."""
    for i in range(len(target)):
        for r in range(len(f)):
            pull = weights[i] * J[i, r]
            f[r] -= pull * target[i]
            for c in range(len(f)):
                H[r, c] += pull * J[i, c]


@inlined
def scale_base(
    H: Array, f: Array, A: Array, lead: Array, pull: float, H_led: Array, f_led: Array, A_led: Array
) -> None:
    """The problem of (s, arm velocities) where the base moves with s * `lead`.

    The factor is drawn toward two: at its bound, s = 1, the slope is still there, so s is
    exactly 1. Its weight is in proportion to the speed, as is what the tools and the collision
    rows pull with.

    Args:
        H: (n_inputs, n_inputs) of all inputs.
        f: (n_inputs,).
        A: (r, n_inputs) collision rows.
        lead: (n_base,) base inputs that are scaled.
        pull: weight of the factor, per m/s of `lead`.
        H_led: (1 + n_arm, 1 + n_arm), is written.
        f_led: (1 + n_arm,), is written.
        A_led: (r, 1 + n_arm), is written.
    """
    n_base, n_arm = len(lead), len(f_led) - 1
    total, weight, slope = 0.0, 0.0, 0.0
    for r in range(n_base):
        total += abs(lead[r])
        slope += lead[r] * f[r]
        for c in range(n_base):
            weight += lead[r] * H[r, c] * lead[c]
    pull *= max(total, _LEAST_LEAD)
    H_led[0, 0], f_led[0] = weight + pull, slope - 2.0 * pull
    for i in range(n_arm):
        cross = 0.0
        for r in range(n_base):
            cross += lead[r] * H[r, n_base + i]
        H_led[0, 1 + i], H_led[1 + i, 0] = cross, cross
        f_led[1 + i] = f[n_base + i]
        for j in range(n_arm):
            H_led[1 + i, 1 + j] = H[n_base + i, n_base + j]
    for k in range(len(A)):
        rate = 0.0
        for r in range(n_base):
            rate += A[k, r] * lead[r]
        A_led[k, 0] = rate
        for i in range(n_arm):
            A_led[k, 1 + i] = A[k, n_base + i]
