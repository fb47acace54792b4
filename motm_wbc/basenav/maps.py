"""Worlds from map files."""

from __future__ import annotations

from pathlib import Path

from motm_wbc.basenav.obstacle import Disc, Obstacle, ObstacleLike, solids_of
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.scene.floor_map import FloorMap, MapArea, MapDisc, Unknown, load_floor_map


def load_world(path: str | Path, unknown: Unknown = "blocked") -> World:
    """The world of a map file: GeoJSON in metres, or the `.yaml` of a ROS map.

    Args:
        path: of the file.
        unknown: what unknown cells of a ROS map count as, `blocked` or `free`.

    Raises:
        InputError: the file can't be used; says where.
    """
    floor = load_floor_map(path, unknown)
    try:
        return world_of(floor)
    except InputError as error:
        where = error.where if error.where.startswith(str(path)) else f"{path}: {error.where}"
        raise InputError(error.what, where) from None


def world_of(floor: FloorMap) -> World:
    """The world that a map describes.

    Raises:
        InputError: a polygon can't be used; see `World`.
    """
    solids = [
        solid
        for index, thing in enumerate(floor.things)
        for solid in solids_of(_obstacle(thing), index, thing.where)
    ]
    return World((), floor.boundary).with_solids(solids)


def _obstacle(thing: MapArea | MapDisc) -> ObstacleLike:
    if isinstance(thing, MapDisc):
        return Disc(thing.centre, thing.radius, thing.velocity)
    return Obstacle(thing.outline, thing.holes, thing.velocity)
