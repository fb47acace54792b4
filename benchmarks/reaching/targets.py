"""Targets that count: with a legal arm posture at the end and a free straight way to it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.reaching.distances import ExactDistances
from benchmarks.reaching.path import StraightPath
from benchmarks.reaching.scenes import Region, Scene
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel, solve_ik
from motm_wbc.kinematics.rotations import axis_angle

_IK_STARTS = 40
_ENOUGH = 6  # legal solutions, of which the one nearest to the start is kept
_START_SPREAD = 0.25  # [rad] about home
_START_ROOM = 0.05  # [rad] to the joints' limits
_NEAREST = 0.15  # [m] that a reach is long at least
_SHARES = {"table": 0.4, "shelf": 0.4, "air": 0.2}  # every scene has regions of all kinds


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """One reach to be tried.

    Attributes:
        index: in its scene.
        kind: of region it is in.
        T_world_target: (4, 4).
        q_start: (n_arm,) where the arm starts.
        q_found: (n_arm,) a legal posture at the target, the nearest to the start of those
            that were found.
        drawn: targets that were drawn until one counted.
        free: of these, how many had a free straight way.
    """

    index: int
    kind: str
    T_world_target: Array
    q_start: Array
    q_found: Array
    drawn: int
    free: int


def find_target(
    model: RobotModel, scene: Scene, distances: ExactDistances, index: int, attempts: int = 500
) -> Target | None:
    """Draw a kind of region, then starts and targets there until one counts; None if none does.

    Args:
        model: the robot, base at the origin.
        scene: what stands around it.
        distances: of that scene.
        index: number of the target; seeds the draw, together with the scene's seed.
        attempts: draws after which to give up.
    """
    rng = np.random.default_rng([scene.seed, 1, index])
    free = 0
    kind = str(rng.choice(list(_SHARES), p=list(_SHARES.values())))
    regions = [region for region in scene.regions if region.kind == kind]
    for drawn in range(1, attempts + 1):
        q_start = _draw_start(rng, model)
        T_target = _draw_pose(rng, regions[int(rng.integers(len(regions)))])
        if not distances.is_legal(q_start):
            continue
        T_start = model.configuration(np.zeros(3), q_start).T_world_tool
        T_target = _nearer_grasp(model, T_start, T_target)
        path = StraightPath(T_start, T_target)
        if path.length < _NEAREST or not _within_reach(model, T_target):
            continue
        if not distances.is_free_for_hand(path.samples()):
            continue
        free += 1
        q_found = _legal_posture(rng, model, distances, T_target, q_start)
        if q_found is not None:
            return Target(index, kind, T_target, q_start, q_found, drawn, free)
    return None


def _draw_start(rng: np.random.Generator, model: RobotModel) -> Array:
    q = model.home + rng.normal(0.0, _START_SPREAD, model.n_arm)
    return np.clip(q, model.q_lower + _START_ROOM, model.q_upper - _START_ROOM)


def _draw_pose(rng: np.random.Generator, region: Region) -> Array:
    """(4, 4) a tool pose in a region."""
    T = np.eye(4)
    T[:3, 3] = (region.T_world_region @ np.append(rng.uniform(-region.half, region.half), 1.0))[:3]
    T[:3, :3] = _draw_rotation(rng, region)
    return T


def _draw_rotation(rng: np.random.Generator, region: Region) -> Array:
    """(3, 3) tool axes: z near the region's approach, turned by any angle about it."""
    if region.tilt >= math.pi:
        return np.asarray(Rotation.random(random_state=rng).as_matrix())
    z = region.approach
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    upright = np.column_stack((x, np.cross(z, x), z))
    turn = axis_angle(z, rng.uniform(-math.pi, math.pi))
    sideways = axis_angle(z, rng.uniform(-math.pi, math.pi)) @ x
    tilt = axis_angle(sideways, region.tilt * math.sqrt(rng.random()))
    return np.asarray(tilt @ turn @ upright)


def _nearer_grasp(model: RobotModel, T_start: Array, T_target: Array) -> Array:
    """Of the two poses in which the fingers grasp the same, the one that is turned less."""
    other = T_target.copy()
    approach = np.asarray(model.description.tool.approach_axis)
    other[:3, :3] = T_target[:3, :3] @ axis_angle(approach, math.pi)
    turned = [float(np.trace(T[:3, :3] @ T_start[:3, :3].T)) for T in (T_target, other)]
    return T_target if turned[0] >= turned[1] else other


def _within_reach(model: RobotModel, T_target: Array) -> bool:
    """Cheap: no arm reaches farther than its links are long together."""
    shoulder = model.T_base_arm[:3, 3]
    return float(np.linalg.norm(T_target[:3, 3] - shoulder)) < 1.3


def _legal_posture(
    rng: np.random.Generator,
    model: RobotModel,
    distances: ExactDistances,
    T_target: Array,
    q_start: Array,
) -> Array | None:
    """(n_arm,) of the legal solutions from many starts the one nearest to `q_start`."""
    found: list[Array] = []
    for k in range(_IK_STARTS):
        start = q_start if k == 0 else rng.uniform(model.q_lower, model.q_upper)
        result = solve_ik(model, T_target, start)
        if result.converged and distances.is_legal(result.q):
            found.append(result.q)
            if len(found) == _ENOUGH:
                break
    if not found:
        return None
    return min(found, key=lambda q: float(np.abs(q - q_start).max()))
