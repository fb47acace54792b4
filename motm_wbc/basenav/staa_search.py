"""What the search of the local planner works on: the problem, its memory, queue and cells."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.cost_tiles import CostTiles
from motm_wbc.basenav.footprint_check import EdgeMap, Outline
from motm_wbc.basenav.movers import Movers
from motm_wbc.basenav.proximity import ProximityGrid
from motm_wbc.basenav.staa_motion import Drive
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import lean

Indices = NDArray[np.int64]

# columns of Memory.nodes: state at the end of the node's step, costs [s]
X, Y, HEADING, V, OMEGA, G, H, F = range(8)
# columns of Memory.links
PARENT, ACTION, ROOT, CELL, DEPTH = range(5)
# entries of Memory.counters
NODES, QUEUED, EXPANSIONS, BEST, GOAL, CHILDREN = range(6)
# entries of Memory.values
BEST_H, GOAL_COST, ORIGIN_COS, ORIGIN_SIN = range(4)
# last axis of Memory.turns: the arc of unit length, and the turn with cosine and sine
ALONG, ACROSS, TURN, COS, SIN = range(5)

_OUTSIDE = -1  # no cell: beyond the window
_SPREAD = -7046029254386353131  # 2^64 over the golden ratio: neighbouring cells fall far apart
_HIGH = 40  # the product's upper bits depend on all of the cell's
_FREE = -1  # empty place of the hash table
_BINS = 4096  # of a velocity, more than there are
_FINER = 2.0  # bins of velocity for each step between two actions


class Problem(NamedTuple):
    """One planning problem; everything that the search only reads.

    Attributes:
        drive: limits and times.
        world: the obstacles.
        outline: the base's.
        grid: nearness of obstacles.
        samples: (k, 2) points of the outline at which nearness is read [m].
        tiles: cost-to-go of the goal.
        movers: obstacles that move.
        moving: cost of a step next to one of them [s].
        start: (4,) x [m], y [m], cos and sin of the heading at the root.
        goal: (3,) pose [m, m, rad].
        stop: the base shall come to rest at the goal.
        goal_distance: tolerance [m].
        goal_angle: tolerance [rad].
        docking: weight of the remaining error at a stop.
        margin: distance to keep from obstacles [m].
        proximity: cost of a step at nearness 1 [s].
        weight: of the cost-to-go in the order of expansion.
        cell: of the closed set [m].
        headings: that the closed set tells apart.
        half_window: half the side of the window [m].
        window_ahead: how far ahead of the root its centre lies [m].
    """

    drive: Drive
    world: EdgeMap
    outline: Outline
    grid: ProximityGrid
    samples: Array
    tiles: CostTiles
    movers: Movers
    moving: float
    start: Array
    goal: Array
    stop: bool
    goal_distance: float
    goal_angle: float
    docking: float
    margin: float
    proximity: float
    weight: float
    cell: float
    headings: int
    half_window: float
    window_ahead: float


class Memory(NamedTuple):
    """What the search writes; allocated once.

    Attributes:
        nodes: (n, 8) see the column names.
        links: (n, 5) parent, action, root action, cell, depth.
        queue: (n,) binary heap of node indices.
        closed: (m,) hash table of expanded cells and states.
        counters: (6,) see the names.
        values: (4,) see the names.
        drives: (linear + 1, checks) way of each part of a step [m]; the last row is free
            for an action that is not of the grid.
        turns: (angular + 1, checks, 5) the same for turning.
        ends: (2, max + 1) velocity at the end of a step, linear and angular actions.
        way: (checks, 4) x, y [m], cosine and sine of the heading along a child's step.
    """

    nodes: Array
    links: Indices
    queue: Indices
    closed: Indices
    counters: Indices
    values: Array
    drives: Array
    turns: Array
    ends: Array
    way: Array


def memory_for(expansions: int, linear: int, angular: int, checks: int) -> Memory:
    """Room for a search."""
    nodes = 2 + (expansions + 1) * linear * angular
    places = 1 << math.ceil(math.log2(4 * expansions + 4))  # a cell and a state for each
    return Memory(
        nodes=np.zeros((nodes, 8)),
        links=np.zeros((nodes, 5), dtype=np.int64),
        queue=np.zeros(nodes, dtype=np.int64),
        closed=np.zeros(places, dtype=np.int64),
        counters=np.zeros(6, dtype=np.int64),
        values=np.zeros(4),
        drives=np.zeros((linear + 1, checks)),
        turns=np.zeros((angular + 1, checks, 5)),
        ends=np.zeros((2, max(linear, angular) + 1)),
        way=np.zeros((checks, 4)),
    )


@lean
def clear_memory(memory: Memory) -> None:
    """Forget the last search."""
    memory.closed[:] = _FREE
    memory.counters[:] = 0
    memory.counters[BEST] = -1
    memory.counters[GOAL] = -1
    memory.values[BEST_H] = math.inf
    memory.values[GOAL_COST] = math.inf


@lean
def _before(nodes: Array, first: int, second: int) -> bool:
    """Order of the queue: by f, then by age, so that it never depends on chance."""
    if nodes[first, F] != nodes[second, F]:
        return bool(nodes[first, F] < nodes[second, F])
    return first < second


@lean
def push(memory: Memory, node: int) -> None:
    """Put a node in the queue."""
    queue, nodes = memory.queue, memory.nodes
    place = memory.counters[QUEUED]
    memory.counters[QUEUED] = place + 1
    while place > 0:
        above = (place - 1) // 2
        if not _before(nodes, node, queue[above]):
            break
        queue[place] = queue[above]
        place = above
    queue[place] = node


@lean
def pop(memory: Memory) -> int:
    """Take the node of the least f; the queue must not be empty."""
    queue, nodes = memory.queue, memory.nodes
    top = queue[0]
    count = memory.counters[QUEUED] - 1
    memory.counters[QUEUED] = count
    moved = queue[count]
    place = 0
    while True:
        child = 2 * place + 1
        if child >= count:
            break
        if child + 1 < count and _before(nodes, queue[child + 1], queue[child]):
            child += 1
        if not _before(nodes, queue[child], moved):
            break
        queue[place] = queue[child]
        place = child
    queue[place] = moved
    return int(top)


@lean
def cell_of(problem: Problem, x: float, y: float, heading: float) -> int:
    """Cell of the closed set, in the frame of the root; negative beyond the window."""
    start = problem.start
    dx, dy = x - start[0], y - start[1]
    ahead = start[2] * dx + start[3] * dy - problem.window_ahead
    beside = start[2] * dy - start[3] * dx
    half = problem.half_window
    if abs(ahead) > half or abs(beside) > half:
        return _OUTSIDE
    side = int(2.0 * half / problem.cell) + 2
    column = int((ahead + half) / problem.cell)
    row = int((beside + half) / problem.cell)
    turned = heading / math.tau
    sector = int((turned - math.floor(turned)) * problem.headings)
    return (row * side + column) * (problem.headings + 1) + sector


@lean
def state_of(problem: Problem, memory: Memory, cell: int, v: float, omega: float) -> int:
    """A cell together with the velocity, told apart as finely as actions change it.

    The key is none of a cell, nor of a free place.
    """
    drive = problem.drive
    linear, angular = memory.drives.shape[0] - 1, memory.turns.shape[0] - 1
    faster = 2.0 * drive.a_max * drive.step / (linear - 1)
    quicker = 2.0 * drive.alpha_max * drive.step / (angular - 1)
    speed = min(int(_FINER * (v + drive.v_reverse) / faster), _BINS - 1)
    turn = min(int(_FINER * (omega + drive.omega_max) / quicker), _BINS - 1)
    return _FREE - 1 - ((cell * _BINS + speed) * _BINS + turn)


@lean
def _place_of(closed: Indices, cell: int) -> int:
    """Place of the cell in the table, or the free one where it would go."""
    mask = closed.shape[0] - 1
    place = (cell * _SPREAD >> _HIGH) & mask
    while closed[place] != _FREE and closed[place] != cell:
        place = (place + 1) & mask
    return int(place)


@lean
def is_closed(memory: Memory, cell: int) -> bool:
    """Whether a node in this cell, or this state, has been expanded."""
    return bool(memory.closed[_place_of(memory.closed, cell)] == cell)


@lean
def close(memory: Memory, cell: int) -> None:
    """Mark a cell or a state as expanded."""
    memory.closed[_place_of(memory.closed, cell)] = cell
