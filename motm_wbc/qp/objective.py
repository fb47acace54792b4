"""The cost of one step, with the tool's slack eliminated.

With slack delta = nu - J x, weighed by W, and weights lambda on x, the cost is
1/2 x^T H x + f^T x with H = diag(lambda) + J^T W J and f = -J^T W nu + further linear terms:
the optimum of the form with slack variables (Haviland et al., 2022), at 9 variables for 15.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import Configuration
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.tasks import PostureTask, ToolTask

_LEAST_LEAD = 1e-3  # [m/s] keeps the factor's weight positive where the base stands


def led_objective(
    configuration: Configuration,
    lead: Array,
    tool: ToolTask | None,
    posture: PostureTask | None,
    parameters: WholeBodyParameters,
) -> tuple[Array, Array]:
    """Cost of (s, arm velocities) where the base moves with s * `lead`.

    Args:
        configuration: of the robot.
        lead: (n_base,) base inputs that are scaled.
        tool: what the tool shall do, or None.
        posture: where the redundancy shall lead, or None.
        parameters: weights and gains.

    Returns:
        H (1 + n_arm, 1 + n_arm) and f (1 + n_arm,).
    """
    n_base = configuration.model.n_base
    count = 1 + configuration.model.n_arm
    H, f = np.zeros((count, count)), np.zeros(count)
    diagonal = np.full(count, parameters.damping)
    # in proportion to the speed, as what the tool and the collision rows pull with is
    pull = parameters.scale_weight * max(float(np.abs(lead).sum()), _LEAST_LEAD)
    diagonal[0] = pull
    # toward two: at the bound, s = 1, the slope is still there, so s is exactly 1
    f[0] = -2.0 * pull
    if tool is not None:
        J_tool = configuration.J_tool
        J = np.empty((6, count))
        J[:, 0] = J_tool[:, :n_base] @ lead
        J[:, 1:] = J_tool[:, n_base:]
        _add_tool(H, f, J, tool, parameters.linear_weight, parameters.angular_weight)
    if parameters.manipulability_weight > 0.0:
        f[1:] -= parameters.manipulability_weight * configuration.manipulability_gradient
    if posture is not None:
        _add_posture(diagonal[1:], f[1:], configuration.q, posture, parameters)
    H.flat[:: count + 1] += diagonal
    return H, f


def holistic_objective(
    configuration: Configuration,
    tool: ToolTask | None,
    posture: PostureTask | None,
    parameters: WholeBodyParameters,
) -> tuple[Array, Array]:
    """Cost of (base inputs, arm velocities), both free (Haviland et al., 2022, eq. 17-24).

    The farther the goal, the more the base moves; the base turns toward the tool.

    Returns:
        H (n, n) and f (n,) with n = n_base + n_arm.
    """
    weights, n_base = parameters.holistic, configuration.model.n_base
    error = _position_error(tool, parameters)
    J = configuration.J_tool
    count = J.shape[1]
    H, f = np.zeros((count, count)), np.zeros(count)
    diagonal = np.full(count, weights.arm_weight)
    diagonal[:n_base] = weights.base_weight / error
    if tool is not None:
        slack = weights.slack_weight / error
        _add_tool(H, f, J, tool, slack, slack)
    f[n_base:] -= weights.manipulability_weight * configuration.manipulability_gradient
    x, y = configuration.T_base_tool[:2, 3]
    f[n_base - 1] -= weights.yaw_weight * math.atan2(y, x)
    if posture is not None:
        _add_posture(diagonal[n_base:], f[n_base:], configuration.q, posture, parameters)
    H.flat[:: count + 1] += diagonal
    return H, f


def _position_error(tool: ToolTask | None, parameters: WholeBodyParameters) -> float:
    """Distance left to the tool's goal [m], 1-norm, clipped: weights are its inverse."""
    weights = parameters.holistic
    if tool is None:
        error = 0.0
    elif tool.position_error is not None:
        error = tool.position_error
    else:
        error = float(np.abs(tool.twist[:3]).sum()) / weights.servo_gain
    return min(max(error, weights.least_error), weights.largest_error)


def _add_tool(H: Array, f: Array, J: Array, tool: ToolTask, linear: float, angular: float) -> None:
    """Add the tool task, its axes weighed in the task's own frame."""
    R = tool.R_world_task
    root = np.sqrt(np.maximum(tool.weights, 0.0))
    scaled = np.empty_like(J)  # sqrt(W) J
    scaled[:3] = (R * (root[:3] * math.sqrt(linear))).T @ J[:3]
    scaled[3:] = (R * (root[3:] * math.sqrt(angular))).T @ J[3:]
    wanted = np.empty(6)
    wanted[:3] = (R * (root[:3] * math.sqrt(linear))).T @ tool.twist[:3]
    wanted[3:] = (R * (root[3:] * math.sqrt(angular))).T @ tool.twist[3:]
    H += scaled.T @ scaled
    f -= wanted @ scaled


def _add_posture(
    diagonal: Array, f: Array, q: Array, posture: PostureTask, parameters: WholeBodyParameters
) -> None:
    """Add 1/2 w (v - gain (target - q))^2 for each joint, and pulls back over soft bounds."""
    fastest = parameters.posture_speed
    weight = parameters.posture_weight * posture.weights
    wanted = parameters.posture_gain * (posture.target - q)
    diagonal += weight
    f -= weight * np.minimum(np.maximum(wanted, -fastest), fastest)
    for bound, side in ((posture.lower, 1.0), (posture.upper, -1.0)):
        if bound is None:
            continue
        room = side * (q - bound)  # positive inside
        near = 1.0 - room / parameters.preferred_bound_margin
        weight = parameters.preferred_bound_weight * np.minimum(np.maximum(near, 0.0), 1.0)
        back = np.minimum(np.maximum(-parameters.posture_gain * room, 0.0), fastest)
        diagonal += weight
        f -= weight * side * back
