"""Inverse kinematics of the arm on a base that stands: damped least squares."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.parameters import IkParameters
from motm_wbc.kinematics.rotations import rotation_vector

ALL_AXES = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
_DEFAULT = IkParameters()
_ORIGIN = np.zeros(3)


@dataclass(frozen=True, slots=True, eq=False)
class IkResult:
    """What inverse kinematics found.

    Attributes:
        q: (n_arm,) joint positions inside their limits [rad or m].
        position_error: distance from the target along the axes that count [m].
        angle_error: angle from the target about the axes that count [rad].
        converged: both errors are within their tolerances.
        iterations: steps taken.
    """

    q: Array
    position_error: float
    angle_error: float
    converged: bool
    iterations: int


def solve_ik(
    model: RobotModel,
    T_base_target: Array,
    q_start: Array,
    axis_weights: Array | tuple[float, ...] = ALL_AXES,
    parameters: IkParameters = _DEFAULT,
) -> IkResult:
    """Joint positions that bring the tool to a pose in the base frame.

    Levenberg-Marquardt steps whose damping is the squared error (Sugihara, "Solvability-
    unconcerned inverse kinematics by the Levenberg-Marquardt method", T-RO 2011), with a
    pull to the preferred posture in the nullspace. A joint that would leave its range is
    held at the limit and the step solved again without it. Deterministic.

    Args:
        model: the robot.
        T_base_target: (4, 4) target of the tool frame in the base frame.
        q_start: (n_arm,) where to start; decides which branch is found.
        axis_weights: (6,) weights along and about the tool's x, y, z axes; 0 leaves an axis
            free, for example the rotation about the approach axis.
        parameters: tolerances and step sizes.
    """
    weights = np.asarray(axis_weights, dtype=float)
    counted = (weights > 0.0).astype(float)
    scale = weights * np.array([1.0, 1.0, 1.0, *(3 * [parameters.length])])
    pull_gain = _pull_gain(model, parameters)
    q = np.minimum(np.maximum(q_start, model.q_lower), model.q_upper)
    best: IkResult | None = None
    for iteration in range(parameters.max_iterations + 1):
        error, J = _error_and_jacobian(model, T_base_target, q, weights)
        error *= counted
        distance, angle = math.hypot(*error[:3]), math.hypot(*error[3:])
        done = distance <= parameters.position_tolerance and angle <= parameters.angle_tolerance
        here = IkResult(q, distance, angle, done, iteration)
        if done:
            return here
        if best is None or _size(here, parameters) < _size(best, parameters):
            best = here
        pull = pull_gain * (model.posture.value - q)
        before = q
        q = _step(model, q, J * scale[:, None], error * scale, pull, parameters)
        if float(np.abs(q - before).max()) < parameters.stall:
            break
    assert best is not None
    return best


def _pull_gain(model: RobotModel, parameters: IkParameters) -> Array:
    """(n_arm,) share of the way to the preferred posture that a step goes."""
    weight = model.posture.weight
    return np.asarray(parameters.posture_gain * weight / max(float(weight.max()), 1e-9))


def _size(result: IkResult, parameters: IkParameters) -> float:
    return result.position_error + parameters.length * result.angle_error


def _error_and_jacobian(
    model: RobotModel, T_base_target: Array, q: Array, weights: Array
) -> tuple[Array, Array]:
    """(6,) pose error and (6, n_arm) Jacobian of the tool, both in the tool's axes."""
    # with the base at the origin, world and base frame agree
    here = model.configuration(_ORIGIN, q, 0.0)
    to_tool = here.T_world_tool[:3, :3].T
    J = here.J_tool[:, model.n_base :]
    error = np.empty(6)
    error[:3] = to_tool @ (T_base_target[:3, 3] - here.T_world_tool[:3, 3])
    error[3:] = _turn_error(to_tool @ T_base_target[:3, :3], weights[3:])
    return error, np.concatenate((to_tool @ J[:3], to_tool @ J[3:]))


def _turn_error(turn: Array, weights: Array) -> Array:
    """(3,) rotation vector to the target; with one free axis the least one that aligns it.

    The logarithm of the whole rotation would mix a large turn about the free axis into the
    other two.
    """
    free = np.flatnonzero(weights == 0.0)
    if len(free) != 1:
        return rotation_vector(turn)
    axis = np.eye(3)[free[0]]
    wanted = turn[:, free[0]]
    x, y, z = axis
    a, b, c = wanted
    cross = np.array([y * c - z * b, z * a - x * c, x * b - y * a])
    sine, cosine = math.hypot(*cross), float(axis @ wanted)
    if sine > 1e-9:
        return np.asarray(cross * (math.atan2(sine, cosine) / sine))
    # aligned, or opposite: then any axis square to it turns it round
    return np.zeros(3) if cosine > 0.0 else np.pi * np.roll(axis, 1)


def _step(
    model: RobotModel, q: Array, J: Array, error: Array, pull: Array, parameters: IkParameters
) -> Array:
    """The next joint positions, inside their limits.

    A joint that stands at a limit and would leave its range is taken out, and the step
    solved again without it.
    """
    damping = float(error @ error) + parameters.damping
    free = np.ones(model.n_arm)
    while True:
        part = J * free
        gram = part @ part.T
        gram.flat[:: len(gram) + 1] += damping
        wish = pull * free
        step = wish + part.T @ np.linalg.solve(gram, error - part @ wish)
        largest = float(np.abs(step).max())
        if largest > parameters.max_step:
            step *= parameters.max_step / largest
        wanted = q + step
        inside = np.minimum(np.maximum(wanted, model.q_lower), model.q_upper)
        stuck = (inside != wanted) & (inside == q)
        if not stuck.any():
            return inside
        free[stuck] = 0.0
