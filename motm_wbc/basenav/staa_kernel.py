"""Modified STAA*: an aborted A* over (x, y, heading, v, omega).

Sources: Missura, Roychoudhury, Bennewitz, "Fast-Replanning Motion Control for
Non-Holonomic Vehicles with Aborting A*" (2109.07775); the goal as a pose that is driven
through, and the shrinking proximity weight: Burgess-Limerick et al., "Enabling Failure
Recovery for On-The-Move Mobile Manipulation" (2305.08351).

    g = g_parent + step + k w_grid nearness,    f = g + 1.3 h,    h = PathRTR(node -> goal)

The search ends at the goal or at a number of expansions; the answer is then the first
action on the way to the node of the lowest h.

The closed set knows cells of (x, y, heading). Not in the papers: a child that stays in its
parent's cell is let through if no node of its cell and velocity has been expanded. Without
that a base at rest, whose first steps are shorter than a cell, would block its own way.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.staa_admissible import RATE_OMEGA, RATE_V, TARGET_OMEGA, TARGET_V
from motm_wbc.basenav.staa_child import add_child, heuristic
from motm_wbc.basenav.staa_follow import DURATION
from motm_wbc.basenav.staa_motion import profile, travel, velocity_after
from motm_wbc.basenav.staa_search import (
    ACROSS,
    ACTION,
    ALONG,
    CELL,
    COS,
    DEPTH,
    EXPANSIONS,
    GOAL,
    HEADING,
    NODES,
    OMEGA,
    ORIGIN_COS,
    ORIGIN_SIN,
    PARENT,
    QUEUED,
    ROOT,
    SIN,
    TURN,
    F,
    G,
    H,
    Memory,
    Problem,
    V,
    X,
    Y,
    cell_of,
    clear_memory,
    close,
    is_closed,
    pop,
    state_of,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_STRAIGHT = 1e-9  # [rad] turned below which the arc's series is exact
_NO_PARENT = -1


@lean
def _set_drive(memory: Memory, row: int, v: float, target: float, rate: float, step: float) -> None:
    """Way of every part of a step under a linear action."""
    checks = memory.drives.shape[1]
    before = 0.0
    for part in range(checks):
        until = travel(v, target, rate, step * (part + 1) / checks)
        memory.drives[row, part] = until - before
        before = until
    memory.ends[0, row] = velocity_after(v, target, rate, step)


@lean
def _set_turn(
    memory: Memory, row: int, omega: float, target: float, rate: float, step: float
) -> None:
    """Turn of every part of a step under an angular action, and the arc of unit length."""
    checks = memory.drives.shape[1]
    before = 0.0
    for part in range(checks):
        until = travel(omega, target, rate, step * (part + 1) / checks)
        turn = until - before
        before = until
        arc = memory.turns[row, part]
        arc[TURN], arc[COS], arc[SIN] = turn, math.cos(turn), math.sin(turn)
        if abs(turn) < _STRAIGHT:
            arc[ALONG], arc[ACROSS] = 1.0, 0.5 * turn
        else:
            arc[ALONG], arc[ACROSS] = arc[SIN] / turn, (1.0 - arc[COS]) / turn
    memory.ends[1, row] = velocity_after(omega, target, rate, step)


@lean
def _set_actions(problem: Problem, memory: Memory, v: float, omega: float) -> None:
    """Fill the tables of ways and turns for a node's velocity."""
    drive = problem.drive
    linear, angular = memory.drives.shape[0] - 1, memory.turns.shape[0] - 1
    for row in range(linear):
        target, rate = profile(
            v, row, linear, drive.a_max, -drive.v_reverse, drive.v_max, drive.step
        )
        _set_drive(memory, row, v, target, rate, drive.step)
    for row in range(angular):
        target, rate = profile(
            omega, row, angular, drive.alpha_max, -drive.omega_max, drive.omega_max, drive.step
        )
        _set_turn(memory, row, omega, target, rate, drive.step)


@lean
def _look_along(memory: Memory, heading: float) -> None:
    """Note the direction of the node that children are made of."""
    memory.values[ORIGIN_COS], memory.values[ORIGIN_SIN] = math.cos(heading), math.sin(heading)


@lean
def start(
    problem: Problem,
    memory: Memory,
    heading: float,
    v: float,
    omega: float,
    table: Array,
    admissible: NDArray[np.bool_],
) -> None:
    """Begin a search: the root and its admissible children.

    Args:
        problem: what to plan.
        memory: overwritten.
        heading: of the root [rad].
        v: speed at the root [m/s].
        omega: turn rate at the root [rad/s].
        table: (n, 6) first actions.
        admissible: (n,) which of them may be taken.
    """
    clear_memory(memory)
    x, y = problem.start[0], problem.start[1]
    root = memory.nodes[0]
    root[X], root[Y], root[HEADING], root[V], root[OMEGA] = x, y, heading, v, omega
    root[G] = root[F] = 0.0
    root[H] = heuristic(problem, x, y, heading, v, omega)
    links = memory.links[0]
    links[PARENT], links[ACTION], links[ROOT], links[DEPTH] = _NO_PARENT, 0, _NO_PARENT, 0
    links[CELL] = cell_of(problem, x, y, heading)
    memory.counters[NODES] = 1
    # Not its state: a node that has waited there may do what is not admissible at the root.
    close(memory, links[CELL])
    _look_along(memory, heading)
    linear, angular = memory.drives.shape[0] - 1, memory.turns.shape[0] - 1
    for action in range(table.shape[0]):
        if admissible[action]:
            row = table[action]
            _set_drive(memory, linear, v, row[TARGET_V], row[RATE_V], problem.drive.step)
            _set_turn(
                memory, angular, omega, row[TARGET_OMEGA], row[RATE_OMEGA], problem.drive.step
            )
            add_child(problem, memory, 0, action, action, linear, angular)
    memory.counters[EXPANSIONS] = 1


@lean
def advance(problem: Problem, memory: Memory, until: int) -> bool:
    """Go on with the search up to a number of expansions.

    Returns:
        Whether the search has ended: the goal was found or nothing is left to expand.
    """
    counters = memory.counters
    linear, angular = memory.drives.shape[0] - 1, memory.turns.shape[0] - 1
    while counters[EXPANSIONS] < until:
        if counters[GOAL] >= 0 or counters[QUEUED] == 0:
            return True
        node = pop(memory)
        cell, parent = memory.links[node, CELL], memory.links[node, PARENT]
        state = state_of(problem, memory, cell, memory.nodes[node, V], memory.nodes[node, OMEGA])
        within = memory.links[parent, CELL] == cell
        if is_closed(memory, cell) and (not within or is_closed(memory, state)):
            continue
        close(memory, cell)
        close(memory, state)
        counters[EXPANSIONS] += 1
        _set_actions(problem, memory, memory.nodes[node, V], memory.nodes[node, OMEGA])
        _look_along(memory, memory.nodes[node, HEADING])
        for i in range(linear):
            if i != linear // 2 and memory.ends[0, i] == memory.ends[0, linear // 2]:
                continue  # at the speed limit: the same as holding the speed
            for j in range(angular):
                if j != angular // 2 and memory.ends[1, j] == memory.ends[1, angular // 2]:
                    continue
                add_child(problem, memory, node, i * angular + j, memory.links[node, ROOT], i, j)
    return bool(counters[GOAL] >= 0 or counters[QUEUED] == 0)


@kernel
def actions_to(problem: Problem, memory: Memory, leaf: int, table: Array) -> Array:
    """The actions on the way to a node.

    Args:
        problem: what was planned.
        memory: of the search.
        leaf: last node of the way.
        table: (n, 6) first actions.

    Returns:
        (k, 5) actions as in `staa_follow`.
    """
    drive = problem.drive
    linear, angular = memory.drives.shape[0] - 1, memory.turns.shape[0] - 1
    depth = memory.links[leaf, DEPTH]
    actions = np.empty((depth, 5))
    actions[:, DURATION] = drive.step
    node = leaf
    for level in range(depth - 1, -1, -1):
        action, parent = memory.links[node, ACTION], memory.links[node, PARENT]
        if level == 0:
            actions[0, :DURATION] = table[action, :DURATION]
            break
        actions[level, TARGET_V], actions[level, RATE_V] = profile(
            memory.nodes[parent, V],
            action // angular,
            linear,
            drive.a_max,
            -drive.v_reverse,
            drive.v_max,
            drive.step,
        )
        actions[level, TARGET_OMEGA], actions[level, RATE_OMEGA] = profile(
            memory.nodes[parent, OMEGA],
            action % angular,
            angular,
            drive.alpha_max,
            -drive.omega_max,
            drive.omega_max,
            drive.step,
        )
        node = parent
    return actions
