"""Our controller as a contestant: `python -m motm_wbc.experiments.bench.ours FILE SOLVER [MODE]`.

All that knows how the controller is called is in `Command`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from motm_wbc._version import __version__
from motm_wbc.errors import UnknownName
from motm_wbc.experiments.bench.scenes import bodies
from motm_wbc.experiments.bench.shared.motm_bench import Problem, serve
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import load_robot
from motm_wbc.qp import (
    FreeBase,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    WholeBodyParameters,
    WholeBodyResult,
)
from motm_wbc.qp.parameters import HolisticParameters

FREE, NAVIGATED = "free", "navigated"
_MANIPULABILITY = 0.02  # weight of its gradient, which is ours alone
_ERROR = 0.02  # [m] the position error that Holistic's weights are given for


class Command:
    """The whole-body controller for a problem's robot and scene, at any state.

    Args:
        problem: robot, scene and weights.
        solver: of the QP.
        mode: `free`, the base's inputs are variables; or `navigated`, one factor scales the
            inputs that were commanded before.

    Raises:
        UnknownName: there is no such mode.
    """

    def __init__(self, problem: Problem, solver: str, mode: str = FREE) -> None:
        if mode not in (FREE, NAVIGATED):
            raise UnknownName("mode", mode, (FREE, NAVIGATED))
        self.model = load_robot(problem.robot)
        self._controller = WholeBodyController(
            self.model, problem.dt, parameters=_parameters(problem), solver=solver
        )
        self._navigated = mode == NAVIGATED
        turning = 1.0 if self._navigated else problem.angular_weight / problem.linear_weight
        self._tool_weights = np.array([1.0, 1.0, 1.0, turning, turning, turning])
        self._bodies = bodies(problem.boxes)
        limits = self.model.posture
        self._posture = PostureTask(
            problem.posture, problem.posture_weights, limits.lower, limits.upper
        )

    def __call__(
        self, base_pose: Array, q: Array, previous: tuple[Array, Array], twist: Array
    ) -> WholeBodyResult:
        """One control step."""
        return self._controller.step(
            base_pose=base_pose,
            q=q,
            previous=previous,
            tools=(ToolTask(twist, weights=self._tool_weights, position_error=_ERROR),),
            base=NavigatedBase(previous[0]) if self._navigated else FreeBase(),
            posture=self._posture,
            bodies=self._bodies,
        )


def _parameters(problem: Problem) -> WholeBodyParameters:
    """The problem's weights in both modes."""
    return WholeBodyParameters(
        collision_rows=max(problem.rows, 1),
        linear_weight=problem.linear_weight,
        angular_weight=problem.angular_weight,
        damping=problem.damping,
        posture_weight=1.0,
        manipulability_weight=_MANIPULABILITY,
        posture_gain=problem.posture_gain,
        # Holistic's weights are per position error, which is held constant here
        holistic=HolisticParameters(
            arm_weight=problem.damping,
            base_weight=problem.damping * _ERROR,
            slack_weight=problem.linear_weight * _ERROR,
            manipulability_weight=_MANIPULABILITY,
            yaw_weight=0.0,
        ),
    )


class Ours:
    """The whole-body controller on a problem's states; see `Command`."""

    def __init__(self, problem: Problem, solver: str, mode: str = FREE) -> None:
        self.about: dict[str, Any] = {"library": f"motm-wbc {__version__}", "solver": solver}
        self._command = Command(problem, solver, mode)
        q, v = problem.q.copy(), problem.v_previous.copy()
        inputs = problem.inputs_previous.copy()
        self._states = [
            (q[k, :3], q[k, 3:], (inputs[k], v[k, 3:]), problem.twist[k])
            for k in range(len(problem))
        ]

    def step(self, k: int) -> WholeBodyResult:
        """The controller's answer to state k."""
        return self._command(*self._states[k])

    def velocities(self, k: int, answer: WholeBodyResult) -> Array:
        """(nv,) velocities of the base's three joints and the arm's."""
        heading = float(self._states[k][0][2])
        return joint_velocities(heading, answer.base, answer.arm)


def joint_velocities(heading: float, base: Array, arm: Array) -> Array:
    """Velocities of the joints x, y, yaw and the arm's that base inputs and arm mean."""
    ahead, left = float(base[0]), float(base[1]) if len(base) == 3 else 0.0
    c, s = math.cos(heading), math.sin(heading)
    return np.concatenate(([c * ahead - s * left, s * ahead + c * left, base[-1]], arm))


def _build(problem: Problem, arguments: Sequence[str]) -> Ours:
    return Ours(problem, *arguments)


if __name__ == "__main__":
    serve(_build)
