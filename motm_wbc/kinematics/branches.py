"""Which branch of the arm holds a pose longest while the base drives by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.following import ArmNumbers, arm_numbers, follow, is_clear
from motm_wbc.kinematics.inverse import ALL_AXES, solve_ik
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.parameters import IkParameters, PairClasses
from motm_wbc.kinematics.rotations import inverse_pose, planar_pose
from motm_wbc.scene.files import Data


class HoldParameters(Data):
    """The search for the longest hold."""

    starts: Annotated[int, Field(ge=1, le=1000)] = 12
    """Postures that inverse kinematics starts from: the given one, and others over the range."""
    anchors: Annotated[int, Field(ge=1, le=1000)] = 5
    """Poses along the way, beside the nearest, from which the first holds are grown."""
    distinct: Annotated[float, Field(gt=0.0, le=3.0)] = 0.1
    """Largest difference of a joint below which two postures count as one [rad or m]."""
    posture_gain: Annotated[float, Field(ge=0.0, le=100.0)] = 0.5
    """Speed toward the preferred posture per distance from it, in the nullspace [1/s]."""
    as_good: Annotated[float, Field(gt=0.0, le=1.0)] = 0.95
    """Share of the longest hold from which on the posture nearest to the given one is taken."""
    ik: IkParameters = IkParameters(max_iterations=30)
    """Tolerances of a pose that is held."""
    pairs: PairClasses = PairClasses()
    """Distances that the arm keeps from itself and from the base."""


_DEFAULT = HoldParameters()
_DIGITS = 3  # of a distance [m]; on a circle about the target all base poses are as near


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """A continuous joint path that holds a pose while the base drives, inside all limits.

    Attributes:
        first: index of the base pose at which it begins.
        q: (k, n_arm) joint positions at the base poses from `first` on [rad or m].
        q_anchor: (n_arm,) posture that it was grown from, in both directions of time.
    """

    first: int
    q: Array
    q_anchor: Array

    @property
    def last(self) -> int:
        """Index of the base pose at which it ends."""
        return self.first + len(self.q) - 1


def longest_hold(
    model: RobotModel,
    T_world_target: Array,
    base_poses: Array,
    dt: float,
    axis_weights: Array | tuple[float, ...] = ALL_AXES,
    q_now: Array | None = None,
    parameters: HoldParameters = _DEFAULT,
) -> Hold | None:
    """The joint path that holds a pose over the longest part of the base's way.

    A hold is grown from one posture at one base pose: the arm follows the target, on and back
    in time, until a joint's range or speed, or its distance from itself or the base, would be
    passed. A path that is fit for one direction of time is fit for the other, so both parts
    make one. The first holds grow from the given posture, at base poses all along the way. In
    the middle of the longest of them, deep inside the arm's range, inverse kinematics from
    many starts gives the arm's branches, and a hold is grown from each. Deterministic.

    Args:
        model: the robot.
        T_world_target: (4, 4) pose of the tool that is held.
        base_poses: (n, 3) the base's way: x [m], y [m], heading [rad].
        dt: time between these poses [s].
        axis_weights: (6,) along and about the tool's x, y, z axes; 0 leaves an axis free.
        q_now: (n_arm,) where the arm is; decides among holds of about one length. The
            home posture if not given.
        parameters: of the search.

    Returns:
        The hold, or None where no branch holds the pose at all.

    Raises:
        InputError: there is no base pose, or no time between them.
    """
    if len(base_poses) == 0 or not dt > 0.0:
        raise InputError("a hold needs base poses and a positive time between them")
    T_base_targets = np.array([inverse_pose(planar_pose(p)) @ T_world_target for p in base_poses])
    counted = (np.asarray(axis_weights, dtype=float) > 0.0).astype(float)
    now = model.home if q_now is None else np.asarray(q_now, dtype=float)
    search = _Search(model, arm_numbers(model), T_base_targets, counted, dt, now, parameters)
    holds = search.first_holds()
    if holds:
        longest = max(holds, key=lambda hold: len(hold.q))
        anchor = (longest.first + longest.last) // 2
    else:
        anchor = search.anchors()[0]
    holds += [search.grow(anchor, q) for q in search.branches(anchor)]
    if not holds:
        return None
    good = parameters.as_good * max(len(hold.q) for hold in holds)
    return min(
        (hold for hold in holds if len(hold.q) >= good),
        key=lambda hold: float(np.linalg.norm((hold.q_anchor - now) / model.v_max)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What all steps of the search need."""

    model: RobotModel
    arm: ArmNumbers
    T_base_targets: Array
    counted: Array
    dt: float
    q_now: Array
    parameters: HoldParameters

    def anchors(self) -> list[int]:
        """Indices of the pose nearest to the target, and of others along the way; nearest first."""
        last = len(self.T_base_targets) - 1
        away = self.T_base_targets[:, :3, 3] - self.model.T_base_arm[:3, 3]
        distance = np.linalg.norm(away, axis=1).round(_DIGITS)
        off_middle = np.abs(np.arange(last + 1) - 0.5 * last)
        near = np.lexsort((off_middle, distance))
        spread = np.linspace(0.0, last, min(self.parameters.anchors, last + 1)).round()
        wanted = {int(near[0]), *spread.astype(int).tolist()}
        return [index for index in near.tolist() if index in wanted]

    def first_holds(self) -> list[Hold]:
        """Holds that grow from the given posture, none from a base pose that another covers."""
        holds: list[Hold] = []
        for index in self.anchors():
            if any(hold.first <= index <= hold.last for hold in holds):
                continue
            q = self._solve(index, self.q_now)
            if q is not None:
                holds.append(self.grow(index, q))
        return holds

    def branches(self, anchor: int) -> list[Array]:
        """Postures (n_arm,) that hold the target at one base pose, each but once."""
        found: list[Array] = []
        for start in self._starts():
            answer = self._solve(anchor, start)
            if answer is not None and all(self._differ(answer, other) for other in found):
                found.append(answer)
        return found

    def grow(self, anchor: int, q_anchor: Array) -> Hold:
        """The hold that a posture at one base pose is part of."""
        p, posture = self.parameters, self.model.posture
        q = np.empty((len(self.T_base_targets), self.model.n_arm))
        q[anchor] = q_anchor
        share = min(p.posture_gain * self.dt, 1.0)
        pull = share * posture.weight / max(float(posture.weight.max()), 1e-9)
        tolerance = p.ik.position_tolerance, p.ik.angle_tolerance
        first, last = (
            follow(
                self.arm, self.T_base_targets, self.counted, self.dt, posture.value, pull,
                tolerance, self._safe, anchor, way, q,
            )
            for way in (-1, 1)
        )  # fmt: skip
        return Hold(first, q[first : last + 1], q_anchor)

    @property
    def _safe(self) -> tuple[float, float]:
        pairs = self.parameters.pairs
        return pairs.self_collision.safe, pairs.arm_base.safe

    def _starts(self) -> list[Array]:
        """Postures that inverse kinematics starts from: the given one and a fixed random set."""
        model = self.model
        lower = np.maximum(model.q_lower, -math.pi)
        upper = np.minimum(model.q_upper, math.pi)
        others = np.random.default_rng(0).uniform(
            lower, upper, (self.parameters.starts - 1, model.n_arm)
        )
        return [self.q_now, *others]

    def _solve(self, index: int, q_start: Array) -> Array | None:
        T = self.T_base_targets[index]
        answer = solve_ik(self.model, T, q_start, self.counted, self.parameters.ik)
        fit = answer.converged and is_clear(self.arm, self._safe, answer.q)
        return answer.q if fit else None

    def _differ(self, first: Array, second: Array) -> bool:
        return float(np.abs(first - second).max()) > self.parameters.distinct
