"""The tangent visibility graph: which corners a taut path can go between, and how.

The optimum of length plus turning is a taut path: short-cutting adds neither. So a path
bends only round convex corners, with the obstacle inside of the bend, and between bends it
follows common tangents (Missura, Lee, Bennewitz, "Minimal Construct", IROS 2018).

A *chain* is a corner together with the side on which the obstacle lies, 2 x corner + side.
Along a chain, the path's direction can only turn one way; how far it has turned is the
chain's coordinate, measured from the ring's edge so that it grows along the path. Every
directed tangent is one *state* on the chain at either end: it leaves there or arrives.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.visibility import (
    LEFT,
    NEITHER,
    RIGHT,
    may_be_tangent,
    sees,
    tangent_side,
)
from motm_wbc.basenav.walls import (
    AFTER_X,
    AFTER_Y,
    BEFORE_X,
    BEFORE_Y,
    INCOMING,
    TOUCH,
    TURN,
    Indices,
    Walls,
    X,
    Y,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_FEW = 256


class TangentGraph(NamedTuple):
    """States of all directed tangents, sorted by chain and turn.

    Attributes:
        chain_start: (2 n + 1,) first state of each chain.
        turn: (s,) how far the direction has turned on its chain [rad], ascending.
        partner: (s,) the state at the other end of the tangent.
        leaves: (s,) 1 if the path leaves along the tangent here, 0 if it arrives.
        length: (s,) length of the tangent [m].
        chain: (s,) chain of each state.
    """

    chain_start: Indices
    turn: Array
    partner: Indices
    leaves: Indices
    length: Array
    chain: Indices


@lean
def chain_turn(corners: Array, corner: int, side: int, angle: float) -> float:
    """Coordinate on a chain of a path's direction `angle` [rad]; grows as the path bends."""
    turned = float(angle - corners[corner, INCOMING])
    if side == RIGHT:
        turned += math.pi
    while turned > 5.0:  # legal is [0, pi), up to rounding
        turned -= math.tau
    while turned < -1.0:
        turned += math.tau
    return turned if side == LEFT else -turned


@kernel
def _find_tangents(walls: Walls) -> tuple[Indices, Array]:
    """Common tangents of all pairs of corners that see each other.

    Returns:
        (t, 2) chains at either end, (t, 2) direction [rad] and length [m].
    """
    corners, links = walls.corners, walls.links
    ring_start, boxes = walls.ring_start, walls.ring_box
    convex = np.flatnonzero(corners[:, TURN] > 0.0)
    x, y = corners[convex, X], corners[convex, Y]
    ends = np.empty((_FEW, 2), dtype=np.int64)
    shape = np.empty((_FEW, 2))
    count = 0
    for i in range(convex.size):
        u = convex[i]
        before_x, before_y = corners[u, BEFORE_X], corners[u, BEFORE_Y]
        after_x, after_y = corners[u, AFTER_X], corners[u, AFTER_Y]
        for j in range(i + 1, convex.size):
            dx, dy = x[j] - x[i], y[j] - y[i]
            # most pairs end here: the line cuts into the first corner (see `may_be_tangent`)
            slack = TOUCH * (abs(dx) + abs(dy))
            s_before, s_after = dx * before_y - dy * before_x, dx * after_y - dy * after_x
            left = s_before >= -slack and s_after >= -slack
            if not left and not (s_before <= slack and s_after <= slack):
                continue
            v = convex[j]
            if not may_be_tangent(corners, v, dx, dy):
                continue
            length = math.hypot(dx, dy)
            if length <= TOUCH:
                continue
            at_u = tangent_side(corners, links, u, dx / length, dy / length)
            if at_u == NEITHER:
                continue
            at_v = tangent_side(corners, links, v, dx / length, dy / length)
            if at_v == NEITHER or not sees(
                corners, links, ring_start, boxes, x[i], y[i], x[j], y[j]
            ):
                continue
            if count == ends.shape[0]:
                ends = np.concatenate((ends, np.empty_like(ends)))
                shape = np.concatenate((shape, np.empty_like(shape)))
            ends[count, 0], ends[count, 1] = 2 * u + at_u, 2 * v + at_v
            shape[count, 0], shape[count, 1] = math.atan2(dy, dx), length
            count += 1
    return ends[:count], shape[:count]


class Tangents(NamedTuple):
    """Tangents between a place and corners.

    Attributes:
        chain: (t,) that each one touches.
        angle: (t,) direction in which it is driven [rad].
        turn: (t,) of that direction on the chain [rad].
        length: (t,) [m].
    """

    chain: Indices
    angle: Array
    turn: Array
    length: Array


@kernel
def tangents_at(walls: Walls, x: float, y: float, toward: bool) -> Tangents:
    """Tangents between a free place (x, y) [m] and all corners in sight.

    Args:
        walls: outlines of the free space.
        x: of the place [m].
        y: of the place [m].
        toward: they are driven to the place; else from there to the corners.
    """
    corners, links = walls.corners, walls.links
    ring_start, boxes = walls.ring_start, walls.ring_box
    most = corners.shape[0]
    chain = np.empty(most, dtype=np.int64)
    angle, turn, length = np.empty(most), np.empty(most), np.empty(most)
    sense = 1.0 if toward else -1.0
    count = 0
    for corner in range(most):
        cx, cy = corners[corner, X], corners[corner, Y]
        dx, dy = sense * (x - cx), sense * (y - cy)
        if not may_be_tangent(corners, corner, dx, dy):
            continue
        apart = math.sqrt(dx * dx + dy * dy)
        if apart <= TOUCH:
            continue
        side = tangent_side(corners, links, corner, dx / apart, dy / apart)
        if side == NEITHER or not sees(corners, links, ring_start, boxes, x, y, cx, cy):
            continue
        chain[count], angle[count] = 2 * corner + side, math.atan2(dy, dx)
        turn[count], length[count] = chain_turn(corners, corner, side, angle[count]), apart
        count += 1
    return Tangents(chain[:count], angle[:count], turn[:count], length[:count])


@kernel
def _make_states(corners: Array, ends: Indices, shape: Array) -> tuple[Indices, Array]:
    """States of the tangents in both directions, 4 a tangent, partners adjacent.

    Returns:
        (4 t,) chain and (4 t,) turn of each state; even states leave, odd ones arrive.
    """
    count = ends.shape[0]
    chain = np.empty(4 * count, dtype=np.int64)
    turn = np.empty(4 * count)
    for k in range(count):
        for reverse in range(2):
            angle = shape[k, 0] + reverse * math.pi
            for end in range(2):  # 0: leaves, 1: arrives
                there = ends[k, end if reverse == 0 else 1 - end]
                corner, side = there // 2, (there % 2 + reverse) % 2  # reversed: sides swap
                state = 4 * k + 2 * reverse + end
                chain[state] = 2 * corner + side
                turn[state] = chain_turn(corners, corner, side, angle)
    return chain, turn


@kernel
def build_graph(walls: Walls) -> TangentGraph:
    """The tangent visibility graph of the outlines."""
    ends, shape = _find_tangents(walls)
    chain, turn = _make_states(walls.corners, ends, shape)
    order, start = sort_by_chain(chain, turn, 2 * walls.corners.shape[0])
    rank = np.empty_like(order)
    for place in range(order.size):
        rank[order[place]] = place
    partner, leaves = np.empty_like(order), np.empty_like(order)
    length = np.empty(order.size)
    for place in range(order.size):
        state = order[place]
        partner[place], leaves[place] = rank[state ^ 1], 1 - state % 2
        length[place] = shape[state // 4, 1]
    return TangentGraph(start, turn[order], partner, leaves, length, chain[order])


@kernel
def sort_by_chain(chain: Indices, turn: Array, chains: int) -> tuple[Indices, Indices]:
    """Order of some tangents by chain, then turn, and the first one of each chain."""
    start = np.zeros(chains + 1, dtype=np.int64)
    for k in range(chain.size):
        start[chain[k] + 1] += 1
    for c in range(chains):
        start[c + 1] += start[c]
    filled = start[:-1].copy()
    order = np.empty(chain.size, dtype=np.int64)
    for k in range(chain.size):
        place = filled[chain[k]]
        filled[chain[k]] += 1
        while place > start[chain[k]] and turn[order[place - 1]] > turn[k]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = k
    return order, start


@kernel
def with_arrivals(graph: TangentGraph, chain: Indices, turn: Array) -> TangentGraph:
    """A graph with tangents (t,) from places outside of it, as states that arrive.

    The partner of the state of tangent k is -1 - k.
    """
    order, first = sort_by_chain(chain, turn, graph.chain_start.size - 1)
    total = graph.turn.size + turn.size
    start = np.empty_like(graph.chain_start)
    turns, length = np.empty(total), np.empty(total)
    partner, leaves = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    chains, moved = np.empty(total, dtype=np.int64), np.empty(graph.turn.size, dtype=np.int64)
    place = 0
    for c in range(start.size - 1):
        start[c] = place
        state, tangent = graph.chain_start[c], first[c]
        while state < graph.chain_start[c + 1] or tangent < first[c + 1]:
            chains[place] = c
            if tangent == first[c + 1] or (
                state < graph.chain_start[c + 1] and graph.turn[state] <= turn[order[tangent]]
            ):
                moved[state] = place
                turns[place], length[place] = graph.turn[state], graph.length[state]
                partner[place], leaves[place] = graph.partner[state], graph.leaves[state]
                state += 1
            else:
                turns[place], length[place] = turn[order[tangent]], 0.0
                partner[place], leaves[place] = -1 - order[tangent], 0
                tangent += 1
            place += 1
    start[-1] = place
    for k in range(total):
        if partner[k] >= 0:
            partner[k] = moved[partner[k]]
    return TangentGraph(start, turns, partner, leaves, length, chains)


@kernel
def connected_parts(graph: TangentGraph, corners: int) -> Indices:
    """(n,) a number for each corner, the same where a path leads from one to the other.

    Places with a path between them have a taut one, which is made of tangents.
    """
    parent = np.arange(corners)
    for state in range(graph.turn.size):
        a, b = graph.chain[state] // 2, graph.chain[graph.partner[state]] // 2
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        if a < b:
            parent[b] = a
        else:
            parent[a] = b
    for corner in range(corners):
        root = corner
        while parent[root] != root:
            root = parent[root]
        parent[corner] = root
    return parent
