"""Obstacles that move, predicted at constant velocity, against the base's outline."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from motm_wbc.basenav.footprint_check import Outline, enters, squared_distance
from motm_wbc.basenav.obstacle import Solid
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import lean

NEARBY = 1.0
"""Distance from a moving obstacle at which its cost has fallen to 0 [m] (STAA*)."""


class Movers(NamedTuple):
    """Moving solids, one after the other, as they are now.

    Attributes:
        edges: (k, 4) x1, y1, x2, y2 [m].
        starts: (m + 1,) first edge of each solid.
        discs: (m, 3) centre and radius of a circle about each [m].
        velocities: (m, 2) [m/s].
        fastest: the largest speed [m/s].
    """

    edges: Array
    starts: Indices
    discs: Array
    velocities: Array
    fastest: float


def movers_of(solids: Iterable[Solid]) -> Movers:
    """Pack those solids that move."""
    moving = [solid for solid in solids if solid.moves]
    edges, starts, discs = [np.zeros((0, 4))], [0], np.zeros((len(moving), 3))
    for row, solid in zip(discs, moving, strict=True):
        edges += [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in solid.rings]
        starts.append(starts[-1] + sum(len(ring) for ring in solid.rings))
        centre = 0.5 * (solid.outline.min(axis=0) + solid.outline.max(axis=0))
        offsets = solid.outline - centre
        row[:2], row[2] = centre, np.hypot(offsets[:, 0], offsets[:, 1]).max()
    velocities = np.array([solid.velocity for solid in moving], dtype=float).reshape(-1, 2)
    fastest = float(np.hypot(velocities[:, 0], velocities[:, 1]).max(initial=0.0))
    return Movers(np.vstack(edges), np.array(starts, np.int64), discs, velocities, fastest)


@lean
def meets_mover(
    movers: Movers,
    outline: Outline,
    margin: float,
    x: float,
    y: float,
    c: float,
    s: float,
    time: float,
) -> bool:
    """Whether the base at (x, y), heading (c, s), overlaps a moving obstacle at `time` [s].

    Touching is free. `margin` [m] moves the outline's sides outward.
    """
    for m in range(movers.discs.shape[0]):
        px, py = x - movers.velocities[m, 0] * time, y - movers.velocities[m, 1] * time
        wx, wy = movers.discs[m, 0] - px, movers.discs[m, 1] - py
        reach = movers.discs[m, 2] + outline.radius + margin
        if wx * wx + wy * wy >= reach * reach:
            continue
        inside = False
        for e in range(movers.starts[m], movers.starts[m + 1]):
            ax, ay = movers.edges[e, 0] - px, movers.edges[e, 1] - py
            bx, by = movers.edges[e, 2] - px, movers.edges[e, 3] - py
            if enters(
                outline, margin, c * ax + s * ay, c * ay - s * ax, c * bx + s * by, c * by - s * bx
            ):
                return True
            if (ay > 0.0) != (by > 0.0) and ax - ay * (bx - ax) / (by - ay) > 0.0:
                inside = not inside
        if inside:
            return True
    return False


@lean
def half_way(movers: Movers, outline: Outline, way: float, turn: float, time: float) -> float:
    """Half the distance by which base and obstacles can come nearer in between two checks [m].

    With a margin that is larger by it, nothing slips through. The base has driven `way` [m]
    and turned by `turn` [rad] in `time` [s].
    """
    return 0.5 * (abs(way) + abs(turn) * outline.radius + movers.fastest * time)


@lean
def nearness_of_movers(movers: Movers, outline: Outline, x: float, y: float, time: float) -> float:
    """max(0, 1 - distance to moving obstacles [m] at `time`), of a free base at (x, y) (STAA*).

    The distance is that of the circle within the outline.
    """
    least = NEARBY
    for m in range(movers.discs.shape[0]):
        px, py = x - movers.velocities[m, 0] * time, y - movers.velocities[m, 1] * time
        wx, wy = movers.discs[m, 0] - px, movers.discs[m, 1] - py
        reach = movers.discs[m, 2] + outline.inner + least
        if wx * wx + wy * wy >= reach * reach:
            continue
        square = math.inf
        for e in range(movers.starts[m], movers.starts[m + 1]):
            x1, y1, x2, y2 = movers.edges[e]
            square = min(square, squared_distance(px, py, x1, y1, x2, y2))
        least = min(least, max(math.sqrt(square) - outline.inner, 0.0))
    return NEARBY - least
