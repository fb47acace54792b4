"""Modified STAA*: an aborted A* over (x, y, heading, v, omega).

Sources: Missura, Roychoudhury, Bennewitz, "Fast-Replanning Motion Control for
Non-Holonomic Vehicles with Aborting A*" (2109.07775); the goal as a pose that is driven
through, and the shrinking proximity weight: Burgess-Limerick et al., "Enabling Failure
Recovery for On-The-Move Mobile Manipulation" (2305.08351).

    g = g_parent + step + k w_grid nearness,    f = g + 1.3 h,    h = PathRTR(node -> goal)

The search ends at the goal or at a number of expansions; the answer is then the first
action on the way to the node of the lowest h.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from motm_wbc.basenav.cost_tiles import tiled_cost_to_go
from motm_wbc.basenav.footprint_check import is_clear
from motm_wbc.basenav.movers import half_way, meets_mover, nearness_of_movers
from motm_wbc.basenav.proximity import largest_under
from motm_wbc.basenav.staa_admissible import RATE_OMEGA, RATE_V, TARGET_OMEGA, TARGET_V
from motm_wbc.basenav.staa_follow import DURATION
from motm_wbc.basenav.staa_goal import passes_goal, remaining_error, time_to_stop
from motm_wbc.basenav.staa_motion import profile, travel, velocity_after, wrapped
from motm_wbc.basenav.staa_search import (
    ACROSS,
    ACTION,
    ALONG,
    BEST,
    BEST_H,
    CELL,
    CHILDREN,
    COS,
    DEPTH,
    EXPANSIONS,
    GOAL,
    GOAL_COST,
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
    push,
)
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_STRAIGHT = 1e-9  # [rad] turned below which the arc's series is exact
_NO_PARENT = -1
_STRICT = 0.8  # share of the tolerances that a new plan has to meet: there is some left later


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
    root[H] = _heuristic(problem, x, y, heading, v, omega)
    links = memory.links[0]
    links[PARENT], links[ACTION], links[ROOT], links[DEPTH] = _NO_PARENT, 0, _NO_PARENT, 0
    links[CELL] = cell_of(problem, x, y, heading)
    memory.counters[NODES] = 1
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
            _add_child(problem, memory, 0, action, action, linear, angular)
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
        if is_closed(memory, cell) and memory.links[parent, CELL] != cell:
            continue
        close(memory, cell)
        counters[EXPANSIONS] += 1
        _set_actions(problem, memory, memory.nodes[node, V], memory.nodes[node, OMEGA])
        _look_along(memory, memory.nodes[node, HEADING])
        for i in range(linear):
            if i != linear // 2 and memory.ends[0, i] == memory.ends[0, linear // 2]:
                continue  # at the speed limit: the same as holding the speed
            for j in range(angular):
                if j != angular // 2 and memory.ends[1, j] == memory.ends[1, angular // 2]:
                    continue
                _add_child(problem, memory, node, i * angular + j, memory.links[node, ROOT], i, j)
    return bool(counters[GOAL] >= 0 or counters[QUEUED] == 0)


@lean
def _add_child(
    problem: Problem, memory: Memory, parent: int, action: int, root: int, i: int, j: int
) -> None:
    """Drive one action (rows i and j of the tables) from a node; keep where it leads."""
    memory.counters[CHILDREN] += 1
    origin = memory.nodes[parent]
    x, y, heading = origin[X], origin[Y], origin[HEADING]
    c, s = memory.values[ORIGIN_COS], memory.values[ORIGIN_SIN]
    share = -1.0
    parts = checks = memory.drives.shape[1]
    for part in range(checks):
        arc, way = memory.turns[j, part], memory.drives[i, part]
        px, py, before = x, y, heading
        x += way * (c * arc[ALONG] - s * arc[ACROSS])
        y += way * (s * arc[ALONG] + c * arc[ACROSS])
        heading += arc[TURN]
        c, s = c * arc[COS] - s * arc[SIN], s * arc[COS] + c * arc[SIN]
        memory.way[part, 0], memory.way[part, 1] = x, y
        memory.way[part, 2], memory.way[part, 3] = c, s
        if not problem.stop:
            passed = passes_goal(problem, _STRICT, px, py, before, x, y, heading)
            if passed >= 0.0:
                share = (part + passed) / checks
                x, y = px + passed * (x - px), py + passed * (y - py)
                heading = before + passed * (heading - before)
                parts = part + 1
                break
    heading = wrapped(heading)
    cell = cell_of(problem, x, y, heading)
    if _is_news(memory, parent, cell, memory.ends[0, i], memory.ends[1, j]) and _way_is_clear(
        problem, memory, memory.links[parent, DEPTH], i, j, parts
    ):
        _keep_child(problem, memory, parent, action, root, i, j, x, y, heading, cell, share)


@lean
def _is_news(memory: Memory, parent: int, cell: int, v: float, omega: float) -> bool:
    """Whether a child leads to where the search has not been.

    Velocity is not in the key, so a base that starts from rest would block its own cell: a
    child that has changed its velocity and moves on is let through.
    """
    if parent == 0:
        return True
    if cell < 0:
        return False
    if not is_closed(memory, cell):
        return True
    origin = memory.nodes[parent]
    at_rest, same = v == 0.0 and omega == 0.0, v == origin[V] and omega == origin[OMEGA]
    return cell == memory.links[parent, CELL] and not at_rest and not same


@lean
def _way_is_clear(problem: Problem, memory: Memory, depth: int, i: int, j: int, parts: int) -> bool:
    """Whether the first parts of a child's step are free of overlap, the last one first."""
    for part in range(parts - 1, -1, -1):
        x, y, c, s = memory.way[part]
        if not is_clear(problem.world, problem.outline, x, y, c, s, problem.margin):
            return False
    if problem.movers.discs.shape[0] == 0:
        return True
    interval = problem.drive.step / memory.drives.shape[1]
    for part in range(parts):
        x, y, c, s = memory.way[part]
        grown = problem.margin + half_way(
            problem.movers,
            problem.outline,
            memory.drives[i, part],
            memory.turns[j, part, TURN],
            interval,
        )
        time = depth * problem.drive.step + (part + 1) * interval
        if meets_mover(problem.movers, problem.outline, grown, x, y, c, s, time):
            return False
    return True


@lean
def _keep_child(
    problem: Problem,
    memory: Memory,
    parent: int,
    action: int,
    root: int,
    i: int,
    j: int,
    x: float,
    y: float,
    heading: float,
    cell: int,
    share: float,
) -> None:
    """Price a child that is free of collision and put it in the queue."""
    origin = memory.nodes[parent]
    v, omega = memory.ends[0, i], memory.ends[1, j]
    waits = v == 0.0 and omega == 0.0 and origin[V] == 0.0 and origin[OMEGA] == 0.0
    h = _heuristic(problem, x, y, heading, v, omega)
    if h == math.inf:
        return
    c, s = math.cos(heading), math.sin(heading)
    near = largest_under(problem.grid, problem.samples, x, y, c, s)
    depth = memory.links[parent, DEPTH] + 1
    beside = nearness_of_movers(problem.movers, problem.outline, x, y, depth * problem.drive.step)
    node = memory.counters[NODES]
    memory.counters[NODES] = node + 1
    child, links = memory.nodes[node], memory.links[node]
    child[X], child[Y], child[HEADING], child[V], child[OMEGA] = x, y, heading, v, omega
    child[G] = origin[G] + problem.drive.step + problem.proximity * near + problem.moving * beside
    child[H] = h
    child[F] = child[G] + problem.weight * h
    links[PARENT], links[ACTION], links[ROOT], links[CELL] = parent, action, root, cell
    links[DEPTH] = depth
    _note_goal(problem, memory, node, share)
    # To stay at rest is no progress by itself; what can be done afterwards may be.
    if h < memory.values[BEST_H] and not waits:
        memory.values[BEST_H] = h
        memory.counters[BEST] = node
    push(memory, node)


@lean
def _note_goal(problem: Problem, memory: Memory, node: int, share: float) -> None:
    """Keep the node if it reaches the goal at the least cost so far."""
    child = memory.nodes[node]
    if problem.stop:
        error, duration = remaining_error(
            problem, _STRICT, child[X], child[Y], child[HEADING], child[V], child[OMEGA]
        )
        if error == math.inf:
            return
        cost = child[G] + duration + problem.docking * error
    elif share >= 0.0:
        error, _ = remaining_error(problem, _STRICT, child[X], child[Y], child[HEADING], 0.0, 0.0)
        cost = child[G] - (1.0 - share) * problem.drive.step + problem.weight * error
    else:
        return
    if cost < memory.values[GOAL_COST]:
        memory.values[GOAL_COST] = cost
        memory.counters[GOAL] = node


@lean
def _heuristic(
    problem: Problem, x: float, y: float, heading: float, v: float, omega: float
) -> float:
    """Cost-to-go of a node [s]."""
    if problem.stop:
        return time_to_stop(problem, x, y, heading, v, omega)
    return tiled_cost_to_go(problem.tiles, x, y, heading)


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
