"""Random maps of ten kinds, and places in them: many on edges, at corners, symmetric."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from benchmarks.exact.reference import Pose, Speeds
from benchmarks.exact.sight import Array, FreeSpace
from motm_wbc.basenav import Obstacle, World

Rng: TypeAlias = np.random.Generator
_MOST = 25
_AREA = 3.5  # [m^2] of floor for each obstacle


@dataclass(frozen=True)
class RandomMap:
    """A map of a kind.

    Attributes:
        kind: one of `KINDS`.
        obstacles: what the world is made of.
        boundary: (n, 2) [m] or None.
        inflation: radius of the disc [m].
        side: places lie within ± half of it [m].
    """

    kind: str
    obstacles: tuple[Obstacle, ...]
    boundary: Array | None
    inflation: float
    side: float

    @property
    def world(self) -> World:
        """The map as the planner's world."""
        return World(self.obstacles, self.boundary)


def make_map(kind: str, rng: Rng) -> RandomMap:
    """A random map with 1 to 25 obstacles."""
    count = int(rng.integers(1, _MOST + 1))
    side = max(4.0, math.sqrt(_AREA * count))
    obstacles = tuple(KINDS[kind](rng, count, side)[:_MOST])
    boundary = None
    if kind == "boundary" or rng.random() < 0.2:
        boundary = _room(rng, side) if rng.random() < 0.5 else _box(side + 0.5, side + 0.5)
    inflation = 0.0 if rng.random() < 0.5 else float(rng.uniform(0.05, 0.4))
    if kind == "axis-aligned" and inflation > 0.0:
        inflation = float(rng.choice([0.25, 0.5]))  # gaps are whole: outlines meet exactly
    return RandomMap(kind, obstacles, boundary, inflation, side)


def random_polygon(rng: Rng) -> Array:
    """A convex or a concave polygon about the origin, counter-clockwise (n, 2) [m]."""
    return _convex_shape(rng) if rng.random() < 0.5 else _concave_shape(rng)


def random_speeds(rng: Rng) -> Speeds:
    """Slow and quick turning, reverse or none."""
    reverse, turning = rng.choice([0.0, 0.2, 0.5]), rng.choice([0.5, 1.745, 20.0])
    return Speeds(0.5, float(reverse), float(turning))


def random_pose(rng: Rng, space: FreeSpace, side: float) -> Pose:
    """A free pose: anywhere, on whole coordinates, at a corner or on an edge."""
    sort = rng.random()
    while True:
        place = rng.uniform(-0.5 * side, 0.5 * side, 2)
        if sort < 0.2:
            place = np.round(2.0 * place) / 2.0
        elif sort < 0.3 and len(space.corners):
            place = space.corners[rng.integers(len(space.corners))]
        elif sort < 0.4 and len(space.edges):
            tail, head = space.edges[rng.integers(len(space.edges))]
            place = tail + rng.uniform(0.1, 0.9) * (head - tail)
        if not space.is_blocked(place[None])[0]:
            break
        sort = rng.random()
    heading = rng.uniform(-math.pi, math.pi)
    if rng.random() < 0.2:
        heading = 0.5 * math.pi * rng.integers(-2, 3)
    return float(place[0]), float(place[1]), None if rng.random() < 0.2 else float(heading)


def _box(length: float, width: float) -> Array:
    x, y = 0.5 * length, 0.5 * width
    return np.array([[x, y], [-x, y], [-x, -y], [x, -y]])


def _turned(points: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def _star(rng: Rng, corners: tuple[int, int], radius: tuple[float, float]) -> Array:
    """A polygon that is seen whole from the origin; one radius for all makes it convex."""
    count = int(rng.integers(*corners))
    angles = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * math.tau / count
    radii = rng.uniform(*radius, count)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


def _convex_shape(rng: Rng) -> Array:
    radius = rng.uniform(0.2, 0.8)
    return _star(rng, (3, 9), (radius, radius))


def _concave_shape(rng: Rng) -> Array:
    return _star(rng, (5, 10), (0.15, 1.0))


def _scattered(rng: Rng, count: int, side: float, shape: Callable[[Rng], Array]) -> list[Obstacle]:
    half = 0.5 * side
    return [Obstacle(shape(rng) + rng.uniform(-half, half, 2)) for _ in range(count)]


def _convex(rng: Rng, count: int, side: float) -> list[Obstacle]:
    return _scattered(rng, count, side, _convex_shape)


def _concave(rng: Rng, count: int, side: float) -> list[Obstacle]:
    return _scattered(rng, count, side, _concave_shape)


def _overlapping(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """As many on half of the floor."""
    return _scattered(rng, count, 0.7 * side, lambda rng: 1.3 * _star(rng, (3, 8), (0.3, 0.9)))


def _symmetric(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Mirror images about both axes, some across them."""
    found: list[Obstacle] = []
    while len(found) < count:
        shape = _convex_shape(rng)
        place = rng.uniform(0.0, 0.5 * side, 2) * rng.choice([0.0, 1.0, 1.0], 2)
        for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
            found.append(Obstacle((shape + place) * [x, y]))
    return found


def _axis_aligned(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Boxes and Ls on half-metre coordinates: they overlap, touch and line up."""
    found = []
    ell = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2]])
    for _ in range(count):
        place = np.round(rng.uniform(-side, side, 2)) / 2.0
        w, h = rng.integers(1, 4, 2)
        shape = ell if rng.random() < 0.3 else np.array([[0, 0], [w, 0], [w, h], [0, h]])
        found.append(Obstacle(0.5 * shape + place))
    return found


def _touching_at_corners(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """A chequered floor with squares left out, half of the maps turned."""
    cells = max(2, math.ceil(math.sqrt(2 * count)))
    black = [(i, j) for i in range(cells) for j in range(cells) if (i + j) % 2 == 0]
    taken = rng.permutation(len(black))[:count]
    size = side / cells
    angle = float(rng.choice([0.0, 0.3, rng.uniform(0.0, 1.5)]))
    middle = 0.5 * cells - 0.5
    return [
        Obstacle(_turned(_box(size, size) + size * (np.array(black[k]) - middle), angle))
        for k in taken
    ]


def _touching_along_edges(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Walls of bricks, each course shifted; half of the maps turned."""
    angle = float(rng.choice([0.0, 0.3, rng.uniform(0.0, 1.5)]))
    found: list[Obstacle] = []
    while len(found) < count:
        corner = rng.uniform(-0.5 * side, 0.5 * side, 2)
        length, height = rng.uniform(0.3, 0.8), rng.uniform(0.2, 0.4)
        for course in range(int(rng.integers(1, 4))):
            shift = float(rng.choice([0.0, 0.5, 0.3])) * length
            for brick in range(int(rng.integers(1, 4))):
                place = corner + [brick * length + shift, course * height]
                found.append(Obstacle(_turned(_box(length, height) + place, angle)))
    return found


def _holes(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Rings, some cut open by an overlapping notch, and full ones."""
    found = []
    for _ in range(count):
        place = rng.uniform(-0.5 * side, 0.5 * side, 2)
        outer = _star(rng, (5, 9), (0.9, 1.2))
        hole = _star(rng, (3, 7), (0.3, 0.6))
        cut = rng.random()
        if cut < 0.4:  # the hole reaches out of the obstacle: a bay
            hole = np.array([[0.0, -0.3], [2.0, -0.3], [2.0, 0.3], [0.0, 0.3]])
        holes = () if cut > 0.85 else (hole + place,)
        found.append(Obstacle(outer + place, holes))
    return found


def _nested(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Obstacles in obstacles and in their holes."""
    found: list[Obstacle] = []
    while len(found) < count:
        place = rng.uniform(-0.5 * side, 0.5 * side, 2)
        outer = _star(rng, (6, 10), (1.2, 1.6))
        middle = 0.75 * _star(rng, (6, 10), (1.2, 1.2))
        inner = _star(rng, (3, 7), (0.2, 0.5))
        hollow = rng.random() < 0.7
        found.append(Obstacle(outer + place, (middle + place,) if hollow else ()))
        found.append(Obstacle(inner + place))
    return found


def _boundary(rng: Rng, count: int, side: float) -> list[Obstacle]:
    """Obstacles in and across the edge of a room."""
    return _convex(rng, count // 2, side) + _concave(rng, count - count // 2, side)


def _room(rng: Rng, side: float) -> Array:
    """A concave boundary."""
    return 0.5 * side * _star(rng, (6, 12), (0.7, 1.4))


KINDS: dict[str, Callable[[Rng, int, float], list[Obstacle]]] = {
    "convex": _convex,
    "concave": _concave,
    "overlapping": _overlapping,
    "symmetric": _symmetric,
    "axis-aligned": _axis_aligned,
    "touching at corners": _touching_at_corners,
    "touching along edges": _touching_along_edges,
    "holes": _holes,
    "nested": _nested,
    "boundary": _boundary,
}
