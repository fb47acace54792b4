"""Which pairs are within the reach of their dampers, and their closest points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, BoolArray, IntArray
from motm_wbc.geometry.distance import segment_cylinder, segment_prism, segment_segment
from motm_wbc.geometry.jit import inlined
from motm_wbc.geometry.outlines import facing_end, outline_disc, outline_outline
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.chain import spatial_bias
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.dampers import Dampers, scene_dampers, self_pairs
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.segments import RobotSegments, SegmentArrays
from motm_wbc.qp.shapes import BASE, SceneArrays, SceneShapes
from motm_wbc.qp.tasks import HeldObject

NEAREST, FIRST, SECOND = 0, 1, 2
"""Places on a segment that a pair is measured at."""


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
    """Pairs that may be near, c of them at most: room for all that there can be.

    Attributes:
        ends: (k, 2, 3) ends of the robot's segments in the world [m].
        box_low: (k, 3) least corner of the axis-aligned box about each segment [m].
        box_high: (k, 3) its largest corner [m].
        twist: (k, 6) spatial velocity of each segment by the last inputs [m/s, rad/s].
        bias: (k, 6) its spatial acceleration while these are held [m/s^2, rad/s^2].
        speed: (k,) that no point of a segment's surface passes [m/s].
        solids: (s,) numbers of the solids that any segment could be near to.
        pair: (c, 2) segment, and solid or, counted on behind these, other segment.
        place: (c,) `NEAREST` point of the segment, or the `FIRST` or `SECOND` of its ends.
        contact: (c, 7) signed distance of the surfaces [m], point on the segment's core
            [m], unit vector from the segment to the other body. Before the pair is measured
            the distance is a rough one, never too large, and the rest is not there.
        measured: (c,) the pair is measured.
    """

    ends: Array
    box_low: Array
    box_high: Array
    twist: Array
    bias: Array
    speed: Array
    solids: IntArray
    pair: IntArray
    place: IntArray
    contact: Array
    measured: BoolArray


@inlined
def rough_pairs(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    with_base: bool,
    near: NearArrays,
) -> int:
    """Write the pairs that may be within the reach of their dampers; returns their number.

    Distances of the boxes about segments and solids are never too large and quick to have.

    Args:
        segments: of the robot.
        scene: all solids.
        pairs: what holds for each pair.
        with_base: the base's body counts, too; else somebody navigates.
        near: is written.
    """
    _box_segments(segments, scene, near)
    count, parts = 0, len(scene.radius)
    n_solids = _solids_near_robot(scene, pairs, near)
    base, base_height = len(segments.joint) - 1, scene.faces[0, 1]
    # the base moves on the floor: how far a solid reaches into its height is no distance
    near.box_low[base, 2], near.box_high[base, 2] = -math.inf, math.inf
    for k in range(base + 1 if with_base else base):
        low, high = near.box_low[k], near.box_high[k]
        for index in range(n_solids):
            j = near.solids[index]
            reach = pairs.reach[k, j]
            if reach == -math.inf:
                continue
            low_enough = scene.box_low[j, 2] < base_height
            if k == base and not (low_enough and scene.box_high[j, 2] > 0.0):
                continue  # over the base, or the floor that it stands on
            gap = _gap(low, high, scene.box_low[j], scene.box_high[j])
            if gap < reach:
                near.pair[count, 0], near.pair[count, 1] = k, j
                near.place[count] = NEAREST
                near.contact[count, 0], near.measured[count] = gap, False
                count += 1
    for p in range(len(pairs.own)):
        i, j = pairs.own[p, 0], pairs.own[p, 1]
        gap = _gap(near.box_low[i], near.box_high[i], near.box_low[j], near.box_high[j])
        if gap < pairs.own_reach[0]:
            near.pair[count, 0], near.pair[count, 1] = i, parts + j
            near.place[count] = NEAREST
            near.contact[count, 0], near.measured[count] = gap, False
            count += 1
    return count


@inlined
def move_segments(
    segments: SegmentArrays,
    scene: SceneArrays,
    J_world: Array,
    n_base: int,
    previous: Array,
    near: NearArrays,
) -> None:
    """Write how the segments move by the last inputs (n_inputs,)."""
    for k in range(len(segments.joint)):
        twist = near.twist[k]
        if k > 0 and segments.joint[k] == segments.joint[k - 1] and not segments.on_base[k]:
            twist[:], near.bias[k, :] = near.twist[k - 1], near.bias[k - 1]
        else:
            spatial_bias(J_world, segments.moved_by[k], n_base, previous, twist, near.bias[k])
        turning = math.sqrt(twist[3] ** 2 + twist[4] ** 2 + twist[5] ** 2)
        fastest = 0.0
        for e in range(2):
            x, y, z = near.ends[k, e, 0], near.ends[k, e, 1], near.ends[k, e, 2]
            u = twist[0] + twist[4] * z - twist[5] * y
            v = twist[1] + twist[5] * x - twist[3] * z
            w = twist[2] + twist[3] * y - twist[4] * x
            fastest = max(fastest, math.sqrt(u * u + v * v + w * w))
        near.speed[k] = fastest + turning * segments.radius[k]
    base, pose = len(segments.joint) - 1, scene.poses[0]
    x = max(scene.box_high[0, 0] - pose[0], pose[0] - scene.box_low[0, 0])
    y = max(scene.box_high[0, 1] - pose[1], pose[1] - scene.box_low[0, 1])
    speed = 0.0
    for c in range(n_base - 1):
        speed += abs(previous[c])
    near.speed[base] = speed + abs(previous[n_base - 1]) * math.hypot(x, y)


@inlined
def measure(segments: SegmentArrays, scene: SceneArrays, near: NearArrays, c: int) -> None:
    """Write distance, point and normal of pair `c`."""
    k, j, parts = near.pair[c, 0], near.pair[c, 1], len(scene.radius)
    a, b, contact = near.ends[k, 0], near.ends[k, 1], near.contact[c]
    near.measured[c] = True
    if near.place[c] == FIRST:
        b = a
    elif near.place[c] == SECOND:
        a = b
    if k == len(segments.joint) - 1:
        _measure_base(scene, j, near.place[c], contact)
        return
    if j >= parts:
        other = j - parts
        segment_segment(a, b, near.ends[other, 0], near.ends[other, 1], contact)
        contact[0] -= segments.radius[k] + segments.radius[other]
        return
    first, last = scene.first_edge[j], scene.first_edge[j + 1]
    bottom, top = scene.faces[j, 0], scene.faces[j, 1]
    if first == last:
        x, y = scene.poses[j, 0], scene.poses[j, 1]
        segment_cylinder(a, b, x, y, scene.radius[j], bottom, top, contact)
    else:
        segment_prism(a, b, scene.edges[first:last], bottom, top, contact)
    contact[0] -= segments.radius[k]


@inlined
def _measure_base(scene: SceneArrays, j: int, place: int, contact: Array) -> None:
    """Write the contact of the base's body and a solid, both upright: on the floor plan.

    The ends are those of the stretch where the two face each other edge to edge; without such
    a stretch they are the nearest point.
    """
    base = scene.edges[: scene.first_edge[1]]
    first, last = scene.first_edge[j], scene.first_edge[j + 1]
    if first == last:
        x, y = scene.poses[j, 0], scene.poses[j, 1]
        outline_disc(base, x, y, scene.radius[j], contact[:5])
    else:
        outline_outline(base, scene.edges[first:last], contact[:5])
        if place != NEAREST:
            facing_end(base, scene.edges[first:last], place == FIRST, contact[:5])
    contact[4], contact[5], contact[6] = contact[3], contact[4], 0.0
    contact[3] = 0.0


@inlined
def _box_segments(segments: SegmentArrays, scene: SceneArrays, near: NearArrays) -> None:
    """Write the boxes about the segments, their radii included."""
    base = len(segments.joint) - 1
    for axis in range(3):
        near.box_low[base, axis] = scene.box_low[0, axis]
        near.box_high[base, axis] = scene.box_high[0, axis]
    for k in range(base):
        r = segments.radius[k]
        for axis in range(3):
            p, q = near.ends[k, 0, axis], near.ends[k, 1, axis]
            near.box_low[k, axis], near.box_high[k, axis] = min(p, q) - r, max(p, q) + r


@inlined
def _gap(low: Array, high: Array, other_low: Array, other_high: Array) -> float:
    """A distance that no two solids in these boxes fall short of [m].

    Where the boxes overlap it is negative: a way along one axis parts them, and what is in
    them, so no solid is deeper in the other than that.
    """
    x = max(other_low[0] - high[0], low[0] - other_high[0])
    y = max(other_low[1] - high[1], low[1] - other_high[1])
    z = max(other_low[2] - high[2], low[2] - other_high[2])
    apart = float(max(x, y, z))
    if apart <= 0.0:
        return apart
    x, y, z = max(x, 0.0), max(y, 0.0), max(z, 0.0)
    return math.sqrt(x * x + y * y + z * z)


@inlined
def _solids_near_robot(scene: SceneArrays, pairs: PairArrays, near: NearArrays) -> int:
    """Write the solids whose boxes come near the box about the whole robot; their number."""
    x0, y0, z0 = near.box_low[0, 0], near.box_low[0, 1], near.box_low[0, 2]
    x1, y1, z1 = near.box_high[0, 0], near.box_high[0, 1], near.box_high[0, 2]
    for k in range(1, len(near.box_low)):
        low, high = near.box_low[k], near.box_high[k]
        x0, y0, z0 = min(x0, low[0]), min(y0, low[1]), min(z0, low[2])
        x1, y1, z1 = max(x1, high[0]), max(y1, high[1]), max(z1, high[2])
    count = 0
    for j in range(len(scene.radius)):
        low, high = scene.box_low[j], scene.box_high[j]
        gap = max(low[0] - x1, x0 - high[0], low[1] - y1, y0 - high[1], low[2] - z1, z0 - high[2])
        if gap < pairs.widest[j]:
            near.solids[count] = j
            count += 1
    return count


class Neighbourhood:
    """Robot, held object, scene and the robot's own base, as arrays for `rough_pairs`.

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
        parts, count = len(self.shapes.owner), len(segments.names)
        self.pairs = PairArrays(
            safe=np.concatenate((scene.safe, np.tile(own.safe, (count, count))), axis=1),
            rate=np.concatenate((scene.rate, np.tile(own.rate, (count, count))), axis=1),
            reach=np.ascontiguousarray(scene.reach),
            widest=scene.reach.max(axis=0),
            own=pairs,
            own_reach=own.reach,
        )
        # each pair that gets a row may bring both ends of its segment
        room = 3 * count * parts + len(pairs)
        self.near = NearArrays(
            ends=np.zeros((count, 2, 3)),
            box_low=np.zeros((count, 3)),
            box_high=np.zeros((count, 3)),
            twist=np.zeros((count, 6)),
            bias=np.zeros((count, 6)),
            speed=np.zeros(count),
            solids=np.zeros(parts, dtype=np.int64),
            pair=np.zeros((room, 2), dtype=np.int64),
            place=np.zeros(room, dtype=np.int64),
            contact=np.zeros((room, 7)),
            measured=np.zeros(room, dtype=np.bool_),
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
