"""Maps as GeoJSON (RFC 7946), but in metres on a floor instead of degrees on the globe.

A Polygon or MultiPolygon blocks the floor; so does a Point with the property `radius` [m].
The property `velocity`, [vx, vy] [m/s], lets it move; one Polygon with the property
`boundary`: true is the floor itself, and its holes block. Other properties say nothing here.
A byte order mark at the file's beginning, as some programs write it, is skipped.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TypeAlias, TypeGuard

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.files import read_text
from motm_wbc.scene.floor_map import FloorMap, MapArea, MapDisc

Json: TypeAlias = Mapping[str, object]
_DEGREES = ("crs84", "4326", "4979")
_SMALLEST = 0.05  # [m]: whole maps of that size are degrees
_FASTEST = 100.0  # [m/s]: what is said to move faster is an error; predicting it would not end


def read_geojson(path: Path) -> FloorMap:
    """Read a file.

    Raises:
        InputError: it is missing, no GeoJSON, has nothing that blocks, or is in degrees.
    """
    try:
        content = json.loads(read_text(path).removeprefix("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not valid JSON: {error}", str(path)) from None
    if not _is_object(content):
        raise InputError("must be a GeoJSON object", str(path))
    _check_crs(content, str(path))
    things: list[MapArea | MapDisc] = []
    boundary: Array | None = None
    for where, geometry, properties in _features(content, str(path)):
        found = list(_things(where, geometry, properties))
        if _says_boundary(where, properties):
            if boundary is not None:
                raise InputError("is a second boundary; one is legal", where)
            boundary, inside = _as_boundary(where, found)
            things += inside
        else:
            things += found
    if not things and boundary is None:
        raise InputError("has no polygon, no point with a radius and no boundary", str(path))
    _check_size(things, boundary, str(path))
    return FloorMap(tuple(things), boundary)


def _features(content: Json, path: str) -> Iterator[tuple[str, Json, Json]]:
    """Place, geometry and properties of each feature; those without a geometry are left out."""
    kind = content.get("type")
    if kind == "FeatureCollection":
        features = content.get("features")
        if not isinstance(features, list):
            raise InputError("must be a list", f"{path}: features")
        named = [(f"{path}: features[{index}]", one) for index, one in enumerate(features)]
    elif kind == "Feature":
        named = [(path, content)]
    else:
        named = [(path, {"type": "Feature", "geometry": content, "properties": {}})]
    for where, feature in named:
        if not _is_object(feature) or feature.get("type") != "Feature":
            raise InputError("must be an object of type Feature", where)
        geometry, properties = feature.get("geometry"), feature.get("properties")
        if geometry is None:
            continue
        if not _is_object(geometry):
            raise InputError("must be an object or null", f"{where}.geometry")
        if not (properties is None or _is_object(properties)):
            raise InputError("must be an object or null", f"{where}.properties")
        yield where, geometry, properties or {}


def _things(where: str, geometry: Json, properties: Json) -> Iterator[MapArea | MapDisc]:
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    velocity = _velocity(properties.get("velocity", [0.0, 0.0]), f"{where}.velocity")
    if kind == "Polygon":
        yield _area(where, coordinates, velocity)
    elif kind == "MultiPolygon":
        if not isinstance(coordinates, list):
            raise InputError("must be a list of polygons", f"{where}.coordinates")
        for index, one in enumerate(coordinates):
            yield _area(f"{where}.coordinates[{index}]", one, velocity)
    elif kind == "Point" and "radius" in properties:
        radius = properties["radius"]
        if not (_is_number(radius) and radius > 0.0):
            raise InputError("must be a number > 0 [m]", f"{where}.radius")
        (x, y), *_ = _positions([coordinates], where).tolist()
        yield MapDisc(where, (x, y), float(radius), velocity)
    else:
        hint = " without a radius" if kind == "Point" else ""
        legal = "Polygon, MultiPolygon, Point with the property radius"
        raise InputError(f"geometry {kind!r}{hint} can't be used; legal: {legal}", where)


def _area(where: str, rings: object, velocity: tuple[float, float]) -> MapArea:
    if not isinstance(rings, list) or not rings:
        raise InputError("must be a list of rings", where)
    outline, *holes = (_ring(ring, f"{where} ring {index}") for index, ring in enumerate(rings))
    return MapArea(where, outline, tuple(holes), velocity)


def _ring(ring: object, where: str) -> Array:
    points = _positions(ring, where)
    if len(points) > 1 and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    if len(points) < 3:
        raise InputError("has fewer than three distinct points", where)
    return points


def _positions(values: object, where: str) -> Array:
    """(n, 2) of x, y and perhaps z, which is left out."""
    if not isinstance(values, list):
        raise InputError("must be a list of positions [x, y]", where)
    for value in values:
        if not (isinstance(value, list) and len(value) >= 2 and all(map(_is_number, value))):
            raise InputError(f"{_short(value)} is no position; legal: [x, y] in metres", where)
    return np.array([value[:2] for value in values], dtype=float).reshape(-1, 2)


def _velocity(value: object, where: str) -> tuple[float, float]:
    if not (isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))):
        raise InputError(f"{_short(value)} is no velocity; legal: [vx, vy] in m/s", where)
    vx, vy = float(value[0]), float(value[1])
    if math.hypot(vx, vy) > _FASTEST:
        raise InputError(f"{_short(value)} is faster than {_FASTEST:g} m/s", where)
    return vx, vy


def _says_boundary(where: str, properties: Json) -> bool:
    """A floor that is taken for an obstacle would block everything: only booleans are legal."""
    value = properties.get("boundary", False)
    if not isinstance(value, bool):
        raise InputError(f"{_short(value)} can't be used; legal: true, false", f"{where}.boundary")
    return value


def _as_boundary(
    where: str, found: list[MapArea | MapDisc]
) -> tuple[Array, list[MapArea | MapDisc]]:
    """The floor's outline, and its holes as what blocks."""
    if len(found) != 1 or not isinstance(found[0], MapArea):
        raise InputError("a boundary must be one Polygon", where)
    floor = found[0]
    if floor.velocity != (0.0, 0.0):
        raise InputError("a boundary can't move", f"{where}.velocity")
    return floor.outline, [MapArea(f"{where} hole", hole) for hole in floor.holes]


def _check_crs(content: Json, path: str) -> None:
    """Refuse what says that it is in degrees."""
    named = json.dumps(content.get("crs", "")).lower()
    if any(name in named for name in _DEGREES):
        raise InputError(
            "says that its coordinates are longitude and latitude; project them to metres",
            f"{path}: crs",
        )


def _check_size(things: list[MapArea | MapDisc], boundary: Array | None, path: str) -> None:
    """Refuse what must be in degrees: a whole map of a few centimetres."""
    if any(isinstance(thing, MapDisc) for thing in things):
        return
    outlines = [thing.outline for thing in things if isinstance(thing, MapArea)]
    points = np.vstack(outlines if boundary is None else [*outlines, boundary])
    width, depth = np.ptp(points, axis=0).tolist()
    if max(width, depth) < _SMALLEST:
        raise InputError(
            f"the whole map is {width:.2g} x {depth:.2g} m; coordinates must be metres, not "
            "longitude and latitude",
            path,
        )


def _is_object(value: object) -> TypeGuard[Json]:
    return isinstance(value, dict)


def _is_number(value: object) -> TypeGuard[float]:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        return False


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
