"""Which near pairs get collision rows: those that are nearest to what their rows allow.

That is what a pair may approach by, less what it does approach by with the last inputs. A pair
that is near but leaves needs no row; one that is far but comes fast does.

Exact distances are dear beside rough ones, so only pairs are measured that a rough distance
can't rule out: best first, with the rough rank as a lower bound of the exact one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.geometry.jit import inlined
from motm_wbc.qp.nearby import FIRST, NEAREST, SECOND, NearArrays, PairArrays, measure
from motm_wbc.qp.segments import SegmentArrays
from motm_wbc.qp.shapes import SceneArrays

_TILTED = 0.3  # sine of the angle to a face from which a capsule does not lie along it
_SAME_POINT = 1e-2  # [m] between points that count as one
NO_PAIR = -1
"""Stands for a pair that there is not."""


class SelectionArrays(NamedTuple):
    """What is chosen among c near pairs for r rows.

    Attributes:
        rank: (c,) speed that is left to each near pair, least first [m/s].
        heap: (c,) near pairs that are not chosen yet.
        chosen: (r,) near pairs that get rows.
        spent: (s + k,) rows that are spent on the held object and each other body.
        clearance: (1,) smallest distance of any near pair [m], infinite if there is none.
        closest: (2,) the pair that has it, or `NO_PAIR`.
    """

    rank: Array
    heap: IntArray
    chosen: IntArray
    spent: IntArray
    clearance: Array
    closest: IntArray


@inlined
def choose_pairs(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    count: int,
    brakes: float,
    retreat_speed: float,
    held_rows: int,
    dt: float,
    selection: SelectionArrays,
) -> int:
    """Write the pairs that get rows, measured; returns their number.

    A held box's edges would take all slots: it gets `held_rows` for each other body, at
    different points.

    Args:
        segments: of the robot.
        scene: all solids.
        pairs: what holds for each pair.
        near: the pairs that may be near.
        count: their number.
        brakes: deceleration of the base [m/s^2].
        retreat_speed: largest speed with which a pair too near is led apart [m/s].
        held_rows: rows that may be spent on the held object and one body.
        dt: control step [s].
        selection: is written.
    """
    rank, heap, chosen = selection.rank, selection.heap, 0
    for c in range(count):
        heap[c] = c
        rank[c] = _rank(segments, scene, pairs, near, c, brakes, retreat_speed, dt)
    selection.spent[:] = 0
    for root in range(count // 2 - 1, -1, -1):
        _sift(heap, root, count, rank)
    left = count
    while left > 0 and chosen < len(selection.chosen):
        best = heap[0]
        if not near.measured[best]:
            measure(segments, scene, near, best)
            if _within_reach(pairs, near, best):
                rank[best] = _rank(segments, scene, pairs, near, best, brakes, retreat_speed, dt)
                _sift(heap, 0, left, rank)
                continue
            near.contact[best, 0] = math.inf
        elif not segments.is_held[near.pair[best, 0]] or _worth_a_row(
            segments, near, best, chosen, held_rows, selection
        ):
            selection.chosen[chosen] = best
            chosen += 1
        left -= 1
        heap[0] = heap[left]
        _sift(heap, 0, left, rank)
        if near.contact[best, 0] == math.inf or near.place[best] != NEAREST:
            continue
        for place in (FIRST, SECOND):
            if _add_end(segments, scene, pairs, near, best, place, count):
                rank[count] = _rank(segments, scene, pairs, near, count, brakes, retreat_speed, dt)
                heap[left] = count
                _rise(heap, left, rank)
                count, left = count + 1, left + 1
    _find_closest(segments, scene, pairs, near, count, selection)
    return chosen


@inlined
def _add_end(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    c: int,
    place: int,
    count: int,
) -> bool:
    """Add an end of the segment of pair `c` as a pair of its own; whether there is reason to.

    Where a segment lies along a face, its nearest point jumps from one end to the other; with
    a row for either end nothing jumps. That holds for solids, which have faces, and for links
    that the arm tilts, and for the base itself.
    """
    k, j = near.pair[c, 0], near.pair[c, 1]
    is_base = k == len(segments.joint) - 1
    if j >= len(scene.radius) or segments.is_held[k] or (segments.on_base[k] and not is_base):
        return False
    if not is_base and _is_tilted_away(near.contact[c], near.ends[k, place - FIRST]):
        return False
    near.pair[count, 0], near.pair[count, 1], near.place[count] = k, j, place
    measure(segments, scene, near, count)
    squared = 0.0
    for axis in range(1, 4):
        squared += (near.contact[count, axis] - near.contact[c, axis]) ** 2
    return squared >= _SAME_POINT * _SAME_POINT and _within_reach(pairs, near, count)


@inlined
def _is_tilted_away(contact: Array, end: Array) -> bool:
    """Whether a segment is so steep to a face that its nearest point can't jump to this end."""
    x, y, z = end[0] - contact[1], end[1] - contact[2], end[2] - contact[3]
    away = -(x * contact[4] + y * contact[5] + z * contact[6])
    return bool(away > 0.0 and away * away > _TILTED * _TILTED * (x * x + y * y + z * z))


@inlined
def allowed_speed(pairs: PairArrays, near: NearArrays, c: int, retreat_speed: float) -> float:
    """Speed at which the damper of a pair lets it come nearer [m/s]."""
    i, j = near.pair[c, 0], near.pair[c, 1]
    speed = float(pairs.rate[i, j] * (near.contact[c, 0] - pairs.safe[i, j]))
    return max(speed, -retreat_speed)


@inlined
def solid_speed(scene: SceneArrays, j: int, contact: Array) -> float:
    """Speed at which a solid moves by itself along the normal of a contact [m/s]."""
    velocity, centre = scene.velocity[j], scene.poses[j]
    along_x = velocity[0] - velocity[2] * (contact[2] - centre[1])
    along_y = velocity[1] + velocity[2] * (contact[1] - centre[0])
    return float(contact[4] * along_x + contact[5] * along_y)


@inlined
def _rank(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    c: int,
    brakes: float,
    retreat_speed: float,
    dt: float,
) -> float:
    """Speed that is left to a pair [m/s]; never too large while it is not measured."""
    i, j, parts = near.pair[c, 0], near.pair[c, 1], len(scene.radius)
    rank = allowed_speed(pairs, near, c, retreat_speed)
    if 0 < j < parts and segments.on_base[i]:  # for the order only: the row knows the arc
        room = near.contact[c, 0] - pairs.safe[i, j]
        rank = min(rank, stopping_speed(room, brakes, dt))
    if near.measured[c]:
        return rank - _closing_speed(segments, scene, near, c)
    if j == 0:
        return -math.inf  # few, and both may move
    if j >= parts:
        return rank - float(near.speed[i] + near.speed[j - parts])
    return rank - float(near.speed[i]) - _largest_speed(scene, j)


@inlined
def _closing_speed(segments: SegmentArrays, scene: SceneArrays, near: NearArrays, c: int) -> float:
    """How fast a measured pair comes nearer by the last inputs [m/s]."""
    i, j, parts = near.pair[c, 0], near.pair[c, 1], len(scene.radius)
    contact = near.contact[c]
    closing = _along_normal(near.twist[i], contact)
    if j >= parts:
        return closing - _along_normal(near.twist[j - parts], contact)
    if j == 0:
        return closing - _along_normal(near.twist[len(segments.joint) - 1], contact)
    return closing - solid_speed(scene, j, contact)


@inlined
def _along_normal(twist: Array, contact: Array) -> float:
    """Speed of a contact's point along its normal, if it moves with a spatial velocity."""
    x, y, z = contact[1], contact[2], contact[3]
    u = twist[0] + twist[4] * z - twist[5] * y
    v = twist[1] + twist[5] * x - twist[3] * z
    w = twist[2] + twist[3] * y - twist[4] * x
    return float(contact[4] * u + contact[5] * v + contact[6] * w)


@inlined
def _largest_speed(scene: SceneArrays, j: int) -> float:
    """Speed that no point of a solid passes [m/s]."""
    velocity, centre = scene.velocity[j], scene.poses[j]
    if velocity[2] == 0.0:
        return math.hypot(velocity[0], velocity[1])
    low, high = scene.box_low[j], scene.box_high[j]
    x = max(centre[0] - low[0], high[0] - centre[0])
    y = max(centre[1] - low[1], high[1] - centre[1])
    return math.hypot(velocity[0], velocity[1]) + float(abs(velocity[2])) * math.hypot(x, y)


@inlined
def _within_reach(pairs: PairArrays, near: NearArrays, c: int) -> bool:
    """Whether a measured pair counts at all."""
    i, j = near.pair[c, 0], near.pair[c, 1]
    own = j >= pairs.reach.shape[1]
    return bool(near.contact[c, 0] < (pairs.own_reach[0] if own else pairs.reach[i, j]))


@inlined
def _worth_a_row(
    segments: SegmentArrays,
    near: NearArrays,
    index: int,
    chosen: int,
    held_rows: int,
    selection: SelectionArrays,
) -> bool:
    """Whether a pair of the held object gets a row; counts it if so.

    Edges that meet share their corner. Were all rows spent on the nearest corner, the next one
    would come unforeseen as the object turns.
    """
    other = near.pair[index, 1]
    if selection.spent[other] == held_rows:
        return False
    for c in range(chosen):
        mine = selection.chosen[c]
        if not segments.is_held[near.pair[mine, 0]] or near.pair[mine, 1] != other:
            continue
        squared = 0.0
        for axis in range(1, 4):
            squared += (near.contact[mine, axis] - near.contact[index, axis]) ** 2
        if squared < _SAME_POINT * _SAME_POINT:
            return False
    selection.spent[other] += 1
    return True


@inlined
def _find_closest(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    count: int,
    selection: SelectionArrays,
) -> None:
    """Write the smallest distance of all pairs within reach; measures where that needs it."""
    least, closest = math.inf, NO_PAIR
    for again in range(2):  # what is measured already first, as it rules out most of the rest
        for c in range(count):
            if near.contact[c, 0] >= least or near.measured[c] == (again == 1):
                continue
            if again == 1:
                measure(segments, scene, near, c)
                if near.contact[c, 0] >= least or not _within_reach(pairs, near, c):
                    continue
            least, closest = near.contact[c, 0], c
    selection.clearance[0] = least
    for end in range(2):
        selection.closest[end] = near.pair[closest, end] if closest != NO_PAIR else NO_PAIR


@inlined
def _sift(heap: IntArray, root: int, count: int, rank: Array) -> None:
    """Let heap[root] sink to its place: least rank on top, at a tie the least number."""
    while True:
        least = root
        for child in (2 * root + 1, 2 * root + 2):
            if child < count and (
                rank[heap[child]] < rank[heap[least]]
                or (rank[heap[child]] == rank[heap[least]] and heap[child] < heap[least])
            ):
                least = child
        if least == root:
            return
        heap[root], heap[least] = heap[least], heap[root]
        root = least


@inlined
def _rise(heap: IntArray, leaf: int, rank: Array) -> None:
    """Let heap[leaf] rise to its place."""
    while leaf > 0:
        parent = (leaf - 1) // 2
        if rank[heap[parent]] <= rank[heap[leaf]]:
            return
        heap[parent], heap[leaf] = heap[leaf], heap[parent]
        leaf = parent


def empty_selection(pairs: PairArrays, near: NearArrays, rows: int) -> SelectionArrays:
    """Room for choosing `rows` of all pairs that there can be."""
    room = len(near.pair)
    return SelectionArrays(
        rank=np.zeros(room),
        heap=np.zeros(room, dtype=np.int64),
        chosen=np.zeros(rows, dtype=np.int64),
        spent=np.zeros(pairs.safe.shape[1], dtype=np.int64),
        clearance=np.full(1, np.inf),
        closest=np.full(2, NO_PAIR),
    )
