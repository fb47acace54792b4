"""Times from the robot to all candidates, out of one search from where it stands.

A way driven in the other direction turns as much: with all headings turned about, the time
from a place to a candidate is that from the candidate to the place. So the search is the
one that leads to a goal (see `search`), with the robot as the goal. Which corners each
candidate sees depends on target and world only; their tangents are part of the graph.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.field_solver import free_goals, goal_tangents
from motm_wbc.basenav.goal_field import EXTRA, HEADING
from motm_wbc.basenav.graph import TangentGraph, connected_parts, tangents_at, with_arrivals
from motm_wbc.basenav.pathrtr import BACKWARD, Speeds, direct_time, end_turn
from motm_wbc.basenav.ring import FREE
from motm_wbc.basenav.search import COST, COSTS, DRIVEN, LENGTH, POSE, Places, search_back
from motm_wbc.basenav.visibility import push_out, sees
from motm_wbc.basenav.walls import TOUCH, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

PUSH = 2  # column of Approach.places


class Approach(NamedTuple):
    """What of the ways to some candidates does not depend on the robot.

    Attributes:
        walls: outlines of the free space.
        graph: their tangents, and those from the candidates to corners in sight.
        parts: (n,) which corners are connected (see `connected_parts`).
        poses: (m, 3) candidates, those at a place one after the other.
        wanted: (m,) 1 for a candidate whose time is asked for.
        places: (p, 3) x, y of the free point nearest to each place, distance to it [m].
        start: (p + 1,) first tangent of each place.
        corner: (t,) corner that each tangent leads to.
        ways: (t, 2, 2 + h) tangents to the candidates, as in `search.Places`, with what the
            place was pushed out.
    """

    walls: Walls
    graph: TangentGraph
    parts: Indices
    poses: Array
    wanted: Indices
    places: Array
    start: Indices
    corner: Indices
    ways: Array


@kernel
def prepare_approach(
    walls: Walls, graph: TangentGraph, poses: Array, rejections: Indices, each: int, speeds: Speeds
) -> Approach:
    """What the times to some candidates need.

    Args:
        walls: outlines of the free space.
        graph: their tangents.
        poses: (m, 3) candidates; a place inside what is blocked counts as its nearest free
            point, the distance being added.
        rejections: (m,) those that are not `FREE` are left out.
        each: candidates at a place.
        speeds: speeds of the base.
    """
    count = poses.shape[0] // each
    places, start = np.zeros((count, 3)), np.zeros(count + 1, dtype=np.int64)
    wanted = np.where(rejections == FREE, 1, 0)
    most = max(1, count * walls.corners.shape[0])
    chain, turn = np.empty(most, dtype=np.int64), np.empty(most)
    ways = np.empty((most, 2, COSTS + each))
    size = 0
    for k in range(count):
        first = each * k
        if wanted[first : first + each].any():
            push = push_out(walls, poses[first, X], poses[first, Y], places[k])
            places[k, PUSH] = push if TOUCH < push < math.inf else 0.0
            if places[k, PUSH] == 0.0:
                places[k, X], places[k, Y] = poses[first, X], poses[first, Y]
            seen = tangents_at(walls, places[k, X], places[k, Y], False)
            for t in range(seen.chain.size):
                chain[size], turn[size] = seen.chain[t], seen.turn[t]
                angle, length, added = seen.angle[t], seen.length[t], places[k, PUSH]
                _price_ways(ways[size], angle, length, added, poses, first, speeds)
                size += 1
        start[k + 1] = size
    joined = with_arrivals(graph, chain[:size], turn[:size])
    parts = connected_parts(graph, walls.corners.shape[0])
    corner, kept = chain[:size] // 2, ways[:size].copy()
    return Approach(walls, joined, parts, poses, wanted, places, start, corner, kept)


@kernel
def _price_ways(
    way: Array, angle: float, length: float, push: float, poses: Array, first: int, speeds: Speeds
) -> None:
    """Fill in a tangent's row of `Approach.ways`, given its direction [rad] and length [m]."""
    for gear in range(2):
        speed = speeds.backward if gear == BACKWARD else speeds.forward
        drive = length / speed + push / speeds.forward if speed > 0.0 else math.inf
        way[gear, POSE], way[gear, LENGTH] = first, length + push
        for i in range(way.shape[1] - COSTS):
            turned = end_turn(angle, poses[first + i, HEADING] + math.pi, gear)
            way[gear, COSTS + i] = drive + turned / speeds.turning


@kernel
def approach_times(
    approach: Approach, speeds: Speeds, x: float, y: float, heading: float
) -> tuple[Array, float, float]:
    """Times from a pose to all candidates that are asked for.

    Args:
        approach: of the candidates.
        speeds: speeds of the base.
        x: [m]; inside what is blocked the nearest free point counts.
        y: [m].
        heading: [rad].

    Returns:
        (m,) time [s], infinite if there is no path; the longest way driven in these times
        [m], or, where there is none, between the free points at its ends and back to them;
        distance from the pose to the nearest free point [m].
    """
    walls, poses = approach.walls, approach.poses
    times = np.full(poses.shape[0], math.inf)
    goals = np.empty((1, 3))
    goals[0, X], goals[0, Y], goals[0, HEADING] = x, y, heading + math.pi
    goals = free_goals(walls, goals, speeds.forward)
    push = goals[0, EXTRA] * speeds.forward
    hidden, longest = _straight_times(approach, speeds, goals, push, times)
    if hidden.size > 0:
        longest = max(longest, _times_round_corners(approach, speeds, goals, hidden, times) + push)
    for k in range(hidden.size):
        if times[hidden[k]] == math.inf:
            place = approach.places[hidden[k] // (poses.shape[0] // approach.places.shape[0])]
            apart = math.hypot(place[X] - x, place[Y] - y)
            longest = max(longest, apart + place[PUSH] + 2.0 * push)
    return times, longest, push


@kernel
def _times_round_corners(
    approach: Approach, speeds: Speeds, goals: Array, hidden: Indices, times: Array
) -> float:
    """Write the times to candidates out of sight; the longest way to one of them [m]."""
    walls = approach.walls
    tangents = goal_tangents(walls, goals, speeds)
    pending, box = _connected(approach, tangents.ends, hidden)
    longest = 0.0
    if pending.size > 0:
        labels = search_back(
            approach.graph,
            walls.corners,
            tangents,
            speeds,
            Places(approach.ways, pending, box),
            approach.poses.shape[0],
        )
        for k in range(pending.size):
            times[pending[k]] = labels.poses[pending[k], COST]
            longest = max(longest, labels.poses[pending[k], DRIVEN])
    return longest


@kernel
def _straight_times(
    approach: Approach, speeds: Speeds, goals: Array, push: float, times: Array
) -> tuple[Indices, float]:
    """Write the times to candidates in sight, than which nothing is faster.

    Returns:
        The candidates that are not in sight; the longest way to one that is [m].
    """
    walls, poses, places, wanted = approach.walls, approach.poses, approach.places, approach.wanted
    corners, links = walls.corners, walls.links
    ring_start, boxes = walls.ring_start, walls.ring_box
    gx, gy, toward = goals[0, X], goals[0, Y], goals[0, HEADING]
    each = poses.shape[0] // places.shape[0]
    hidden = np.empty(poses.shape[0], dtype=np.int64)
    count, longest = 0, 0.0
    for k in range(places.shape[0]):
        first = -1
        for i in range(each * k + each - 1, each * k - 1, -1):
            if wanted[i] == 1:
                first = i
        if first < 0:
            continue
        x, y = places[k, X], places[k, Y]
        seen = sees(corners, links, ring_start, boxes, x, y, gx, gy)
        added = places[k, PUSH] / speeds.forward + goals[0, EXTRA]
        for i in range(first, each * k + each):
            if wanted[i] == 0:
                continue
            if not seen:
                hidden[count] = i
                count += 1
                continue
            start = poses[i, HEADING] + math.pi
            for gear in range(2):
                time = direct_time(gx - x, gy - y, start, toward, speeds, gear)
                times[i] = min(times[i], time + added)
            longest = max(longest, math.hypot(gx - x, gy - y) + places[k, PUSH] + push)
    return hidden[:count], longest


@kernel
def _connected(approach: Approach, ends: Indices, hidden: Indices) -> tuple[Indices, Array]:
    """The hidden candidates that paths along some tangents can lead to, and the box about them.

    The others are unreachable; searching for them would go through all there is.
    """
    parts, places, start = approach.parts, approach.places, approach.start
    each = approach.poses.shape[0] // places.shape[0]
    met = np.zeros(parts.size, dtype=np.int64)
    for k in range(ends.shape[0]):
        met[parts[ends[k, 0] // 2]] = 1
    pending = np.empty(hidden.size, dtype=np.int64)
    box = np.array([math.inf, math.inf, -math.inf, -math.inf])
    count = 0
    for k in range(hidden.size):
        place = hidden[k] // each
        found = False
        for t in range(start[place], start[place + 1]):
            if met[parts[approach.corner[t]]] == 1:
                found = True
                break
        if found:
            pending[count] = hidden[k]
            count += 1
            box[0], box[1] = min(box[0], places[place, X]), min(box[1], places[place, Y])
            box[2], box[3] = max(box[2], places[place, X]), max(box[3], places[place, Y])
    return pending[:count], box
