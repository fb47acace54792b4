"""Which pairs are within the reach of their dampers, and their closest points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.closest import (
    ClosestPoints,
    segment_cylinder,
    segment_prism,
    segment_segment,
)
from motm_wbc.kinematics import Configuration, RobotModel
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.dampers import Dampers, scene_dampers, self_pairs
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.segments import RobotSegments
from motm_wbc.qp.shapes import BASE, SceneShapes
from motm_wbc.qp.tasks import HeldObject


@dataclass(frozen=True, slots=True, eq=False)
class NearPairs:
    """The m pairs within the reach of their dampers.

    Attributes:
        first: (m,) segment of the robot.
        second: (m,) part of the scene, or, counted on behind the parts, a segment.
        distance: (m,) signed distance of the surfaces [m].
        normal: (m, 3) unit vector from first to second.
        point: (m, 3) point of first that is nearest to second [m].
        dampers: (m,) their distances and speeds.
    """

    first: IntArray
    second: IntArray
    distance: Array
    normal: Array
    point: Array
    dampers: Dampers

    def __len__(self) -> int:
        return len(self.first)


class Neighbourhood:
    """Finds the near pairs of robot, held object, scene and the robot's own base.

    A rough distance, never too large, picks the pairs that the exact one is worked out for.

    Attributes:
        segments: the robot's, with what is held.
        shapes: the scene's, with the robot's base.

    Args:
        model: the robot.
        parameters: of the controller.
    """

    def __init__(self, model: RobotModel, parameters: WholeBodyParameters) -> None:
        self._model = model
        self._parameters = parameters
        self._target: str | None = None
        self.shapes = SceneShapes(model.footprint, model.base_height)
        self._classify(RobotSegments(model, None))

    def update(
        self,
        bodies: Sequence[Body],
        base_pose: Array,
        target: str | None,
        held: HeldObject | None,
    ) -> bool:
        """Take over the world. Returns whether pairs may have other numbers than before."""
        rebuilt = self.shapes.update(bodies, base_pose)
        other_segments = not self.segments.matches(held)
        if rebuilt or other_segments or target != self._target:
            self._target = target
            self._classify(RobotSegments(self._model, held) if other_segments else self.segments)
            return True
        return False

    def find(self, configuration: Configuration) -> NearPairs:
        """All pairs within the reach of their dampers."""
        ends = self.segments.ends(configuration)
        centres = 0.5 * (ends[:, 0] + ends[:, 1])
        gaps = self.shapes.gaps(centres, self.segments.ball)
        first, part = np.nonzero(gaps < self._scene.reach)
        prism = self.shapes.is_prism(part)
        flat, round_ones = np.flatnonzero(prism), np.flatnonzero(~prism)
        apart = centres[self._pairs[:, 0]] - centres[self._pairs[:, 1]]
        near = (apart * apart).sum(axis=1) < self._pair_reach
        pairs = np.flatnonzero(near)
        groups = []
        if flat.size:
            i, s = first[flat], part[flat]
            points = segment_prism(ends[i, 0], ends[i, 1], self.shapes.prisms.take(s))
            groups.append((i, s, points, self._scene_entry(i, s)))
        if round_ones.size:
            i, s = first[round_ones], part[round_ones]
            rows = self.shapes.cylinder_rows(s)
            points = segment_cylinder(ends[i, 0], ends[i, 1], self.shapes.cylinders.take(rows))
            groups.append((i, s, points, self._scene_entry(i, s)))
        if pairs.size:
            i, j = self._pairs[pairs].T
            points = segment_segment(ends[i, 0], ends[i, 1], ends[j, 0], ends[j, 1])
            points.distance[:] -= self.segments.radius[j]
            own = self._own
            entry = np.stack((own.safe[pairs], own.rate[pairs], own.reach[pairs]))
            groups.append((i, j + len(self.shapes.owner), points, entry))
        return self._within(groups)

    def name(self, first: int, second: int) -> str:
        """Names of the two bodies of a pair."""
        parts = len(self.shapes.owner)
        if second >= parts:
            other = self.segments.names[second - parts]
        else:
            owner = int(self.shapes.owner[second])
            other = "base" if owner == BASE else self.shapes.bodies[owner].name
        return f"{self.segments.names[first]} - {other}"

    def _classify(self, segments: RobotSegments) -> None:
        self.segments = segments
        model, parameters = self._model, self._parameters
        self._scene = scene_dampers(
            segments, self.shapes.owner, self.shapes.bodies, self._target, model, parameters
        )
        self._pairs = self_pairs(segments, model)
        own = [parameters.pairs.self_collision] * len(self._pairs)
        self._own = Dampers.of(own, model, parameters)
        balls = segments.ball[self._pairs].sum(axis=1)
        self._pair_reach = (balls + self._own.reach) ** 2

    def _scene_entry(self, first: IntArray, part: IntArray) -> Array:
        scene = self._scene
        return np.stack(
            (scene.safe[first, part], scene.rate[first, part], scene.reach[first, part])
        )

    def _within(self, groups: list[tuple[IntArray, IntArray, ClosestPoints, Array]]) -> NearPairs:
        """The pairs of all groups that are near by their exact distance, too."""
        if not groups:
            return _NOTHING
        first = np.concatenate([group[0] for group in groups])
        second = np.concatenate([group[1] for group in groups])
        distance = np.concatenate([group[2].distance for group in groups])
        distance -= self.segments.radius[first]
        entries = np.concatenate([group[3] for group in groups], axis=1)
        keep = np.flatnonzero(distance < entries[2])
        normal = np.concatenate([group[2].normal for group in groups])[keep]
        point = np.concatenate([group[2].on_segment for group in groups])[keep]
        entries = entries[:, keep]
        dampers = Dampers(entries[0], entries[1], entries[2])
        return NearPairs(first[keep], second[keep], distance[keep], normal, point, dampers)


_NOTHING = NearPairs(
    np.empty(0, dtype=np.intp),
    np.empty(0, dtype=np.intp),
    np.empty(0),
    np.empty((0, 3)),
    np.empty((0, 3)),
    Dampers(np.empty(0), np.empty(0), np.empty(0)),
)
