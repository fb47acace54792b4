"""Euclidean shortest paths: the planner with turning for nothing against extremitypathfinder.

That library takes disjoint holes in a simple boundary, so the maps here are of that sort.
"""

from __future__ import annotations

import json
import math
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import Polygon

from benchmarks.exact.maps import random_polygon
from benchmarks.exact.sight import Array
from motm_wbc.basenav import GlobalPlanner, World

Place: TypeAlias = tuple[float, float]
_OMEGA = 1e12  # [rad/s]
_HALF = 5.0  # [m] of the room
_GAP = 0.02  # [m] between obstacles
_WORKER = Path(__file__).with_name("worker_extremity.py")


@dataclass(frozen=True)
class Room:
    """Disjoint obstacles in a box, and free places to go between.

    Attributes:
        boundary: (4, 2) counter-clockwise [m].
        obstacles: counter-clockwise outlines [m].
        queries: pairs of places [m].
    """

    boundary: Array
    obstacles: tuple[Array, ...]
    queries: tuple[tuple[Place, Place], ...]


def make_room(rng: np.random.Generator, queries: int) -> Room:
    """A random room with 1 to 25 obstacles."""
    obstacles: list[Array] = []
    taken = Polygon()
    for _ in range(int(rng.integers(1, 26))):
        points = random_polygon(rng) + rng.uniform(1.2 - _HALF, _HALF - 1.2, 2)
        if Polygon(points).distance(taken) > _GAP or not obstacles:
            obstacles.append(points)
            taken = shapely.union_all([taken, Polygon(points)])
    places: list[Place] = []
    while len(places) < 2 * queries:
        x, y = rng.uniform(-_HALF, _HALF, 2).tolist()
        if not shapely.intersects_xy(taken, x, y):
            places.append((x, y))
    box = _HALF * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    return Room(box, tuple(obstacles), tuple(zip(places[::2], places[1::2], strict=True)))


def our_lengths(room: Room) -> list[float]:
    """Lengths of the planner's paths [m]."""
    planner = GlobalPlanner(World(room.obstacles, room.boundary), 0.5, _OMEGA)
    return [planner.plan((*p, None), (*q, None)).length for p, q in room.queries]


def their_lengths(rooms: list[Room], environment: Path) -> list[list[float]]:
    """Lengths of extremitypathfinder's [m], infinite where it finds none."""
    asked = [
        {
            "boundary": room.boundary.tolist(),
            "holes": [points[::-1].tolist() for points in room.obstacles],
            "queries": room.queries,
        }
        for room in rooms
    ]
    done = subprocess.run(
        [environment / "bin" / "python", _WORKER],
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        check=True,
    )
    answers: list[list[float | None]] = json.loads(done.stdout)
    return [[math.inf if one is None else one for one in lengths] for lengths in answers]


def worst_difference(environment: Path, queries: int) -> float:
    """Largest difference of two lengths [m] in random rooms with ten queries each."""
    rng = np.random.default_rng(0)
    rooms = [make_room(rng, 10) for _ in range(math.ceil(queries / 10))]
    ours = np.array([our_lengths(room) for room in rooms])
    theirs = np.array(their_lengths(rooms, environment))
    return float(np.abs(ours - theirs).max())
