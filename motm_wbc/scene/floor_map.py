"""A map of a floor as plain data, and its readers by file name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array

Unknown: TypeAlias = Literal["blocked", "free"]
_GEOJSON = (".geojson", ".json")
_ROS = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class MapArea:
    """A polygon that blocks the floor.

    Attributes:
        where: its place in the file, for messages.
        outline: (n, 2) [m].
        holes: (n, 2) each [m].
        velocity: (vx, vy) [m/s].
    """

    where: str
    outline: Array
    holes: tuple[Array, ...] = ()
    velocity: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MapDisc:
    """A disc that blocks the floor.

    Attributes:
        where: its place in the file, for messages.
        centre: (x, y) [m].
        radius: [m].
        velocity: (vx, vy) [m/s].
    """

    where: str
    centre: tuple[float, float]
    radius: float
    velocity: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class FloorMap:
    """What a map file says.

    Attributes:
        things: what blocks the floor.
        boundary: (n, 2) outline of the floor [m], or None.
    """

    things: tuple[MapArea | MapDisc, ...]
    boundary: Array | None


def load_floor_map(path: str | Path, unknown: Unknown = "blocked") -> FloorMap:
    """Read a map: GeoJSON in metres (`.geojson`, `.json`), or a ROS map's `.yaml`.

    Args:
        path: of the file.
        unknown: what unknown cells of a ROS map count as.

    Raises:
        InputError: the file can't be used; says where.
    """
    from motm_wbc.scene.geojson import read_geojson
    from motm_wbc.scene.ros_map import read_ros_map

    file = Path(path)
    if file.suffix.lower() in _GEOJSON:
        return read_geojson(file)
    if file.suffix.lower() in _ROS:
        return read_ros_map(file, unknown)
    hint = "; give the .yaml beside it" if file.suffix.lower() in (".pgm", ".png") else ""
    legal = ", ".join((*_GEOJSON, *_ROS))
    raise InputError(f"is no map; legal endings: {legal}{hint}", str(file))
