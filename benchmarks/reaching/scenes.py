"""Random furniture within the arm's reach: tables, shelves, pillars, and things on them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.kinematics.rotations import planar_pose
from motm_wbc.qp import Body

_BASE_GAP = 0.03  # [m] that everything that stands lower than the base keeps off it
_FLOOR_SIZE = 6.0
_ATTEMPTS = 200


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A box that targets are drawn from.

    Attributes:
        kind: where it is: `table`, `shelf` or `air`.
        T_world_region: (4, 4) its centre and axes.
        half: (3,) half extents [m].
        approach: (3,) preferred direction of the tool's approach, world axes.
        tilt: largest angle from it [rad]; pi: any orientation.
    """

    kind: str
    T_world_region: Array
    half: Array
    approach: Array
    tilt: float


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What stands around the robot, whose base is at the origin.

    Attributes:
        seed: that it was made from.
        bodies: floor first, then furniture and things.
        regions: that targets are drawn from.
    """

    seed: int
    bodies: tuple[Body, ...]
    regions: tuple[Region, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """Furniture in its own frame: x away from the robot, origin at its near face."""

    bodies: list[Body]
    regions: list[Region]


def make_scene(model: RobotModel, seed: int) -> Scene:
    """A scene with a table, a shelf, one thing more, things on them and sometimes a lamp.

    Args:
        model: the robot, at the origin.
        seed: the same one gives the same scene.
    """
    rng = np.random.default_rng([seed, 0])
    kinds = ["table", "shelf", str(rng.choice(["table", "shelf", "pillars"]))]
    rng.shuffle(kinds)
    first = rng.uniform(-0.6, 0.6)
    bearings = [first, first + rng.uniform(1.2, 1.8), first - rng.uniform(1.2, 1.8)]
    bodies, regions = [_floor()], [_air(model)]
    for number, (kind, bearing) in enumerate(zip(kinds, bearings, strict=True)):
        piece = _stand(rng, model, kind, f"{kind}{number}", bearing)
        bodies += piece.bodies
        regions += piece.regions
    if rng.random() < 0.5:
        bodies.append(_lamp(rng, model))
    return Scene(seed, tuple(bodies), tuple(regions))


def _stand(
    rng: np.random.Generator, model: RobotModel, kind: str, name: str, bearing: float
) -> _Piece:
    """Furniture of some kind in a direction from the arm, clear of the base."""
    make = {"table": _table, "shelf": _shelf, "pillars": _pillars}[kind]
    base = Polygon(model.footprint).buffer(_BASE_GAP)
    for _ in range(_ATTEMPTS):
        angle = bearing + rng.uniform(-0.2, 0.2)
        away = rng.uniform(0.3, 0.65)
        near = model.arm_base_xy + away * np.array([math.cos(angle), math.sin(angle)])
        piece = _placed(make(rng, name), np.array([*near, angle + rng.uniform(-0.3, 0.3)]))
        low = [body for body in piece.bodies if body.bottom < model.base_height + _BASE_GAP]
        if not any(base.intersects(Polygon(_footprint(body))) for body in low):
            return piece
    raise AssertionError("no room beside the base")


def _placed(piece: _Piece, pose: Array) -> _Piece:
    """The piece, given in the frame of `pose` (3,), in the world."""
    T = planar_pose(pose)
    bodies = [replace(body, pose=se2.compose(pose, body.pose)) for body in piece.bodies]
    regions = [
        replace(
            region,
            T_world_region=T @ region.T_world_region,
            approach=T[:3, :3] @ region.approach,
        )
        for region in piece.regions
    ]
    return _Piece(bodies, regions)


def _footprint(body: Body) -> Array:
    outline = body.outlines[0] if body.radius is None else polygons.disc(body.radius)
    return polygons.place(outline, body.pose)


def _box(name: str, role: SolidRole, low: Array, high: Array, yaw: float = 0.0) -> Body:
    """A box from one corner to the other, turned about its centre."""
    centre = 0.5 * (low + high)
    outline = polygons.rectangle(float(high[0] - low[0]), float(high[1] - low[1]))
    return Body(
        name=name,
        role=role,
        outlines=(outline,),
        radius=None,
        bottom=float(low[2]),
        top=float(high[2]),
        pose=np.array([centre[0], centre[1], yaw]),
        velocity=np.zeros(3),
    )


def _cylinder(name: str, centre: Array, radius: float, bottom: float, height: float) -> Body:
    return Body(
        name=name,
        role=SolidRole.OBSTACLE,
        outlines=(),
        radius=radius,
        bottom=bottom,
        top=bottom + height,
        pose=np.array([centre[0], centre[1], 0.0]),
        velocity=np.zeros(3),
    )


def _region(kind: str, low: Array, high: Array, approach: Array, tilt: float) -> Region:
    T = np.eye(4)
    T[:3, 3] = 0.5 * (low + high)
    return Region(kind, T, 0.5 * (high - low), approach, tilt)


def _floor() -> Body:
    half = 0.5 * _FLOOR_SIZE
    return _box(
        "floor", SolidRole.OBSTACLE, np.array([-half, -half, -0.1]), np.array([half, half, 0.0])
    )


def _air(model: RobotModel) -> Region:
    """Anywhere about the shoulder, in any orientation."""
    centre = np.array([*model.arm_base_xy, 0.85])
    half = np.array([0.75, 0.75, 0.55])
    return _region("air", centre - half, centre + half, np.array([0.0, 0.0, -1.0]), math.pi)


def _lamp(rng: np.random.Generator, model: RobotModel) -> Body:
    """A box that hangs overhead."""
    half = 0.5 * rng.uniform(0.2, 0.4, 3)
    angle, away = rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 0.7)
    centre = np.array([*model.arm_base_xy, rng.uniform(1.3, 1.6) + half[2]])
    centre[:2] += away * np.array([math.cos(angle), math.sin(angle)])
    return _box("lamp", SolidRole.OBSTACLE, centre - half, centre + half, rng.uniform(0.0, 3.0))


def _thing(rng: np.random.Generator, name: str, low: Array, high: Array, tallest: float) -> Body:
    """A small box or bottle on a surface, inside the rectangle low .. high at height low[2]."""
    spot = rng.uniform(low[:2], high[:2])
    height = rng.uniform(0.05, tallest)
    if rng.random() < 0.4:
        return _cylinder(name, spot, rng.uniform(0.03, 0.06), float(low[2]), height)
    half = np.array([*(0.5 * rng.uniform(0.05, 0.15, 2)), 0.5 * height])
    centre = np.array([*spot, low[2] + half[2]])
    return _box(name, SolidRole.OBSTACLE, centre - half, centre + half, rng.uniform(0.0, 3.0))


def _table(rng: np.random.Generator, name: str) -> _Piece:
    depth, length = rng.uniform(0.45, 0.7), rng.uniform(0.6, 1.1)
    top, leg = rng.uniform(0.45, 0.85), 0.05
    low, high = np.array([0.0, -0.5 * length, top - 0.03]), np.array([depth, 0.5 * length, top])
    bodies = [_box(name, SolidRole.SUPPORT, low, high)]
    for i, x in enumerate((0.0, depth - leg)):
        for j, y in enumerate((-0.5 * length, 0.5 * length - leg)):
            foot, head = np.array([x, y, 0.0]), np.array([x + leg, y + leg, top - 0.03])
            bodies.append(_box(f"{name}_leg{i}{j}", SolidRole.OBSTACLE, foot, head))
    inner_low, inner_high = low + [0.08, 0.08, 0.03], high - [0.08, 0.08, 0.0]
    bodies += [
        _thing(rng, f"{name}_thing{k}", inner_low, inner_high, 0.3)
        for k in range(int(rng.integers(1, 5)))
    ]
    above = _region(
        "table",
        np.array([0.03, low[1] + 0.03, top + 0.03]),
        np.array([depth - 0.03, high[1] - 0.03, top + 0.25]),
        np.array([0.0, 0.0, -1.0]),
        0.6,
    )
    return _Piece(bodies, [above])


def _shelf(rng: np.random.Generator, name: str) -> _Piece:
    """Two compartments between three boards, two sides and a back; open to the robot."""
    depth, width = rng.uniform(0.25, 0.4), rng.uniform(0.5, 0.9)
    clear, first, board = rng.uniform(0.3, 0.45), rng.uniform(0.3, 0.6), 0.02
    half = 0.5 * width
    top = first + 2.0 * (clear + board) + board
    solid = SolidRole.OBSTACLE
    bodies = [
        _box(f"{name}_left", solid, np.array([0, half, 0]), np.array([depth, half + board, top])),
        _box(
            f"{name}_right", solid, np.array([0, -half - board, 0]), np.array([depth, -half, top])
        ),
        _box(
            f"{name}_back",
            solid,
            np.array([depth, -half - board, 0]),
            np.array([depth + board, half + board, top]),
        ),
    ]
    regions = []
    for k in range(3):
        bottom = first + k * (clear + board)
        low, high = np.array([0.0, -half, bottom]), np.array([depth, half, bottom + board])
        bodies.append(_box(f"{name}_board{k}", SolidRole.SUPPORT, low, high))
        if k == 2:
            continue
        floor = bottom + board
        if rng.random() < 0.6:
            low, high = np.array([0.1, 0.1 - half, floor]), np.array([depth - 0.08, half - 0.1, 0])
            bodies.append(_thing(rng, f"{name}_thing{k}", low, high, 0.5 * clear))
        low = np.array([-0.02, 0.08 - half, floor + 0.06])
        high = np.array([depth - 0.08, half - 0.08, floor + clear - 0.06])
        regions.append(_region("shelf", low, high, np.array([1.0, 0.0, 0.0]), 0.5))
    return _Piece(bodies, regions)


def _pillars(rng: np.random.Generator, name: str) -> _Piece:
    bodies = []
    for k in range(int(rng.integers(2, 4))):
        spot = np.array([rng.uniform(0.05, 0.4), rng.uniform(-0.4, 0.4)])
        width, height = rng.uniform(0.06, 0.2), rng.uniform(0.6, 1.4)
        if rng.random() < 0.5:
            bodies.append(_cylinder(f"{name}_{k}", spot, 0.5 * width, 0.0, height))
        else:
            half = np.array([0.5 * width, 0.5 * width, 0.5 * height])
            centre = np.array([*spot, 0.5 * height])
            yaw = rng.uniform(0.0, 3.0)
            bodies.append(
                _box(f"{name}_{k}", SolidRole.OBSTACLE, centre - half, centre + half, yaw)
            )
    return _Piece(bodies, [])
