"""Random worlds of seven kinds. Nothing in them is drawn by whether a planner succeeds there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from benchmarks.navigating import shapes
from motm_wbc.basenav import Disc, World
from motm_wbc.basenav.obstacle import ObstacleLike
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array

MOST = 40  # obstacles in a world
DOOR_ROOM = 0.2  # [m] by which a door is wider than the robot

Shape = Callable[[np.random.Generator], Array]


@dataclass(frozen=True)
class Floor:
    """A world with what goals are drawn by.

    Attributes:
        seed: it was drawn with.
        kind: see `KINDS`.
        world: obstacles and boundary.
        tables: outlines (n, 2) that a robot can be sent to with its nose [m].
        pockets: outlines (n, 2) of places that are hard to leave or to enter [m].
    """

    seed: int
    kind: str
    world: World
    tables: tuple[Array, ...]
    pockets: tuple[Array, ...]


@dataclass
class _Draft:
    """A floor in the making."""

    rng: np.random.Generator
    size: Array
    width: float
    obstacles: list[ObstacleLike]
    tables: list[Array]
    pockets: list[Array]

    def anywhere(self) -> Array:
        """(3,) random pose on the floor."""
        return np.array([*self.rng.uniform(0.0, 1.0, 2) * self.size, self.rng.uniform(0, math.tau)])

    def scatter(self, shape: Shape, count: int) -> None:
        """Put obstacles of a shape anywhere, at any angle."""
        for _ in range(count):
            self.obstacles.append(polygons.place(shape(self.rng), self.anywhere()))

    def put_table(self) -> None:
        """Put a table anywhere."""
        self.tables.append(polygons.place(shapes.table(self.rng), self.anywhere()))
        self.obstacles.append(self.tables[-1])


def make_floor(seed: int, width: float, attempt: int = 0) -> Floor:
    """A floor of 8 to 12 m by 8 to 12 m with 1 to 40 obstacles, a table among them.

    Args:
        seed: its number; the kinds take turns.
        width: of the robot [m]: doors and corridors are made for it.
        attempt: number of the draw, where an earlier floor was of no use.
    """
    rng = np.random.default_rng([seed, 71, attempt] if attempt else [seed, 71])
    kind = tuple(KINDS)[seed % len(KINDS)]
    draft = _Draft(rng, rng.uniform(8.0, 12.0, 2), width, [], [], [])
    draft.put_table()
    KINDS[kind](draft, int(rng.integers(0, MOST)))
    x, y = draft.size
    boundary = np.array([(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)])
    world = World(draft.obstacles, boundary)
    return Floor(seed, kind, world, tuple(draft.tables), tuple(draft.pockets))


def _convex(draft: _Draft, count: int) -> None:
    draft.scatter(shapes.convex, count)


def _concave(draft: _Draft, count: int) -> None:
    for _ in range(count):
        draft.scatter(shapes.star if draft.rng.random() < 0.5 else shapes.bracket, 1)


def _overlapping(draft: _Draft, count: int) -> None:
    """Heaps of polygons that overlap, and rows of rectangles that touch."""
    rng = draft.rng
    while count > 0:
        pieces = min(count, int(rng.integers(2, 5)))
        count -= pieces
        pose = draft.anywhere()
        if rng.random() < 0.5:
            for _ in range(pieces):
                shift = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(0, math.tau)])
                piece = polygons.place(shapes.convex(rng), shift)
                draft.obstacles.append(polygons.place(piece, pose))
            continue
        length, wide = rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.5)
        for k in range(pieces):
            piece = polygons.rectangle(length, wide) + [k * length, 0.0]
            draft.obstacles.append(polygons.place(piece, pose))


def _furniture(draft: _Draft, count: int) -> None:
    """Tables at right angles, chairs and posts."""
    rng = draft.rng
    turn = rng.uniform(0.0, math.tau)
    for _ in range(count):
        pose = draft.anywhere()
        if rng.random() < 0.4:
            pose[2] = turn + 0.5 * math.pi * rng.integers(0, 4)
            draft.tables.append(polygons.place(shapes.table(rng), pose))
            draft.obstacles.append(draft.tables[-1])
        else:
            draft.obstacles.append(Disc(pose[:2], rng.uniform(0.03, 0.25)))


def _doors(draft: _Draft, count: int) -> None:
    """One to three walls across the floor, each with one or two doors."""
    rng, size = draft.rng, draft.size
    walls = int(rng.integers(1, 4))
    across = int(rng.integers(0, 2))
    for place in (np.arange(walls) + rng.uniform(0.3, 0.7, walls)) / walls:
        start, end = np.zeros(2), np.zeros(2)
        start[across], end[across] = place * size[across] + rng.uniform(-0.8, 0.8, 2)
        end[1 - across] = size[1 - across]
        _wall_with_doors(draft, start, end, int(rng.integers(1, 3)))
    draft.scatter(shapes.convex, max(0, min(count, MOST - 1) - len(draft.obstacles)))


def _wall_with_doors(draft: _Draft, start: Array, end: Array, doors: int) -> None:
    length = math.dist(start, end)
    along = (end - start) / length
    half = 0.5 * (draft.width + DOOR_ROOM)
    begin = -0.2  # beyond the boundary
    for middle in (np.arange(doors) + draft.rng.uniform(0.2, 0.8, doors)) * length / doors:
        draft.obstacles.append(shapes.wall(start + begin * along, start + (middle - half) * along))
        begin = middle + half
    draft.obstacles.append(shapes.wall(start + begin * along, start + (length + 0.2) * along))


def _traps(draft: _Draft, count: int) -> None:
    """One to four Us, two to four times as wide as the robot, and other obstacles."""
    rng = draft.rng
    for _ in range(int(rng.integers(1, 5))):
        depth, wide = rng.uniform(0.8, 2.5), draft.width * rng.uniform(2.0, 4.0)
        pose = draft.anywhere()
        draft.obstacles.append(polygons.place(shapes.trap(depth, wide), pose))
        inner = polygons.rectangle(depth, wide) + [0.5 * depth, 0.0]
        draft.pockets.append(polygons.place(inner, pose))
    draft.scatter(shapes.convex, max(0, count // 2 - len(draft.obstacles)))


def _corridors(draft: _Draft, count: int) -> None:
    """A block across the floor with one or two corridors through it, straight or bent."""
    rng, size = draft.rng, draft.size
    low = rng.uniform(0.25, 0.4) * size[0]
    high = low + rng.uniform(1.5, 4.0)
    block = shapely.box(low, -0.2, high, size[1] + 0.2)
    for number in range(int(rng.integers(1, 3))):
        part = 0.5 * size[1]
        begin, end = rng.uniform(0.6, part - 0.6, 2) + number * part
        wide = draft.width + rng.uniform(DOOR_ROOM, 0.6)
        bend = rng.uniform(low + 0.5, high - 0.5)
        straight = [(low - 1.0, begin), (high + 1.0, begin)]
        bent = [(low - 1.0, begin), (bend, begin), (bend, end), (high + 1.0, end)]
        line = shapely.LineString(straight if rng.random() < 0.4 else bent)
        corridor = shapely.buffer(line, 0.5 * wide, join_style="mitre")
        block = shapely.difference(block, corridor)
        inner = shapely.intersection(corridor, shapely.box(low, 0.0, high, size[1]))
        draft.pockets.append(np.array(inner.exterior.coords)[:-1])
    for piece in shapely.get_parts(block):
        draft.obstacles.append(np.array(piece.exterior.coords)[:-1])
    draft.scatter(shapes.convex, max(0, count // 2 - len(draft.obstacles)))


KINDS: dict[str, Callable[[_Draft, int], None]] = {
    "convex": _convex,
    "concave": _concave,
    "overlapping": _overlapping,
    "doors": _doors,
    "traps": _traps,
    "corridors": _corridors,
    "furniture": _furniture,
}
