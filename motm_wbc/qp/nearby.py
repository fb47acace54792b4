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
        known = self.segments.regrip(held)
        if known and not rebuilt and target == self._target:
            return False
        self._target = target
        self._classify(self.segments if known else RobotSegments(self._model, held))
        return True

    def find(self, configuration: Configuration) -> NearPairs:
        """All pairs within the reach of their dampers."""
        ends = self.segments.ends(configuration)
        a, b = ends[:, 0], ends[:, 1]
        centres = 0.5 * (a + b)
        close = self.shapes.gaps(centres, self.segments.ball) < self._reach
        prisms = self.shapes.prism_count
        flat, flat_part = np.nonzero(close[:, :prisms])
        tall, tall_part = np.nonzero(close[:, prisms:])
        apart = centres[self._pairs[:, 0]] - centres[self._pairs[:, 1]]
        pairs = self._pairs[np.add.reduce(apart * apart, axis=1) < self._pair_reach]
        groups: list[tuple[IntArray, IntArray, ClosestPoints]] = []
        if len(flat):
            points = segment_prism(a[flat], b[flat], self.shapes.prisms.take(flat_part))
            groups.append((flat, flat_part, points))
        if len(tall):
            points = segment_cylinder(a[tall], b[tall], self.shapes.cylinders.take(tall_part))
            groups.append((tall, tall_part + prisms, points))
        if len(pairs):
            i, j = pairs[:, 0], pairs[:, 1]
            groups.append((i, j + self._parts, segment_segment(a[i], b[i], a[j], b[j])))
        return self._within(groups)

    def name(self, first: int, second: int) -> str:
        """Names of the two bodies of a pair."""
        if second >= self._parts:
            other = self.segments.names[second - self._parts]
        else:
            owner = int(self.shapes.owner[second])
            other = "base" if owner == BASE else self.shapes.bodies[owner].name
        return f"{self.segments.names[first]} - {other}"

    def _classify(self, segments: RobotSegments) -> None:
        """Look up once what holds for each pair that there can be."""
        self.segments = segments
        model, parameters = self._model, self._parameters
        scene = scene_dampers(
            segments, self.shapes.owner, self.shapes.bodies, self._target, model, parameters
        )
        self._pairs = self_pairs(segments, model)
        own = Dampers.of([parameters.pairs.self_collision], model, parameters)
        self._parts, count = len(self.shapes.owner), len(segments)
        table = np.empty((3, count, self._parts + count))
        table[:, :, : self._parts] = scene.safe, scene.rate, scene.reach
        table[:, :, self._parts :] = np.array([own.safe, own.rate, own.reach])[:, :, None]
        self._table, self._reach = table, scene.reach
        # what lies between the segments' cores and the surfaces of both bodies
        self._skin = np.zeros((count, self._parts + count))
        self._skin += segments.radius[:, None]
        self._skin[:, self._parts :] += segments.radius
        balls = segments.ball[self._pairs].sum(axis=1)
        self._pair_reach = (balls + float(own.reach[0])) ** 2

    def _within(self, groups: list[tuple[IntArray, IntArray, ClosestPoints]]) -> NearPairs:
        """The pairs of all groups that are near by their exact distance, too."""
        if not groups:
            return _NOTHING
        first = np.concatenate([group[0] for group in groups])
        second = np.concatenate([group[1] for group in groups])
        distance = np.concatenate([group[2].distance for group in groups])
        distance -= self._skin[first, second]
        entries = self._table[:, first, second]
        keep = np.nonzero(distance < entries[2])[0]
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
