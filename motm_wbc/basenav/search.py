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
from motm_wbc.geometry.jit import inlined, kernel, lean

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


# columns of Places.ways: the costs of the place's poses are the last ones
POSE, LENGTH, COSTS = range(3)
# columns of Labels.poses
COST, DRIVEN = range(2)


class Places(NamedTuple):
    """Poses whose time is asked for, in a graph that has their tangents as states.

    A state that arrives from pose tangent k has the partner -1 - k.

    Attributes:
        ways: (k, 2, 2 + h) of each pose tangent, in each gear: the first of the h poses that
            it serves, its length [m], and the time along it with the turn to the heading of
            each of these poses [s].
        pending: (p,) poses that the search is for; it goes on until none can get faster.
        box: (4,) x and y of the lower, then of the upper bound of their places [m].
    """

    ways: Array
    pending: Indices
    box: Array


class Labels(NamedTuple):
    """What the search finds.

    Attributes:
        cost: (s, 2) time from each state to a goal [s], in each gear; infinite if there is
            none, or if it was of no use for the places.
        length: (s, 2) way driven in that time [m].
        successor: (s, 2) next state on that path, or a goal tangent.
        poses: (m, 2) least time of each pose by its tangents [s], way driven in it [m].
    """

    cost: Array
    length: Array
    successor: Indices
    poses: Array


@lean
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
    everywhere = np.array([-math.inf, -math.inf, math.inf, math.inf])
    return Places(np.empty((0, 2, COSTS + 1)), np.empty(0, dtype=np.int64), everywhere)


@inlined
def _distance_to(box: Array, corners: Array, chain: int) -> float:
    """Distance from a chain's corner to a box [m]."""
    x, y = corners[chain // 2, X], corners[chain // 2, Y]
    dx = max(box[0] - x, x - box[2], 0.0)
    dy = max(box[1] - y, y - box[3], 0.0)
    return math.sqrt(dx * dx + dy * dy)


@kernel
def _slowest(poses: Array, pending: Indices) -> float:
    """Largest of the pending poses' times [s]; infinite without any: nothing is settled."""
    if pending.size == 0:
        return math.inf
    most = 0.0
    for k in range(pending.size):
        most = max(most, poses[pending[k], COST])
    return most


@kernel
def _top_of(turn: Array, end: int, state: int) -> int:
    """The last state of a chain that ends before `end` whose turn differs by rounding only."""
    top = state
    while top + 1 < end and turn[top + 1] - turn[top] <= SAME_TURN:
        top += 1
    return top


@kernel
def _reach_poses(
    ways: Array, best: Array, tangent: int, gear: int, time: float, length: float
) -> bool:
    """Offer a way to the poses of a pose tangent; whether one of them is reached faster."""
    faster = False
    first = int(ways[tangent, 0, POSE])
    for k in range(ways.shape[2] - COSTS):
        reached = time + ways[tangent, gear, COSTS + k]
        if reached < best[first + k, COST]:
            best[first + k, COST] = reached
            best[first + k, DRIVEN] = length + ways[tangent, gear, LENGTH]
            faster = True
    return faster


@kernel
def _run(
    graph: TangentGraph,
    corners: Array,
    places: Places,
    labels: Labels,
    speeds: Speeds,
    keys: Array,
    items: Indices,
    size: int,
) -> None:
    """Work the queue off; its first `size` entries are labelled states (2 x state + gear)."""
    chain_start, chain_of, turn = graph.chain_start, graph.chain, graph.turn
    partner, leaves, length = graph.partner, graph.leaves, graph.length
    cost, driven, successor = labels.cost, labels.length, labels.successor
    ways, box, best = places.ways, places.box, labels.poses
    limit, faster = math.inf, False
    while size > 0:
        key, item = keys[0], items[0]
        size = _pop(keys, items, size)
        if faster:
            limit, faster = _slowest(best, places.pending), False
        if key >= limit:
            break
        state, gear = item // 2, item % 2
        chain, here = chain_of[state], cost[state, gear]
        speed = speeds.backward if gear == BACKWARD else speeds.forward
        ahead = _distance_to(box, corners, chain) / speed
        if key > here + ahead:
            continue  # a better label of this state has been walked already
        begin, end = chain_start[chain], chain_start[chain + 1]
        if size + end - begin > keys.size:
            keys = np.concatenate((keys, np.empty(keys.size + end - begin)))
            items = np.concatenate((items, np.empty(keys.size - items.size, dtype=np.int64)))
        for s in range(_top_of(turn, end, state), begin - 1, -1):
            found = here + abs(turn[state] - turn[s]) / speeds.turning
            if s != state:
                if found >= cost[s, gear] or found + ahead >= limit:
                    if s < state:
                        break
                    continue
                cost[s, gear], driven[s, gear] = found, driven[state, gear]
                successor[s, gear] = s + 1 if s < state else s - 1
            if leaves[s] == 1:
                continue
            before = partner[s]
            if before < 0:
                reached = _reach_poses(ways, best, -1 - before, gear, found, driven[s, gear])
                faster = faster or reached
                continue
            time = found + length[s] / speed
            key = time + _distance_to(box, corners, chain_of[before]) / speed
            if time < cost[before, gear] and key < limit:
                cost[before, gear], driven[before, gear] = time, driven[s, gear] + length[s]
                successor[before, gear] = s
                size = _push(keys, items, size, key, 2 * before + gear)


@kernel
def _seed(
    graph: TangentGraph,
    tangents: GoalTangents,
    turning: float,
    cost: Array,
    driven: Array,
    successor: Indices,
) -> Indices:
    """Label the last states before the goal tangents; those states, each once for a gear."""
    seeded = np.empty(2 * tangents.turn.size, dtype=np.int64)
    count = 0
    for k in range(tangents.turn.size):
        chain, leaves_at = tangents.ends[k, 0], tangents.turn[k]
        begin, end = graph.chain_start[chain], graph.chain_start[chain + 1]
        state = first_from(graph.turn, begin, end, leaves_at + 2.0 * SAME_TURN) - 1
        if state < begin:
            continue
        turned = abs(leaves_at - graph.turn[state]) / turning
        for gear in range(2):
            reached = tangents.cost[k, gear] + turned
            if reached < cost[state, gear]:
                if cost[state, gear] == math.inf:
                    seeded[count] = 2 * state + gear
                    count += 1
                cost[state, gear], driven[state, gear] = reached, tangents.length[k]
                successor[state, gear] = FIRST_GOAL - k
    return seeded[:count]


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
    best = np.zeros((poses, 2))
    best[:, COST] = math.inf
    labels = Labels(
        np.full((count, 2), math.inf),
        np.empty((count, 2)),
        np.full((count, 2), NO_SUCCESSOR),
        best,
    )
    seeded = _seed(graph, tangents, speeds.turning, labels.cost, labels.length, labels.successor)
    keys = np.empty(2 * count + seeded.size)
    items = np.empty(keys.size, dtype=np.int64)
    for k in range(seeded.size):
        state, gear = seeded[k] // 2, seeded[k] % 2
        speed = speeds.backward if gear == BACKWARD else speeds.forward
        ahead = _distance_to(places.box, corners, graph.chain[state]) / speed
        _push(keys, items, k, labels.cost[state, gear] + ahead, seeded[k])
    _run(graph, corners, places, labels, speeds, keys, items, seeded.size)
    return labels
