"""What is reported of a contestant on a problem."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np

from motm_wbc.experiments.bench.shared.motm_bench import Problem
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel

RUN_IN = 10  # states at a round's start that don't count: the sequence has jumped to its start
_MICRO = 1e-3  # us in a ns


class Figures(TypedDict):
    """Of one contestant on one problem.

    Attributes:
        median: wall time of a step [us].
        p99: CPU time of a step that 99 of 100 steps keep [us].
        wall_p99: the same of wall time [us].
        cpu_median: median CPU time [us].
        count: steps that the times are of.
        failed: steps for which it raised.
        tool_error: median deviation of the tool from what is asked [m/s].
        solver: of its QP.
        library: name and version.
    """

    median: float
    p99: float
    wall_p99: float
    cpu_median: float
    count: int
    failed: int
    tool_error: float | None
    solver: str
    library: str


def figures(
    rounds: Sequence[dict[str, Any]], about: dict[str, Any], tool_error: float | None
) -> Figures:
    """The figures of all rounds of a contestant.

    Args:
        rounds: of `Worker.round`.
        about: of `Worker`.
        tool_error: see `Figures`.
    """
    wall, cpu = (
        np.concatenate([one[key][RUN_IN:] for one in rounds]) * _MICRO for key in ("wall", "cpu")
    )
    return Figures(
        median=round(float(np.median(wall)), 2),
        p99=round(float(np.percentile(cpu, 99)), 2),
        wall_p99=round(float(np.percentile(wall, 99)), 2),
        cpu_median=round(float(np.median(cpu)), 2),
        count=len(wall),
        failed=sum(int(one["failed"]) for one in rounds),
        tool_error=tool_error,
        solver=str(about["solver"]),
        library=str(about["library"]),
    )


def tool_error(model: RobotModel, problem: Problem, velocities: Array) -> float | None:
    """Median over the states of |wanted - commanded| velocity of the tool [m/s].

    Args:
        model: the problem's robot.
        problem: its states and targets.
        velocities: (n, nv) that are commanded; rows of no numbers don't count.
    """
    deviations = []
    for q, twist, v in zip(problem.q, problem.twist, velocities, strict=True):
        if np.isfinite(v).all():
            here = model.configuration(q[:3], q[3:])
            offset = here.T_world_tool[:3, 3] - here.T_world_base[:3, 3]
            reached = np.array([v[0] - v[2] * offset[1], v[1] + v[2] * offset[0], 0.0])
            reached += here.J_tool[:3, model.n_base :] @ v[3:]
            deviations.append(float(np.linalg.norm(twist[:3] - reached)))
    return round(float(np.median(deviations)), 5) if deviations else None
