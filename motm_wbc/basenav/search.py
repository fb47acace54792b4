"""Backward search: time from every state of the tangent graph to the goals.

The cost of an edge depends on the direction that it is entered from, so the search runs
over directed tangents (states on chains, see `graph`), exactly. A state's successors are
the next state of its chain (turning on), the other end of its tangent (driving), and the
tangents to goals that leave its chain further on. Driven backward in a reversed world, the
same search gives the times *from* a place to all others.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.graph import TangentGraph
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

SAME_TURN = 1e-8
"""Directions nearer than this are one direction [rad]: a path may turn back by it."""
NO_SUCCESSOR = -1
FIRST_GOAL = -2
"""Successor `FIRST_GOAL - k` is the goal tangent k."""


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
def _seed(
    graph: TangentGraph,
    goal_start: Indices,
    goal_turn: Array,
    goal_cost: Array,
    turning: float,
    cost: Array,
    successor: Indices,
) -> None:
    """Costs of the last states before each goal tangent, by that tangent."""
    for chain in range(goal_start.size - 1):
        begin, end = graph.chain_start[chain], graph.chain_start[chain + 1]
        for k in range(goal_start[chain], goal_start[chain + 1]):
            state = first_from(graph.turn, begin, end, goal_turn[k] + 2.0 * SAME_TURN) - 1
            if state < begin:
                continue
            found = goal_cost[k] + abs(goal_turn[k] - graph.turn[state]) / turning
            if found < cost[state]:
                cost[state] = found
                successor[state] = FIRST_GOAL - k


@kernel
def _predecessor(
    graph: TangentGraph, chain_of: Indices, state: int, move: int, speed: float, turning: float
) -> tuple[int, float]:
    """The state that comes before by a move, -1 if none does, and the move's time [s]."""
    if move == 0:  # driven here from the other end of the tangent
        if graph.leaves[state] == 1:
            return -1, 0.0
        return graph.partner[state], graph.length[state] / speed
    before = state - 1 if move == 1 else state + 1  # turned on to here, or back by rounding
    if before < 0 or before >= chain_of.size or chain_of[before] != chain_of[state]:
        return -1, 0.0
    turned = abs(graph.turn[state] - graph.turn[before])
    if move == 2 and turned > SAME_TURN:
        return -1, 0.0
    return before, turned / turning


@kernel
def remaining_times(
    graph: TangentGraph,
    goal_start: Indices,
    goal_turn: Array,
    goal_cost: Array,
    speed: float,
    turning: float,
) -> tuple[Array, Indices]:
    """Dijkstra's search from the goals against the direction of travel, in one gear.

    Args:
        graph: tangents.
        goal_start: (2 n + 1,) first goal tangent of each chain.
        goal_turn: (t,) chain coordinate at which each goal tangent leaves [rad].
        goal_cost: (t,) time along it, with the last turn [s].
        speed: [m/s].
        turning: [rad/s].

    Returns:
        Time from each state to a goal [s], infinite if there is none, and the successor
        on that path.
    """
    count = graph.turn.size
    cost = np.full(count, math.inf)
    successor = np.full(count, NO_SUCCESSOR)
    _seed(graph, goal_start, goal_turn, goal_cost, turning, cost, successor)
    chain_of = np.empty(count, dtype=np.int64)
    for chain in range(graph.chain_start.size - 1):
        chain_of[graph.chain_start[chain] : graph.chain_start[chain + 1]] = chain
    keys = np.empty(4 * count + 1)
    items = np.empty(4 * count + 1, dtype=np.int64)
    size = 0
    for state in range(count):
        if cost[state] < math.inf:
            size = _push(keys, items, size, cost[state], state)
    while size > 0:
        reached, state = keys[0], items[0]
        size = _pop(keys, items, size)
        if reached > cost[state]:
            continue
        for move in range(3):
            before, step = _predecessor(graph, chain_of, state, move, speed, turning)
            if before >= 0 and reached + step < cost[before]:
                cost[before] = reached + step
                successor[before] = state
                size = _push(keys, items, size, cost[before], before)
    return cost, successor
