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
from motm_wbc.geometry.jit import inlined
from motm_wbc.kinematics.chain import point_acceleration
from motm_wbc.qp.limits import BaseArrays
from motm_wbc.qp.nearby import NearArrays, PairArrays
from motm_wbc.qp.problem import NO_BOUND
from motm_wbc.qp.segments import SegmentArrays
from motm_wbc.qp.selection import NO_PAIR, SelectionArrays, allowed_speed, solid_speed
from motm_wbc.qp.shapes import SceneArrays

_BRAKES = 0.98  # share of the deceleration that is counted on: normals turn on the way
_SLOW = 1e-6  # [m/s] stands for a closing speed that is none


class RowArrays(NamedTuple):
    """Collision rows in r slots.

    Attributes:
        A: (r, n_inputs) rates at which each pair comes nearer; zero in a slot not in use.
        bound: (r,) largest rate [m/s]; `NO_BOUND` in a slot not in use.
        slots: (r, 3) segment, other body and place, as in `NearArrays`; `NO_PAIR` for none.
        slot_of: (k, s + k, 3) slot that each pair and place is in, or `NO_PAIR`.
        kept: (r,) the slot keeps its pair.
    """

    A: Array
    bound: Array
    slots: IntArray
    slot_of: IntArray
    kept: BoolArray


def empty_rows(pairs: PairArrays, n_inputs: int, count: int) -> RowArrays:
    """Rows for all pairs that there can be, none in use.

    Args:
        pairs: what holds for each pair.
        n_inputs: number of the base's and the arm's inputs.
        count: number of slots.
    """
    return RowArrays(
        A=np.zeros((count, n_inputs)),
        bound=np.full(count, NO_BOUND),
        slots=np.full((count, 3), NO_PAIR),
        slot_of=np.full((*pairs.safe.shape, 3), NO_PAIR),
        kept=np.zeros(count, dtype=np.bool_),
    )


@inlined
def write_rows(
    segments: SegmentArrays,
    scene: SceneArrays,
    pairs: PairArrays,
    near: NearArrays,
    selection: SelectionArrays,
    chosen: int,
    base: BaseArrays,
    J_world: Array,
    lead: Array,
    retreat_speed: float,
    dt: float,
    rows: RowArrays,
) -> None:
    """Turn the chosen pairs into rows.

    Args:
        segments: of the robot.
        scene: all solids.
        pairs: what holds for each pair.
        near: the near pairs, the chosen ones measured.
        selection: the chosen pairs.
        chosen: their number.
        base: limits of the base's inputs.
        J_world: (6, n_inputs) of the robot.
        lead: (n_base,) base inputs that are asked for, or were last.
        retreat_speed: largest speed with which a pair too near is led apart [m/s].
        dt: control step [s].
        rows: is written.
    """
    _assign_slots(near, selection.chosen[:chosen], rows)
    for slot in range(len(rows.bound)):
        if rows.slots[slot, 0] == NO_PAIR:
            rows.A[slot, :] = 0.0
            rows.bound[slot] = NO_BOUND
    parts = len(scene.radius)
    for index in selection.chosen[:chosen]:
        i, j = near.pair[index, 0], near.pair[index, 1]
        slot, contact = rows.slot_of[i, j, near.place[index]], near.contact[index]
        _rate_row(segments, parts, contact, i, j, len(lead), J_world, rows.A[slot])
        limit = allowed_speed(pairs, near, index, retreat_speed)
        stands = segments.on_base[i] and 0 < j < parts
        if stands:
            room = contact[0] - pairs.safe[i, j]
            limit = _base_stop(rows.A[slot], room, lead, base, dt)
        if j < parts:
            limit += solid_speed(scene, j, contact)
        gain = _gain_of_step(near, parts, contact, i, j)
        limit -= 0.5 * dt * max(gain, 0.0)
        # what stands on the base stops; to flee is navigation's business
        rows.bound[slot] = max(limit, 0.0) if stands else limit


@inlined
def _assign_slots(near: NearArrays, chosen: IntArray, rows: RowArrays) -> None:
    """Give the chosen pairs their slots: the old ones where they had one.

    A pair keeps its slot as long as it stays near, for the solver's warm start.
    """
    rows.kept[:] = False
    for index in chosen:
        slot = rows.slot_of[near.pair[index, 0], near.pair[index, 1], near.place[index]]
        if slot != NO_PAIR:
            rows.kept[slot] = True
    for slot in range(len(rows.kept)):
        i, j, place = rows.slots[slot, 0], rows.slots[slot, 1], rows.slots[slot, 2]
        if i != NO_PAIR and not rows.kept[slot]:
            rows.slot_of[i, j, place] = NO_PAIR
            rows.slots[slot, 0] = NO_PAIR
    free = 0
    for index in chosen:
        i, j, place = near.pair[index, 0], near.pair[index, 1], near.place[index]
        if rows.slot_of[i, j, place] != NO_PAIR:
            continue
        while rows.slots[free, 0] != NO_PAIR:
            free += 1
        rows.slot_of[i, j, place] = free
        rows.slots[free, 0], rows.slots[free, 1], rows.slots[free, 2] = i, j, place


@inlined
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


@inlined
def _gain_of_step(near: NearArrays, parts: int, contact: Array, i: int, j: int) -> float:
    """How much faster a pair comes nearer by the end of a second of the last inputs [m/s^2].

    Held inputs move points on curves. Over a step the pair comes nearer by dt/2 times this
    than its row says; at d_s, where the row allows nothing, that would go on step by step
    until the row leads out as fast.
    """
    gain = _acceleration_along(near, i, contact)
    if j >= parts:
        return gain - _acceleration_along(near, j - parts, contact)
    if j == 0:
        return gain - _acceleration_along(near, len(near.twist) - 1, contact)
    return gain


@inlined
def _acceleration_along(near: NearArrays, k: int, contact: Array) -> float:
    """Acceleration of a segment's point at a contact, along its normal [m/s^2]."""
    a, b, c = point_acceleration(near.twist[k], near.bias[k], contact[1:4])
    return float(contact[4] * a + contact[5] * b + contact[6] * c)


@inlined
def _base_stop(row: Array, room: float, lead: Array, base: BaseArrays, dt: float) -> float:
    """Speed from which the base, braking on its arc, stops within `room` [m].

    Braking shrinks all inputs as one, so the closing speed falls as evenly as they do. Free
    inputs could brake each by itself; to count on the arc of the last ones is on the safe side.
    """
    closing, every, steps = 0.0, 0.0, 1.0
    for c in range(len(lead)):
        closing += row[c] * lead[c]
        every += abs(row[c]) * base.change[c]
        steps = max(steps, abs(lead[c]) / base.change[c])
    # where nothing closes in, all that the brakes have
    change = closing / steps if closing > _SLOW else every + _SLOW
    return stopping_speed(room, _BRAKES * change / dt, dt)
