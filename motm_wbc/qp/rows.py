"""Collision rows: near pairs, turned into a fixed number of linear bounds of the inputs.

Each row is a velocity damper (Faverjon and Tournassoud, "A local based approach for path
planning of manipulators", 1987; Haviland and Corke, "NEO", RA-L 2021, eq. 14):

    n^T (J_a - J_b) x <= xi (d - d_s)/(d_i - d_s) + n^T v_other

with n the unit vector from the robot's point to the other body, d the signed distance. The
line goes on beyond d_i until it allows more than any motion has, so a row switches on
smoothly; inside d_s it leads out again, at a bounded speed.

What stands on the base and the arm can't pull back is led by the base's own brakes: its row
allows the largest speed from which the base can stop in time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, BoolArray, IntArray
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.geometry.jit import kernel
from motm_wbc.qp.limits import BaseArrays
from motm_wbc.qp.nearby import NearArrays, Neighbourhood, PairArrays
from motm_wbc.qp.segments import SegmentArrays
from motm_wbc.qp.shapes import SceneArrays

_BRAKES = 0.98  # share of the deceleration that is counted on: normals turn on the way
_SLOW = 1e-6  # [m/s] stands for a closing speed that is none
_SAME_POINT = 1e-3  # [m] between points that count as one
NO_PAIR = -1
"""Stands for the pair of a slot that is not in use."""


class RowArrays(NamedTuple):
    """Collision rows in r slots, and what chooses them.

    Attributes:
        A: (r, n_inputs) rates at which each pair comes nearer; zero in a slot not in use.
        bound: (r,) largest rate [m/s]; `NO_BOUND` in a slot not in use.
        slots: (r, 2) segment and other body, as in `NearArrays`; `NO_PAIR` for none.
        slot_of: (k, s + k) slot that each pair is in, or `NO_PAIR`.
        allowed: (c,) approach speed that each near pair's damper allows [m/s].
        rank: (c,) speed that near pairs are chosen by, least first [m/s].
        heap: (c,) near pairs, for choosing.
        chosen: (r,) near pairs that get rows.
        spent: (s + k,) rows that are spent on the held object and each other body.
        kept: (r,) the slot keeps its pair.
        clearance: (1,) smallest distance of any near pair [m], infinite if there is none.
        closest: (2,) the pair that has it, or `NO_PAIR`.
    """

    A: Array
    bound: Array
    slots: IntArray
    slot_of: IntArray
    allowed: Array
    rank: Array
    heap: IntArray
    chosen: IntArray
    spent: IntArray
    kept: BoolArray
    clearance: Array
    closest: IntArray


def empty_rows(neighbourhood: Neighbourhood, n_inputs: int, count: int) -> RowArrays:
    """Rows for all pairs of a neighbourhood, none in use.

    Args:
        neighbourhood: as it is classified now.
        n_inputs: number of the base's and the arm's inputs.
        count: number of slots.
    """
    segments, bodies = neighbourhood.pairs.safe.shape
    room = len(neighbourhood.near.pair)
    return RowArrays(
        A=np.zeros((count, n_inputs)),
        bound=np.zeros(count),
        slots=np.full((count, 2), NO_PAIR),
        slot_of=np.full((segments, bodies), NO_PAIR),
        allowed=np.zeros(room),
        rank=np.zeros(room),
        heap=np.zeros(room, dtype=np.int64),
        chosen=np.zeros(count, dtype=np.int64),
        spent=np.zeros(bodies, dtype=np.int64),
        kept=np.zeros(count, dtype=np.bool_),
        clearance=np.full(1, np.inf),
        closest=np.full(2, NO_PAIR),
    )


@kernel
def write_rows(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    count: int,
    base: BaseArrays,
    J_world: Array,
    lead: Array,
    retreat_speed: float,
    held_rows: int,
    no_bound: float,
    dt: float,
    rows: RowArrays,
) -> None:
    """Turn the `count` near pairs into the rows of those that may approach least.

    Args:
        segments: of the robot.
        scene: all solids.
        pairs: what holds for each pair.
        near: the near pairs.
        count: their number.
        base: limits of the base's inputs.
        J_world: (6, n_inputs) of the robot.
        lead: (n_base,) base inputs that are asked for, or were last.
        retreat_speed: largest speed with which a pair too near is led apart [m/s].
        held_rows: rows that may be spent on the held object and one body.
        no_bound: bound of a slot that is not in use.
        dt: control step [s].
        rows: is written.
    """
    _rank(segments, pairs, near, count, base, retreat_speed, dt, rows)
    chosen = _choose(segments, near, count, held_rows, rows)
    _assign_slots(near, chosen, rows)
    for slot in range(len(rows.bound)):
        if rows.slots[slot, 0] == NO_PAIR:
            rows.A[slot, :] = 0.0
            rows.bound[slot] = no_bound
    parts = len(scene.radius)
    for c in range(chosen):
        index = rows.chosen[c]
        i, j = near.pair[index, 0], near.pair[index, 1]
        slot = rows.slot_of[i, j]
        _rate_row(segments, parts, near.contact[index], i, j, len(lead), J_world, rows.A[slot])
        limit = rows.allowed[index]
        if segments.on_base[i] and j < parts:
            room = near.contact[index, 0] - pairs.safe[i, j]
            limit = _base_stop(rows.A[slot], room, lead, base, dt)
        if j < parts:
            limit += _speed_of_solid(scene, j, near.contact[index])
        if segments.on_base[i] and j < parts:
            limit = max(limit, 0.0)  # it stops; to flee is navigation's business
        rows.bound[slot] = limit


@kernel
def _rank(
    segments: SegmentArrays,
    pairs: PairArrays,
    near: NearArrays,
    count: int,
    base: BaseArrays,
    retreat_speed: float,
    dt: float,
    rows: RowArrays,
) -> None:
    """Write how fast each near pair may approach, and which is the closest."""
    parts = pairs.reach.shape[1]
    rows.clearance[0], rows.closest[0] = np.inf, NO_PAIR
    for c in range(count):
        i, j = near.pair[c, 0], near.pair[c, 1]
        distance = near.contact[c, 0]
        room = distance - pairs.safe[i, j]
        rows.allowed[c] = max(pairs.rate[i, j] * room, -retreat_speed)
        rows.rank[c] = rows.allowed[c]
        if segments.on_base[i] and j < parts:
            brakes = base.change[0] / dt
            rows.rank[c] = min(rows.rank[c], stopping_speed(room, brakes, dt))
        if distance < rows.clearance[0]:
            rows.clearance[0] = distance
            rows.closest[0], rows.closest[1] = i, j


@kernel
def _choose(
    segments: SegmentArrays, near: NearArrays, count: int, held_rows: int, rows: RowArrays
) -> int:
    """Write the pairs that get rows to `rows.chosen`; returns their number.

    A held box's edges would take all slots: it gets `held_rows` for each other body, at
    different points.
    """
    slots = len(rows.bound)
    holding = segments.is_held[-1]
    if count <= slots and not holding:
        for c in range(count):
            rows.chosen[c] = c
        return count
    for c in range(count):
        rows.heap[c] = c
    rows.spent[:] = 0
    _heapify(rows.heap, count, rows.rank)
    chosen, left = 0, count
    while left > 0 and chosen < slots:
        best = rows.heap[0]
        left -= 1
        rows.heap[0] = rows.heap[left]
        _sift(rows.heap, 0, left, rows.rank)
        i, j = near.pair[best, 0], near.pair[best, 1]
        if segments.is_held[i]:
            if rows.spent[j] == held_rows or _is_repeated(segments, near, best, chosen, rows):
                continue
            rows.spent[j] += 1
        rows.chosen[chosen] = best
        chosen += 1
    return chosen


@kernel
def _is_repeated(
    segments: SegmentArrays, near: NearArrays, index: int, chosen: int, rows: RowArrays
) -> bool:
    """Whether a pair of the held object has a row already: edges that meet share their corner.

    Else all rows would be spent on the nearest corner, and the next one would come unforeseen
    as the object turns.
    """
    for c in range(chosen):
        other = rows.chosen[c]
        if not segments.is_held[near.pair[other, 0]] or near.pair[other, 1] != near.pair[index, 1]:
            continue
        squared = 0.0
        for axis in range(1, 4):
            squared += (near.contact[other, axis] - near.contact[index, axis]) ** 2
        if squared < _SAME_POINT * _SAME_POINT:
            return True
    return False


@kernel
def _assign_slots(near: NearArrays, chosen: int, rows: RowArrays) -> None:
    """Give the chosen pairs their slots: the old ones where they had one.

    A pair keeps its slot as long as it stays near, for the solver's warm start.
    """
    rows.kept[:] = False
    for c in range(chosen):
        i, j = near.pair[rows.chosen[c], 0], near.pair[rows.chosen[c], 1]
        if rows.slot_of[i, j] != NO_PAIR:
            rows.kept[rows.slot_of[i, j]] = True
    for slot in range(len(rows.kept)):
        i, j = rows.slots[slot, 0], rows.slots[slot, 1]
        if i != NO_PAIR and not rows.kept[slot]:
            rows.slot_of[i, j] = NO_PAIR
            rows.slots[slot, 0] = NO_PAIR
    free = 0
    for c in range(chosen):
        i, j = near.pair[rows.chosen[c], 0], near.pair[rows.chosen[c], 1]
        if rows.slot_of[i, j] != NO_PAIR:
            continue
        while rows.slots[free, 0] != NO_PAIR:
            free += 1
        rows.slot_of[i, j] = free
        rows.slots[free, 0], rows.slots[free, 1] = i, j


@kernel
def _rate_row(
    segments: SegmentArrays,
    parts: int,
    contact: Array,
    i: int,
    j: int,
    n_base: int,
    J_world: Array,
    row: Array,
) -> None:
    """Write the rates (n_inputs,) at which a pair comes nearer, for each input.

    n (v + w x p) = n v + w (p x n); both points of a pair lie on one line along n, so p x n
    is the same for both, and what moves both drops out.
    """
    px, py, pz = contact[1], contact[2], contact[3]
    nx, ny, nz = contact[4], contact[5], contact[6]
    mx, my, mz = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
    for c in range(len(row)):
        moves = segments.moved_by[i, c]
        if j >= parts:
            moves -= segments.moved_by[j - parts, c]
        elif j == 0 and c < n_base:
            moves -= 1.0
        row[c] = moves * (
            nx * J_world[0, c] + ny * J_world[1, c] + nz * J_world[2, c]
            + mx * J_world[3, c] + my * J_world[4, c] + mz * J_world[5, c]
        )  # fmt: skip


@kernel
def _base_stop(row: Array, room: float, lead: Array, base: BaseArrays, dt: float) -> float:
    """Speed from which the base, braking on its arc, stops within `room` [m].

    Braking shrinks all inputs as one, so the closing speed falls as evenly as they do.
    """
    closing, at_rest, steps = 0.0, 0.0, 1.0
    for c in range(len(lead)):
        closing += row[c] * lead[c]
        at_rest += abs(row[c]) * base.change[c]  # nothing closes in: all that the brakes have
        steps = max(steps, abs(lead[c]) / base.change[c])
    change = closing / steps if closing > _SLOW else at_rest + _SLOW
    return stopping_speed(room, _BRAKES * change / dt, dt)


@kernel
def _speed_of_solid(scene: SceneArrays, j: int, contact: Array) -> float:
    """Speed at which a solid moves by itself along the normal of a contact [m/s]."""
    velocity, centre = scene.velocity[j], scene.poses[j]
    along_x = velocity[0] - velocity[2] * (contact[2] - centre[1])
    along_y = velocity[1] + velocity[2] * (contact[1] - centre[0])
    return float(contact[4] * along_x + contact[5] * along_y)


@kernel
def _heapify(heap: IntArray, count: int, rank: Array) -> None:
    """Order heap[0:count] so that the least rank, at a tie the least number, is on top."""
    for root in range(count // 2 - 1, -1, -1):
        _sift(heap, root, count, rank)


@kernel
def _sift(heap: IntArray, root: int, count: int, rank: Array) -> None:
    """Let heap[root] sink to its place."""
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
