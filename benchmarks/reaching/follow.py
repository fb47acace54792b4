"""Whether any arm motion could follow the straight way: what no controller could have done."""

from __future__ import annotations

import numpy as np

from benchmarks.reaching.distances import ExactDistances
from benchmarks.reaching.path import StraightPath
from benchmarks.reaching.scenes import Scene
from benchmarks.reaching.targets import Target
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel, solve_ik
from motm_wbc.kinematics.parameters import IkParameters

_LINEAR_STEP = 0.03  # [m] of the tool from one set of postures to the next
_ANGULAR_STEP = 0.1  # [rad]
_JOINT_STEP = 0.5  # [rad] that a joint may move meanwhile
_WIDTH = 12  # postures that are followed side by side
_TRIES = 4  # starts from each of them
_SPREAD = 0.12  # [rad]
_ALIKE = 0.04  # [rad] by which postures must differ to be two
_IK = IkParameters(
    posture_gain=0.0, max_iterations=15, position_tolerance=1e-3, angle_tolerance=5e-3
)


def followed_share(
    model: RobotModel, scene: Scene, distances: ExactDistances, target: Target
) -> float:
    """Share of the straight way that some chain of legal postures was found to follow.

    From the start on, a set of postures is led from sample to sample of the way, base at the
    origin. The search is random and coarse: less than one means that none was found.
    """
    T_start = model.configuration(np.zeros(3), target.q_start).T_world_tool
    path = StraightPath(T_start, target.T_world_target)
    rng = np.random.default_rng([scene.seed, 2, target.index])
    count = int(max(path.length / _LINEAR_STEP, path.angle / _ANGULAR_STEP)) + 2
    postures = [target.q_start]
    for step in range(1, count + 1):
        T = path.pose(step / count)
        following: list[Array] = []
        for q in postures:
            for attempt in range(_TRIES):
                start = q if attempt == 0 else q + rng.normal(0.0, _SPREAD, model.n_arm)
                result = solve_ik(model, T, start, parameters=_IK)
                near = float(np.abs(result.q - q).max()) < _JOINT_STEP
                if not (result.converged and near and _is_new(result.q, following)):
                    continue
                if distances.is_legal(result.q):
                    following.append(result.q)
        if not following:
            return (step - 1) / count
        postures = _most_different(following)
    return 1.0


def _is_new(q: Array, others: list[Array]) -> bool:
    return all(float(np.abs(q - other).max()) > _ALIKE for other in others)


def _most_different(postures: list[Array]) -> list[Array]:
    """At most so many of them as are followed: each as far from the others as can be."""
    chosen = [postures[0]]
    gaps = np.array([float(np.abs(q - postures[0]).max()) for q in postures])
    while len(chosen) < min(_WIDTH, len(postures)):
        farthest = int(gaps.argmax())
        chosen.append(postures[farthest])
        gaps = np.minimum(gaps, [float(np.abs(q - postures[farthest]).max()) for q in postures])
    return chosen
