"""Which pairs are within the reach of their dampers, and their closest points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.distance import segment_cylinder, segment_prism, segment_segment
from motm_wbc.geometry.jit import kernel
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.dampers import Dampers, scene_dampers, self_pairs
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.segments import RobotSegments, SegmentArrays
from motm_wbc.qp.shapes import BASE, SceneArrays, SceneShapes
from motm_wbc.qp.tasks import HeldObject


class PairArrays(NamedTuple):
    """What holds for each pair that there can be: k segments, s solids of the scene.

    Solids are numbered first, segments as second bodies after them.

    Attributes:
        safe: (k, s + k) distances that are kept [m].
        rate: (k, s + k) allowed approach speed per distance beyond [1/s].
        reach: (k, s) distances within which pairs with the scene count [m]; -inf: never.
        widest: (s,) largest reach of each solid [m].
        own: (p, 2) segments of the robot that must keep apart.
        own_reach: (1,) distance within which these count [m].
    """

    safe: Array
    rate: Array
    reach: Array
    widest: Array
    own: IntArray
    own_reach: Array


class NearArrays(NamedTuple):
    """Near pairs; room for all that there can be.

    Attributes:
        ends: (k, 2, 3) ends of the robot's segments in the world [m].
        solids: (s,) numbers of the solids that any segment could be near to.
        pair: (c, 2) segment, and solid or, counted on behind these, other segment.
        contact: (c, 7) signed distance of the surfaces [m], point on the segment's core
            [m], unit vector from the segment to the other body.
    """

    ends: Array
    solids: IntArray
    pair: IntArray
    contact: Array


@kernel
def find_near(
    segments: SegmentArrays, scene: SceneArrays, pairs: PairArrays, near: NearArrays
) -> int:
    """Write the pairs within the reach of their dampers to `near`; returns their number.

    Boxes about the solids give rough distances, never too large, that spare the exact ones.
    """
    count = 0
    parts = len(scene.radius)
    n_near = _solids_near_robot(segments, scene, pairs, near)
    for k in range(len(segments.joint)):
        a, b = near.ends[k, 0], near.ends[k, 1]
        x, y, z = 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])
        for index in range(n_near):
            j = near.solids[index]
            margin = pairs.reach[k, j] + segments.ball[k]
            low, high = scene.box_low[j], scene.box_high[j]
            dx = max(low[0] - x, x - high[0], 0.0)
            dy = max(low[1] - y, y - high[1], 0.0)
            dz = max(low[2] - z, z - high[2], 0.0)
            if margin < 0.0 or dx * dx + dy * dy + dz * dz >= margin * margin:
                continue
            contact = near.contact[count]
            first, last = scene.first_edge[j], scene.first_edge[j + 1]
            bottom, top = scene.faces[j, 0], scene.faces[j, 1]
            if first == last:
                centre = scene.poses[j]
                segment_cylinder(a, b, centre[0], centre[1], scene.radius[j], bottom, top, contact)
            else:
                segment_prism(a, b, scene.edges[first:last], bottom, top, contact)
            contact[0] -= segments.radius[k]
            if contact[0] < pairs.reach[k, j]:
                near.pair[count, 0], near.pair[count, 1] = k, j
                count += 1
    for p in range(len(pairs.own)):
        i, j = pairs.own[p, 0], pairs.own[p, 1]
        if _balls_apart(segments, near, i, j) >= pairs.own_reach[0]:
            continue
        contact = near.contact[count]
        segment_segment(near.ends[i, 0], near.ends[i, 1], near.ends[j, 0], near.ends[j, 1], contact)
        contact[0] -= segments.radius[i] + segments.radius[j]
        if contact[0] < pairs.own_reach[0]:
            near.pair[count, 0], near.pair[count, 1] = i, parts + j
            count += 1
    return count


@kernel
def _solids_near_robot(
    segments: SegmentArrays, scene: SceneArrays, pairs: PairArrays, near: NearArrays
) -> int:
    """Write the solids whose boxes come near the box about the whole robot; their number."""
    low0, low1, low2 = math.inf, math.inf, math.inf
    high0, high1, high2 = -math.inf, -math.inf, -math.inf
    for k in range(len(segments.joint)):
        r = segments.radius[k]
        for e in range(2):
            end = near.ends[k, e]
            low0, high0 = min(low0, end[0] - r), max(high0, end[0] + r)
            low1, high1 = min(low1, end[1] - r), max(high1, end[1] + r)
            low2, high2 = min(low2, end[2] - r), max(high2, end[2] + r)
    count = 0
    for j in range(len(scene.radius)):
        low, high, reach = scene.box_low[j], scene.box_high[j], pairs.widest[j]
        gap = max(low[0] - high0, low0 - high[0], low[1] - high1, low1 - high[1])
        if max(gap, low[2] - high2, low2 - high[2]) < reach:
            near.solids[count] = j
            count += 1
    return count


@kernel
def _balls_apart(segments: SegmentArrays, near: NearArrays, i: int, j: int) -> float:
    """Distance of the balls about two segments [m]."""
    squared = 0.0
    for axis in range(3):
        gap = near.ends[i, 0, axis] + near.ends[i, 1, axis]
        gap -= near.ends[j, 0, axis] + near.ends[j, 1, axis]
        squared += 0.25 * gap * gap
    return math.sqrt(squared) - float(segments.ball[i] + segments.ball[j])


class Neighbourhood:
    """Robot, held object, scene and the robot's own base, as arrays for `find_near`.

    Attributes:
        segments: the robot's, with what is held.
        shapes: the scene's, with the robot's base.
        pairs: what holds for each pair.
        near: room for the near pairs.

    Args:
        model: the robot.
        parameters: of the controller.
    """

    def __init__(self, model: RobotModel, parameters: WholeBodyParameters) -> None:
        self._model = model
        self._parameters = parameters
        self._target: str | None = None
        self._whole = True
        self._start_anew()

    @property
    def finite(self) -> bool:
        """Whether all places and velocities are numbers."""
        return self.shapes.finite and self.segments.finite

    def update(self, bodies: Sequence[Body], target: str | None, held: HeldObject | None) -> None:
        """Take over the world. `pairs` are other arrays afterwards if pairs have other numbers.

        Raises:
            Exception: of many kinds, if something has a wrong shape or type. The next call
                starts anew.
        """
        if not self._whole:
            self._start_anew()
        self._whole = False
        rebuilt = self.shapes.update(bodies)
        known = self.segments.regrip(held)
        if not known or rebuilt or target != self._target:
            self._target = target
            self._classify(self.segments if known else RobotSegments(self._model, held))
        self._whole = True

    def _start_anew(self) -> None:
        self._target = None
        self.shapes = SceneShapes(self._model.footprint, self._model.base_height)
        self._classify(RobotSegments(self._model, None))

    def names(self) -> PairNames:
        """Names of pairs as they are numbered now."""
        return PairNames(self.segments.names, self.shapes.owner, self.shapes.bodies)

    def _classify(self, segments: RobotSegments) -> None:
        """Look up once what holds for each pair that there can be."""
        self.segments = segments
        model, parameters = self._model, self._parameters
        scene = scene_dampers(
            segments, self.shapes.owner, self.shapes.bodies, self._target, model, parameters
        )
        own = Dampers.of([parameters.pairs.self_collision], model, parameters)
        pairs = self_pairs(segments, model)
        parts, count = len(self.shapes.owner), len(segments)
        self.pairs = PairArrays(
            safe=np.concatenate((scene.safe, np.tile(own.safe, (count, count))), axis=1),
            rate=np.concatenate((scene.rate, np.tile(own.rate, (count, count))), axis=1),
            reach=np.ascontiguousarray(scene.reach),
            widest=scene.reach.max(axis=0),
            own=pairs,
            own_reach=own.reach,
        )
        room = count * parts + len(pairs) + 1  # the last is for a pair that proves too far
        self.near = NearArrays(
            ends=np.zeros((count, 2, 3)),
            solids=np.zeros(parts, dtype=np.int64),
            pair=np.zeros((room, 2), dtype=np.int64),
            contact=np.zeros((room, 7)),
        )


class PairNames(NamedTuple):
    """Names of the bodies that pairs are numbered by.

    Attributes:
        segments: names of the robot's segments.
        owner: index into `bodies` of each solid, or `BASE`.
        bodies: of the scene.
    """

    segments: tuple[str, ...]
    owner: IntArray
    bodies: Sequence[Body]

    def of(self, first: int, second: int) -> str:
        """Names of the two bodies of a pair."""
        parts = len(self.owner)
        if second >= parts:
            other = self.segments[second - parts]
        else:
            owner = int(self.owner[second])
            other = "base" if owner == BASE else self.bodies[owner].name
        return f"{self.segments[first]} - {other}"
