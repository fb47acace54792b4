"""Children of a node of the search: driven, checked, priced and queued."""

from __future__ import annotations

import math

from motm_wbc.basenav.cost_tiles import tiled_cost_to_go
from motm_wbc.basenav.footprint_check import is_clear
from motm_wbc.basenav.movers import half_way, meets_mover, nearness_of_movers
from motm_wbc.basenav.proximity import largest_under
from motm_wbc.basenav.staa_goal import passes_goal, remaining_error, rest_pose, time_to_stop
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
    GOAL,
    GOAL_COST,
    HEADING,
    NODES,
    OMEGA,
    ORIGIN_COS,
    ORIGIN_SIN,
    PARENT,
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
    is_closed,
    push,
    state_of,
)
from motm_wbc.geometry.jit import lean
from motm_wbc.geometry.wrapping import wrapped

_SLOT = 1.0  # [s] by which the closed set tells times apart where something moves
_SLOT_KEYS = 1 << 28  # more than there are cells
_STRICT = 0.8  # share of the tolerances that a new plan has to meet: there is some left later


@lean
def add_child(
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
    cell = _cell_in_time(problem, memory, parent, x, y, heading)
    v, omega = memory.ends[0, i], memory.ends[1, j]
    if (
        _is_news(problem, memory, parent, cell, v, omega)
        and _way_is_clear(problem, memory, memory.links[parent, DEPTH], i, j, parts)
        and _rests_clear(problem, x, y, heading, v, omega)
    ):
        _keep_child(problem, memory, parent, action, root, i, j, x, y, heading, cell, share)


@lean
def _cell_in_time(
    problem: Problem, memory: Memory, parent: int, x: float, y: float, heading: float
) -> int:
    """Cell of the closed set; among obstacles that move, each is another one later on.

    So the base can let something pass: where it stands is blocked at one time, free at another.
    """
    cell = cell_of(problem, x, y, heading)
    if cell < 0 or problem.movers.discs.shape[0] == 0:
        return cell
    slot = int((memory.links[parent, DEPTH] + 1) * problem.drive.step / _SLOT)
    return cell + slot * _SLOT_KEYS


@lean
def _is_news(
    problem: Problem, memory: Memory, parent: int, cell: int, v: float, omega: float
) -> bool:
    """Whether a child leads to where the search has not been."""
    if parent == 0:
        return True
    if cell < 0:
        return False
    if not is_closed(memory, cell):
        return True
    if cell != memory.links[parent, CELL]:
        return False
    return not is_closed(memory, state_of(problem, memory, cell, v, omega))


@lean
def _rests_clear(
    problem: Problem, x: float, y: float, heading: float, v: float, omega: float
) -> bool:
    """Whether the base, braking from here, would come to rest free of overlap.

    If not, no first action that leads on from here will be admissible.
    """
    if v == 0.0 and omega == 0.0:
        return True
    rx, ry, turned = rest_pose(problem, x, y, heading, v, omega)
    c, s = math.cos(turned), math.sin(turned)
    return bool(is_clear(problem.world, problem.outline, rx, ry, c, s, problem.margin))


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
    h = heuristic(problem, x, y, heading, v, omega)
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
    # To stay at rest is no progress by itself, unless something will have passed by then.
    waits = waits and problem.movers.discs.shape[0] == 0
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
def heuristic(
    problem: Problem, x: float, y: float, heading: float, v: float, omega: float
) -> float:
    """Cost-to-go of a node [s]."""
    if problem.stop:
        return time_to_stop(problem, x, y, heading, v, omega)
    return tiled_cost_to_go(problem.tiles, x, y, heading)
