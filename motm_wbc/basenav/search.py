"""Backward search: time from the states of the tangent graph to the goals.

The cost of an edge depends on the direction that it is entered from, so the search runs
over directed tangents (states on chains, see `graph`), exactly. What leaves a chain at some
turn can be reached from every state before it, by turning on: each label that the queue
yields is walked down its chain, up to where another one is better, and the tangents that
arrive there are driven against their direction. Driven backward in a reversed world, the
same search gives the times *from* a place to all others.

Where only the times of some places matter (see `Places`), it is an A* search toward the box
about them, and ends when nothing in the queue can make one of them faster.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.graph import TangentGraph
from motm_wbc.basenav.pathrtr import BACKWARD, Speeds
from motm_wbc.basenav.walls import Indices, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

SAME_TURN = 1e-8
"""Directions nearer than this are one direction [rad]: a path may turn back by it."""
NO_SUCCESSOR = -1
FIRST_GOAL = -2
"""Successor `FIRST_GOAL - k` is the goal tangent k."""


class GoalTangents(NamedTuple):
    """Tangents that lead from chains straight to goals.

    Attributes:
        ends: (t, 2) chain and goal of each.
        turn: (t,) chain coordinate at which it leaves [rad].
        cost: (t, 2) time along it, with the last turn [s], forward and backward.
        length: (t,) [m].
    """

    ends: Indices
    turn: Array
    cost: Array
    length: Array


class Places(NamedTuple):
    """Poses whose time is asked for, in a graph that has their tangents as states.

    A state that arrives from pose tangent k has the partner -1 - k.

    Attributes:
        pose: (k,) first pose that each pose tangent serves; the others of its place follow.
        cost: (k, 2, h) time along it with the first turn [s], in each gear, for each of the
            h poses of the place.
        length: (k,) [m].
        pending: (p,) poses that the search is for; it goes on until none can get faster.
        box: (4,) x and y of the lower, then of the upper bound of their places [m].
    """

    pose: Indices
    cost: Array
    length: Array
    pending: Indices
    box: Array


class Labels(NamedTuple):
    """What the search finds.

    Attributes:
        cost: (s, 2) time from each state to a goal [s], in each gear; infinite if there is
            none, or if it was of no use for the places.
        length: (s, 2) way driven in that time [m].
        successor: (s, 2) next state on that path, or a goal tangent.
        pose_cost: (m,) least time of each pose by its tangents [s].
        pose_length: (m,) way driven in that time [m].
    """

    cost: Array
    length: Array
    successor: Indices
    pose_cost: Array
    pose_length: Array


@kernel
def first_from(turn: Array, begin: int, end: int, value: float) -> int:
    """First index in [begin, end) of ascending `turn` with turn >= value - SAME_TURN."""
    low, high = begin, end
    while low < high:
        middle = (low + high) // 2
        if turn[middle] < value - SAME_TURN:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _push(keys: Array, items: Indices, size: int, key: float, item: int) -> int:
    """Add to a binary heap in the first `size` places; returns the new size."""
    child = size
    while child > 0:
        parent = (child - 1) // 2
        if keys[parent] <= key:
            break
        keys[child], items[child] = keys[parent], items[parent]
        child = parent
    keys[child], items[child] = key, item
    return size + 1


@kernel
def _pop(keys: Array, items: Indices, size: int) -> int:
    """Remove the heap's first place; returns the new size."""
    size -= 1
    key, item = keys[size], items[size]
    hole = 0
    while True:
        child = 2 * hole + 1
        if child >= size:
            break
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[hole], items[hole] = keys[child], items[child]
        hole = child
    keys[hole], items[hole] = key, item
    return size


@kernel
def nowhere() -> Places:
    """For a search that is for all states."""
    return Places(
        np.empty(0, dtype=np.int64),
        np.empty((0, 2, 1)),
        np.empty(0),
        np.empty(0, dtype=np.int64),
        np.array([-math.inf, -math.inf, math.inf, math.inf]),
    )


@kernel
def _distance_to(box: Array, x: float, y: float) -> float:
    """Distance to a box [m]."""
    dx = max(box[0] - x, x - box[2], 0.0)
    dy = max(box[1] - y, y - box[3], 0.0)
    return math.sqrt(dx * dx + dy * dy)


@kernel
def _slowest(costs: Array, pending: Indices) -> float:
    """Largest of the pending poses' times [s]; infinite without any: nothing is settled."""
    if pending.size == 0:
        return math.inf
    most = 0.0
    for k in range(pending.size):
        most = max(most, costs[pending[k]])
    return most


@kernel
def search_back(
    graph: TangentGraph,
    corners: Array,
    tangents: GoalTangents,
    speeds: Speeds,
    places: Places,
    poses: int,
) -> Labels:
    """Search from the goals against the direction of travel, in both gears at once.

    Args:
        graph: tangents, those to the places among them.
        corners: as in `Walls`.
        tangents: to the goals.
        speeds: speeds of the base.
        places: that the search is for; `nowhere`: for all states.
        poses: how many poses the places have.
    """
    count = graph.turn.size
    cost = np.full((count, 2), math.inf)
    driven = np.empty((count, 2))
    successor = np.full((count, 2), NO_SUCCESSOR)
    pose_cost, pose_length = np.full(poses, math.inf), np.zeros(poses)
    chain_start, chain_of, turn = graph.chain_start, graph.chain, graph.turn
    partner, leaves, length = graph.partner, graph.leaves, graph.length
    box, turning = places.box, speeds.turning
    pose_of, way_cost, way_length = places.pose, places.cost, places.length
    siblings = way_cost.shape[2]

    keys = np.empty(2 * count + 2 * tangents.turn.size + 1)
    items = np.empty(keys.size, dtype=np.int64)
    size = 0
    for k in range(tangents.turn.size):
        corner = tangents.ends[k, 0] // 2
        ahead = _distance_to(box, corners[corner, X], corners[corner, Y])
        for gear in range(2):
            if tangents.cost[k, gear] < math.inf:
                speed = speeds.backward if gear == BACKWARD else speeds.forward
                key = tangents.cost[k, gear] + ahead / speed
                size = _push(keys, items, size, key, 2 * (count + k) + gear)

    limit, stale = math.inf, False
    while size > 0:
        key, item = keys[0], items[0]
        size = _pop(keys, items, size)
        if stale:
            limit, stale = _slowest(pose_cost, places.pending), False
        if key >= limit:
            break
        gear, state = item % 2, item // 2
        speed = speeds.backward if gear == BACKWARD else speeds.forward
        if state < count:
            chain = chain_of[state]
            here, way, anchor, first = cost[state, gear], driven[state, gear], turn[state], state
        else:
            tangent = state - count
            chain = tangents.ends[tangent, 0]
            here, way = tangents.cost[tangent, gear], tangents.length[tangent]
            anchor = tangents.turn[tangent]
            begin, end = chain_start[chain], chain_start[chain + 1]
            first = first_from(turn, begin, end, anchor + 2.0 * SAME_TURN) - 1
        corner = chain // 2
        ahead = _distance_to(box, corners[corner, X], corners[corner, Y]) / speed
        if state < count and key > here + ahead:
            continue  # a better label of this state has been walked already
        while size + chain_start[chain + 1] - chain_start[chain] > keys.size:
            keys = np.concatenate((keys, np.empty_like(keys)))
            items = np.concatenate((items, np.empty_like(items)))
        # what differs by rounding only lies above; then down the chain
        last = first
        while (
            last + 1 < chain_start[chain + 1]
            and last >= chain_start[chain]
            and turn[last + 1] - turn[last] <= SAME_TURN
        ):
            last += 1
        for s in range(last, chain_start[chain] - 1, -1):
            found = here + abs(anchor - turn[s]) / turning
            if s != state:
                if found >= cost[s, gear]:
                    if s <= first:
                        break
                    continue
                cost[s, gear], driven[s, gear] = found, way
                if state >= count and s == first:
                    successor[s, gear] = FIRST_GOAL - (state - count)
                else:
                    successor[s, gear] = s + 1 if s < first else s - 1
            if found + ahead >= limit and s <= first:
                break
            if leaves[s] == 1:
                continue
            before = partner[s]
            if before < 0:
                way_on = -1 - before
                for k in range(siblings):
                    time = found + way_cost[way_on, gear, k]
                    pose = pose_of[way_on] + k
                    if time < pose_cost[pose]:
                        pose_cost[pose], pose_length[pose] = time, way + way_length[way_on]
                        stale = True
                continue
            reached = found + length[s] / speed
            if reached < cost[before, gear]:
                there = chain_of[before] // 2
                key = reached + _distance_to(box, corners[there, X], corners[there, Y]) / speed
                if key < limit:
                    cost[before, gear] = reached
                    driven[before, gear] = way + length[s]
                    successor[before, gear] = s
                    size = _push(keys, items, size, key, 2 * before + gear)
    return Labels(cost, driven, successor, pose_cost, pose_length)
