"""Random starts and goals that brute force gets from one to the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.navigating.lattice import Lattice
from benchmarks.navigating.worlds import Floor
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.geometry.arrays import Array

DISTANCE, ANGLE = 0.10, 0.35  # [m], [rad] at which a goal counts as reached
_DRAWS = 5000
_POCKET_SHARE = 0.3  # of the starts and goals, where there are pockets
_NOSE_GAP = (0.05, 0.10)  # [m]


@dataclass(frozen=True)
class Task:
    """Where to start, and goals to be reached one after the other.

    Attributes:
        index: its number on the floor.
        start: (3,) pose at rest.
        goals: one, or one nose to a table and one elsewhere.
    """

    index: int
    start: Array
    goals: tuple[Goal, ...]


def draw_task(
    floor: Floor, lattice: Lattice, footprint: Array, index: int, *, nose: bool = False
) -> Task | None:
    """A task, uniformly from all that are free and that the lattice gets to; None: no draw is.

    Starts are nodes of the lattice. A goal counts if the base is free there and a node within
    its tolerances can be reached.

    Args:
        floor: where to.
        lattice: of its obstacles at rest.
        footprint: (n, 2) of the base [m].
        index: number of the task; even ones come to rest, odd ones drive through.
        nose: stop nose to a table, and go elsewhere afterwards.
    """
    rng = np.random.default_rng([floor.seed, index, 72])
    for _ in range(_DRAWS):
        pose = _anywhere(rng, floor)
        label = lattice.label(pose)
        if label < 0:
            continue
        goal = _nose(rng, floor, footprint) if nose else _anywhere(rng, floor)
        if not _counts(lattice, goal, label):
            continue
        goals = [Goal(goal, stop=nose or index % 2 == 0)]
        if nose:
            after = _anywhere(rng, floor)
            if not _counts(lattice, after, label):
                continue
            goals.append(Goal(after, stop=bool(rng.random() < 0.5)))
        return Task(index, lattice.pose(lattice.node(pose)), tuple(goals))
    return None


def _counts(lattice: Lattice, goal: Array, label: int) -> bool:
    if not lattice.is_free(goal):
        return False
    return lattice.node_within(goal, DISTANCE, ANGLE, label) is not None


def _anywhere(rng: np.random.Generator, floor: Floor) -> Array:
    low, high = np.zeros(2), np.max(np.asarray(floor.world.boundary), axis=0)
    if floor.pockets and rng.random() < _POCKET_SHARE:
        pocket = floor.pockets[rng.integers(len(floor.pockets))]
        low, high = pocket.min(axis=0), pocket.max(axis=0)
    return np.array([*rng.uniform(low, high), rng.uniform(-math.pi, math.pi)])


def _nose(rng: np.random.Generator, floor: Floor, footprint: Array) -> Array:
    """Front of the base 5 to 10 cm from a table's edge, facing it."""
    outline = floor.tables[rng.integers(len(floor.tables))]
    corner = int(rng.integers(len(outline)))
    a, b = outline[corner], outline[(corner + 1) % len(outline)]
    inward = np.array([a[1] - b[1], b[0] - a[0]]) / math.dist(a, b)
    away = float(footprint[:, 0].max()) + rng.uniform(*_NOSE_GAP)
    at = a + rng.uniform(0.1, 0.9) * (b - a) - away * inward
    return np.array([*at, math.atan2(inward[1], inward[0])])
