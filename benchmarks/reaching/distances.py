"""Exact distances of the robot's capsules by coal, which the controller does not use."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import coal
import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import Part, RobotModel
from motm_wbc.kinematics.pairs import classify
from motm_wbc.kinematics.parameters import PairClasses
from motm_wbc.kinematics.rotations import planar_pose
from motm_wbc.qp import Body

_OWN_BASE = -1


@dataclass(frozen=True, slots=True)
class Margin:
    """The least of distance less safe distance of any pair.

    Attributes:
        value: [m]; negative: nearer than the safe distance.
        pair: names of the two bodies.
        kind: name of the class of pairs.
        step: index of the instant.
    """

    value: float
    pair: str
    kind: str
    step: int


@dataclass(frozen=True, slots=True, eq=False)
class _Solid:
    """A body for coal: its place, and half the extents of a box about it."""

    name: str
    geometry: object
    T: Array
    half: Array


class ExactDistances:
    """Distances of capsules to solids, to the base's box and to each other.

    A bound by balls and boxes, never too large, tells which pairs coal must look at.

    Args:
        model: the robot.
        bodies: boxes and cylinders of the scene, at rest.
        classes: the safe distances.
    """

    def __init__(
        self, model: RobotModel, bodies: Sequence[Body], classes: PairClasses | None = None
    ) -> None:
        classes = classes or PairClasses()
        self._model = model
        self._solids = [_solid(body) for body in bodies]
        self._solids.append(_base(model))
        ends = model.capsule_ends
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        radius = model.capsules.radius
        self._ball = 0.5 * length + radius
        self._capsules = [
            coal.Capsule(float(thick), float(long))
            for thick, long in zip(radius, length, strict=True)
        ]
        count = len(self._ball)
        # rows: capsules; columns: solids, the own base last
        self._safe = np.full((count, len(self._solids)), -np.inf)
        self._kind = [[""] * len(self._solids) for _ in range(count)]
        for i, part in enumerate(model.capsules.part):
            for j, body in enumerate(bodies):
                pair = classify(part, body.role, classes=classes)
                if pair is not None:
                    self._safe[i, j], self._kind[i][j] = pair.safe, pair.name
        for i in model.base_pairs:
            self._safe[i, _OWN_BASE] = classes.arm_base.safe
            self._kind[i][_OWN_BASE] = classes.arm_base.name
        self._self_safe = classes.self_collision.safe
        self._self_kind = classes.self_collision.name
        self._request = coal.DistanceRequest()
        self._is_hand = np.array([part is not Part.ARM for part in model.capsules.part])
        stands = model.capsule_moved_by[:, model.n_base :].sum(axis=1) <= 1.0
        self._standing_pairs = [
            (i, j)
            for i, j in model.self_pairs
            if (stands[i] and self._is_hand[j]) or (stands[j] and self._is_hand[i])
        ]

    def of_run(self, base_poses: Array, q: Array) -> Margin:
        """The least margin of all pairs in all configurations.

        Args:
            base_poses: (t, 3).
            q: (t, n_arm).
        """
        ends = np.stack(
            [
                self._model.configuration(pose, joints).capsule_segments()
                for pose, joints in zip(base_poses, q, strict=True)
            ]
        )
        ignored = np.zeros(self._safe.shape, dtype=bool)
        return self._least(base_poses, ends, ignored, math.inf, self._model.self_pairs)

    def is_legal(self, q: Array) -> bool:
        """Whether with the base at the origin every pair keeps its safe distance."""
        ends = self._model.configuration(np.zeros(3), q).capsule_segments()[None]
        ignored = np.zeros(self._safe.shape, dtype=bool)
        return (
            self._least(np.zeros((1, 3)), ends, ignored, 0.0, self._model.self_pairs).value >= 0.0
        )

    def is_free_for_hand(self, T_world_tool: Array) -> bool:
        """Whether hand and fingers alone keep their safe distances at tool poses (t, 4, 4).

        What stands while the arm moves counts: the scene, the base at the origin, and the
        links that at most one joint moves, at home.
        """
        model = self._model
        at_home = model.configuration(np.zeros(3), model.home)
        T_tool_world = np.linalg.inv(at_home.T_world_tool)
        local = at_home.capsule_segments() @ T_tool_world[:3, :3].T + T_tool_world[:3, 3]
        turned = np.einsum("tij,knj->tkni", T_world_tool[:, :3, :3], local)
        ends = turned + T_world_tool[:, None, None, :3, 3]
        ends[:, ~self._is_hand] = at_home.capsule_segments()[~self._is_hand]
        ignored = np.ones(self._safe.shape, dtype=bool)
        ignored[self._is_hand] = False
        poses = np.zeros((len(T_world_tool), 3))
        return self._least(poses, ends, ignored, 0.0, self._standing_pairs).value >= 0.0

    def _least(
        self,
        base_poses: Array,
        ends: Array,
        ignored: Array,
        below: float,
        own_pairs: Sequence[tuple[int, int]],
    ) -> Margin:
        """The least margin if it is smaller than `below`, else one of that value."""
        best = Margin(below, "", "", -1)
        centres = ends.mean(axis=2)
        for j, solid in enumerate(self._solids):
            is_base = j == len(self._solids) - 1
            T = np.stack([planar_pose(pose) for pose in base_poses]) if is_base else np.eye(4)[None]
            T = T @ solid.T
            local = np.einsum("tji,tkj->tki", T[:, :3, :3], centres - T[:, None, :3, 3])
            gap = np.linalg.norm(np.maximum(np.abs(local) - solid.half, 0.0), axis=2)
            bound = gap - self._ball - self._safe[:, j]
            bound[:, ignored[:, j]] = np.inf
            for flat in np.argsort(bound, axis=None):
                t, i = divmod(int(flat), len(self._ball))
                if not bound[t, i] < best.value:
                    break
                place = T[t] if is_base else T[0]
                distance = self._distance(i, ends[t, i], solid.geometry, place)
                margin = distance - float(self._safe[i, j])
                if margin < best.value:
                    name = f"{self._model.capsules.names[i]} - {solid.name}"
                    best = Margin(margin, name, self._kind[i][j], t)
        return self._least_of_own(ends, centres, own_pairs, best)

    def _least_of_own(
        self, ends: Array, centres: Array, pairs: Sequence[tuple[int, int]], best: Margin
    ) -> Margin:
        for i, j in pairs:
            gap = np.linalg.norm(centres[:, i] - centres[:, j], axis=1)
            bound = gap - self._ball[i] - self._ball[j] - self._self_safe
            for t in np.argsort(bound).tolist():
                if not bound[t] < best.value:
                    break
                place = _capsule_pose(ends[t, j])
                distance = self._distance(i, ends[t, i], self._capsules[j], place)
                margin = distance - self._self_safe
                if margin < best.value:
                    names = self._model.capsules.names
                    best = Margin(margin, f"{names[i]} - {names[j]}", self._self_kind, t)
        return best

    def _distance(self, capsule: int, ends: Array, other: object, T_other: Array) -> float:
        result = coal.DistanceResult()
        T = _capsule_pose(ends)
        first = coal.Transform3s(T[:3, :3], T[:3, 3])
        second = coal.Transform3s(T_other[:3, :3], T_other[:3, 3])
        coal.distance(self._capsules[capsule], first, other, second, self._request, result)
        return float(result.min_distance)


def _capsule_pose(ends: Array) -> Array:
    """(4, 4) a frame in the middle of a segment (2, 3), z along it.

    The other axes by Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
    """
    (ax, ay, az), (bx, by, bz) = ends.tolist()
    x, y, z = bx - ax, by - ay, bz - az
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = (x / length, y / length, z / length) if length > 0.0 else (0.0, 0.0, 1.0)
    sign = math.copysign(1.0, z)
    p = -1.0 / (sign + z)
    q = x * y * p
    return np.array(
        [
            [1.0 + sign * x * x * p, q, x, 0.5 * (ax + bx)],
            [sign * q, sign + y * y * p, y, 0.5 * (ay + by)],
            [-sign * x, -y, z, 0.5 * (az + bz)],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _solid(body: Body) -> _Solid:
    height = body.top - body.bottom
    T = planar_pose(body.pose)
    T[2, 3] = body.bottom + 0.5 * height
    if body.radius is not None:
        half = np.array([body.radius, body.radius, 0.5 * height])
        return _Solid(body.name, coal.Cylinder(body.radius, height), T, half)
    half = np.array([*(0.5 * np.ptp(body.outlines[0], axis=0)), 0.5 * height])
    return _Solid(body.name, coal.Box(*(2.0 * half)), T, half)


def _base(model: RobotModel) -> _Solid:
    T = np.eye(4)
    T[:3, 3] = model.base_box.centre
    return _Solid("base", coal.Box(*model.base_box.size), T, 0.5 * np.asarray(model.base_box.size))
