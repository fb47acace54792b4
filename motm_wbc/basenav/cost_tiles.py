"""The exact cost-to-go of a goal, asked for at thousands of poses that lie near each other.

`cost_to_go` looks at every corner of the world. What it can come to within a small tile is
little: few corners can be wrapped from there, and most of these are hidden. So each tile is
prepared when it is first asked for: its *ways*, tangents to a corner in one gear, in the
order of their least time from anywhere in the tile, without those that are certainly hidden,
each with the outlines that may hide it. A query goes through them until the least time of the
next is no better than what it has; all that decides is computed for the pose itself. So the
answer is that of `cost_to_go`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.goal_field import EXTRA, GoalField, by_chain, cost_to_go, known_time
from motm_wbc.basenav.graph import chain_turn
from motm_wbc.basenav.pathrtr import BACKWARD, FORWARD, direct_time, turn_between
from motm_wbc.basenav.tile_ways import (
    HIDDEN,
    WayList,
    find_ways,
    hiding_rings,
    rings_at,
)
from motm_wbc.basenav.visibility import push_out, sees, tangent_side
from motm_wbc.basenav.walls import TOUCH, TURN, Indices, Walls, X, Y
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel, lean

_SIDE = 0.5  # [m]
_HALF_DIAGONAL = _SIDE * math.sqrt(0.5) + 1e-6  # [m]
_MOST = 40  # ways kept of a tile; a query that needs more asks `cost_to_go`
_RINGS_A_TILE = 128  # room for numbers of outlines, on average
_ROUNDING = 1e-9  # [s]

# columns of CostTiles.heads
_STATE, _HERE, _HERE_END, _GOAL, _GOAL_END, _WAYS, _WAYS_END = range(7)
_NEW, _READY, _FULL = range(3)
# columns of CostTiles.codes
_CHAIN, _GEAR, _FIRST, _END = range(4)
# columns of CostTiles.ways
_LEAST, _ANGLE, _SPREAD = range(3)
# entries of CostTiles.used
_USED_WAYS, _USED_RINGS = range(2)


class CostTiles(NamedTuple):
    """A square of tiles over a `GoalField` of one goal.

    Attributes:
        field: cost-to-go.
        x0: left edge of the square [m].
        y0: lower edge [m].
        across: tiles along each side.
        heads: (across^2, 7) state of each tile; where its outlines, those before the goal, and
            its ways begin and end.
        beyond: (across^2,) least time of the ways that were left out [s].
        ways: (w, 3) least time from the tile [s]; direction from its centre and how far it
            may be off that [rad].
        codes: (w, 4) chain, gear, the outlines that may hide it.
        rings: (k,) numbers of outlines.
        convex: (r,) 1 for outlines that only turn left.
        used: (2,) how many ways and rings are filed.
        place: (2,) where a query that is pushed out has its point.
    """

    field: GoalField
    x0: float
    y0: float
    across: int
    heads: Indices
    beyond: Array
    ways: Array
    codes: Indices
    rings: Indices
    convex: Indices
    used: Indices
    place: Array


def cost_tiles(field: GoalField, centre: tuple[float, float], half: float) -> CostTiles:
    """Tiles that are yet to be prepared.

    Args:
        field: of one goal.
        centre: of the square [m].
        half: half its side [m]; beyond it `cost_to_go` answers.
    """
    count = 2 * math.ceil(half / _SIDE) + 1
    x0, y0 = (_SIDE * math.floor(value / _SIDE - 0.5 * count) for value in centre)
    tiles = count * count
    return CostTiles(
        field,
        float(x0),
        float(y0),
        count,
        np.zeros((tiles, 7), dtype=np.int64),
        np.empty(tiles),
        np.empty((tiles * _MOST, 3)),
        np.empty((tiles * _MOST, 4), dtype=np.int64),
        np.empty(tiles * _RINGS_A_TILE, dtype=np.int64),
        _convex_rings(field.walls),
        np.zeros(2, dtype=np.int64),
        np.zeros(2),
    )


@kernel
def _convex_rings(walls: Walls) -> Indices:
    convex = np.ones(walls.ring_box.shape[0], dtype=np.int64)
    for ring in range(convex.size):
        for corner in range(walls.ring_start[ring], walls.ring_start[ring + 1]):
            if walls.corners[corner, TURN] <= 0.0:
                convex[ring] = 0
    return convex


@kernel
def _prepare(tiles: CostTiles, index: int) -> None:
    """File what a tile's poses need."""
    field, head, used = tiles.field, tiles.heads[index], tiles.used
    cx = tiles.x0 + (index % tiles.across + 0.5) * _SIDE
    cy = tiles.y0 + (index // tiles.across + 0.5) * _SIDE
    most = field.walls.ring_box.shape[0]
    if used[_USED_RINGS] + 2 * most > tiles.rings.size:
        head[_STATE] = _FULL
        return
    head[_STATE] = _READY
    head[_HERE] = used[_USED_RINGS]
    used[_USED_RINGS] = rings_at(field.walls, cx, cy, 0.5 * _SIDE, tiles.rings, head[_HERE])
    head[_HERE_END] = head[_GOAL] = used[_USED_RINGS]
    goal = field.goals[0]
    end = hiding_rings(
        field.walls, tiles.convex, cx, cy, _HALF_DIAGONAL, goal[X], goal[Y], -1,
        tiles.rings, head[_GOAL],
    )  # fmt: skip
    head[_GOAL_END] = end
    used[_USED_RINGS] = max(end, head[_GOAL])
    _file_ways(tiles, head, index, find_ways(field, cx, cy, _HALF_DIAGONAL), cx, cy)


@kernel
def _file_ways(
    tiles: CostTiles, head: Indices, index: int, found: WayList, cx: float, cy: float
) -> None:
    """Keep the best of the ways that may be in sight from the tile."""
    used, walls = tiles.used, tiles.field.walls
    most = walls.ring_box.shape[0]
    head[_WAYS] = used[_USED_WAYS]
    tiles.beyond[index] = math.inf
    order = np.argsort(found.least)
    for k in order:
        least, first = found.least[k], used[_USED_RINGS]
        if used[_USED_WAYS] == head[_WAYS] + _MOST or first + most > tiles.rings.size:
            tiles.beyond[index] = least
            break
        corner = found.chain[k] // 2
        end = hiding_rings(
            walls, tiles.convex, cx, cy, _HALF_DIAGONAL,
            walls.corners[corner, X], walls.corners[corner, Y], corner, tiles.rings, first,
        )  # fmt: skip
        if end == HIDDEN:
            continue
        way, code = tiles.ways[used[_USED_WAYS]], tiles.codes[used[_USED_WAYS]]
        way[_LEAST], way[_ANGLE], way[_SPREAD] = least, found.angle[k], found.spread[k]
        code[_CHAIN], code[_GEAR], code[_FIRST], code[_END] = (
            found.chain[k],
            found.gear[k],
            first,
            end,
        )
        used[_USED_WAYS] += 1
        used[_USED_RINGS] = end
    head[_WAYS_END] = used[_USED_WAYS]


@lean
def _in_sight(
    tiles: CostTiles, first: int, end: int, x: float, y: float, tx: float, ty: float
) -> bool:
    """Whether none of the filed outlines [first, end) hides a place."""
    walls = tiles.field.walls
    for k in range(first, end):
        ring = tiles.rings[k]
        start, box = walls.ring_start[ring : ring + 2], walls.ring_box[ring : ring + 1]
        if not sees(walls.corners, walls.links, start, box, x, y, tx, ty):
            return False
    return True


@lean
def _is_inside(tiles: CostTiles, head: Indices, x: float, y: float) -> bool:
    """`is_blocked` by the outlines that meet the tile: the others leave its places as they are."""
    walls = tiles.field.walls
    corners = walls.corners
    inside = walls.bounded > 0.0
    for k in range(head[_HERE], head[_HERE_END]):
        ring = tiles.rings[k]
        low_x, low_y, high_x, high_y = walls.ring_box[ring]
        if not (low_x <= x <= high_x and low_y <= y <= high_y):
            continue
        end = walls.ring_start[ring + 1]
        a = end - 1
        for b in range(walls.ring_start[ring], end):
            ay, by = corners[a, Y], corners[b, Y]
            if (ay > y) != (by > y):
                crossing = corners[a, X] + (y - ay) * (corners[b, X] - corners[a, X]) / (by - ay)
                if x < crossing:
                    inside = not inside
            a = b
    return inside


@lean
def _time_by(tiles: CostTiles, code: Indices, x: float, y: float, heading: float) -> float:
    """Time of a way from a pose [s]; infinite if its corner can't be wrapped from there."""
    field = tiles.field
    corners, speeds = field.walls.corners, field.speeds
    chain, gear = code[_CHAIN], code[_GEAR]
    dx, dy = corners[chain // 2, X] - x, corners[chain // 2, Y] - y
    length = math.sqrt(dx * dx + dy * dy)
    if length <= TOUCH:
        return math.inf
    side = tangent_side(corners, field.walls.links, chain // 2, dx / length, dy / length)
    if side != chain % 2:
        return math.inf
    angle = math.atan2(dy, dx)
    turned = turn_between(angle, heading)
    if gear == BACKWARD:
        turned = math.pi - turned
    turn = chain_turn(corners, chain // 2, side, angle)
    onward = by_chain(
        field.chain_start, field.exit_turn, field.exit_cost, chain, turn, gear, speeds.turning
    )
    speed = speeds.backward if gear == BACKWARD else speeds.forward
    return float(onward + turned / speeds.turning + length / speed)


@lean
def _free_time(tiles: CostTiles, index: int, x: float, y: float, heading: float) -> float:
    """Cost-to-go of a pose in free space, in this tile [s]."""
    field, head = tiles.field, tiles.heads[index]
    goal, speeds, corners = field.goals[0], field.speeds, field.walls.corners
    if head[_GOAL_END] != HIDDEN and _in_sight(
        tiles, head[_GOAL], head[_GOAL_END], x, y, goal[X], goal[Y]
    ):
        dx, dy = goal[X] - x, goal[Y] - y
        ahead = direct_time(dx, dy, heading, goal[2], speeds, FORWARD)
        back = direct_time(dx, dy, heading, goal[2], speeds, BACKWARD)
        return float(min(ahead, back) + goal[EXTRA])
    best = math.inf
    for k in range(head[_WAYS], head[_WAYS_END]):
        way, code = tiles.ways[k], tiles.codes[k]
        if way[_LEAST] >= best:
            return best
        turned = turn_between(way[_ANGLE], heading)
        if code[_GEAR] == BACKWARD:
            turned = math.pi - turned
        if way[_LEAST] + max(turned - way[_SPREAD], 0.0) / speeds.turning >= best:
            continue
        time = _time_by(tiles, code, x, y, heading)
        corner = code[_CHAIN] // 2
        if time < best and _in_sight(
            tiles, code[_FIRST], code[_END], x, y, corners[corner, X], corners[corner, Y]
        ):
            best = time
    if best <= tiles.beyond[index] - _ROUNDING:
        return best
    return cost_to_go(field, x, y, heading)


@lean
def _tile_of(tiles: CostTiles, x: float, y: float) -> int:
    """The tile that a place lies in, prepared; -1 if there is none."""
    column, row = math.floor((x - tiles.x0) / _SIDE), math.floor((y - tiles.y0) / _SIDE)
    if column < 0 or row < 0 or column >= tiles.across or row >= tiles.across:
        return -1
    index = int(row * tiles.across + column)
    if tiles.heads[index, _STATE] == _NEW:
        _prepare(tiles, index)
    return index if tiles.heads[index, _STATE] == _READY else -1


@lean
def tiled_cost_to_go(tiles: CostTiles, x: float, y: float, heading: float) -> float:
    """`cost_to_go` of the tiles' field; `heading` must be a number.

    Args:
        tiles: of the goal; a tile is prepared when it is first met.
        x: [m].
        y: [m].
        heading: [rad].

    Returns:
        Time [s]; infinite if there is no path.
    """
    index = _tile_of(tiles, x, y)
    if index < 0:
        return cost_to_go(tiles.field, x, y, heading)
    if not _is_inside(tiles, tiles.heads[index], x, y):
        return _free_time(tiles, index, x, y, heading)
    place = tiles.place
    push = push_out(tiles.field.walls, x, y, place)
    entered = _tile_of(tiles, place[0], place[1])
    if TOUCH < push < math.inf and entered >= 0:
        time = push / tiles.field.speeds.forward
        time += _free_time(tiles, entered, place[0], place[1], heading)
        if time < math.inf and time <= known_time(tiles.field, x, y):
            return time
    return cost_to_go(tiles.field, x, y, heading)  # it has to enter elsewhere
