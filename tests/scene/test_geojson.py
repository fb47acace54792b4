"""GeoJSON maps: what blocks, what moves, and errors that say where."""

from __future__ import annotations

import json

import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.scene.floor_map import MapArea, MapDisc, load_floor_map

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
HOLE = [[0.2, 0.2], [0.2, 0.8], [0.8, 0.8], [0.2, 0.2]]


def feature(kind, coordinates, **properties):
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def write(folder, *features, **more):
    path = folder / "map.geojson"
    content = {"type": "FeatureCollection", "features": list(features), **more}
    path.write_text(json.dumps(content))
    return path


def test_what_blocks(tmp_path):
    floor = load_floor_map(
        write(
            tmp_path,
            feature("Polygon", [SQUARE, HOLE], name="table"),
            feature("MultiPolygon", [[SQUARE], [[[5, 5, 0.1], [6, 5, 0], [6, 6, 0]]]]),
            feature("Point", [3, 4], radius=0.25, velocity=[0.1, -0.2]),
            feature("Polygon", [[[-9, -9], [9, -9], [9, 9], [-9, 9]], HOLE], boundary=True),
            {"type": "Feature", "geometry": None, "properties": None},
        )
    )
    table, first, second, post, inside = floor.things
    assert isinstance(table, MapArea) and len(table.outline) == 4 and len(table.holes) == 1
    assert isinstance(first, MapArea) and isinstance(second, MapArea)
    assert second.outline.tolist() == [[5, 5], [6, 5], [6, 6]]
    assert isinstance(post, MapDisc)
    assert (post.centre, post.radius, post.velocity) == ((3.0, 4.0), 0.25, (0.1, -0.2))
    assert isinstance(inside, MapArea) and len(inside.outline) == 3
    assert np.ptp(floor.boundary, axis=0).tolist() == [18.0, 18.0]


def test_a_byte_order_mark_is_skipped(tmp_path):
    path = write(tmp_path, feature("Polygon", [SQUARE]))
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert len(load_floor_map(path).things) == 1


def test_what_says_that_it_is_no_boundary_blocks(tmp_path):
    floor = load_floor_map(write(tmp_path, feature("Polygon", [SQUARE], boundary=False)))
    assert len(floor.things) == 1 and floor.boundary is None


def test_a_bare_geometry_is_a_map(tmp_path):
    path = tmp_path / "map.json"
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [SQUARE]}))
    assert len(load_floor_map(path).things) == 1


@pytest.mark.parametrize(
    ("one", "expected"),
    [
        (feature("LineString", SQUARE), "features[0]: geometry 'LineString' can't be used; legal"),
        (feature("Point", [0, 0]), "'Point' without a radius"),
        (feature("Point", [0, 0], radius=-1), "features[0].radius: must be a number > 0"),
        (feature("Point", [0, 0], radius=True), "must be a number > 0"),
        (feature("Point", [0], radius=1), "[0] is no position"),
        (feature("Polygon", [[[0, 0], [1, 1], [0, 0]]]), "fewer than three distinct points"),
        (feature("Polygon", SQUARE), "0 is no position"),
        (feature("Polygon", []), "must be a list of rings"),
        (feature("Polygon", [[[0, 0], [1, "a"], [1, 1]]]), "[1, 'a'] is no position"),
        (feature("Polygon", [[[0, 0], [1, float("nan")], [1, 1]]]), "is no position"),
        (feature("Polygon", [SQUARE], velocity=0.3), "features[0].velocity: 0.3 is no velocity"),
        (feature("Polygon", [SQUARE], velocity=[0.3, None]), "is no velocity"),
        (feature("Polygon", [SQUARE], velocity=[0, -1e9]), "faster than 100 m/s"),
        (feature("Polygon", [[[0, 0], [10**400, 1], [1, 1]]]), "is no position"),
        (feature("Polygon", [SQUARE], boundary="true"), "boundary: 'true' can't be used"),
        (feature("Polygon", [SQUARE], boundary=1), "legal: true, false"),
        (feature("Polygon", [SQUARE], boundary=True, velocity=[1, 0]), "a boundary can't move"),
        (feature("MultiPolygon", [[SQUARE], [SQUARE]], boundary=True), "must be one Polygon"),
        ({"type": "Polygon"}, "must be an object of type Feature"),
        ({"type": "Feature", "geometry": 3}, "geometry: must be an object or null"),
        ({"type": "Feature", "geometry": None}, "has no polygon"),
        (
            feature("Polygon", [[[8.40331, 49.01], [8.40332, 49.01], [8.4033, 49.0101]]]),
            "longitude",
        ),
    ],
)
def test_bad_features(tmp_path, one, expected):
    path = write(tmp_path, one)
    with pytest.raises(InputError) as caught:
        load_floor_map(path)
    assert str(path) in str(caught.value) and expected in str(caught.value)


def test_bad_files(tmp_path):
    boundary = feature("Polygon", [SQUARE], boundary=True)
    with pytest.raises(InputError, match=r"features\[1\].*second boundary"):
        load_floor_map(write(tmp_path, boundary, boundary))
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    with pytest.raises(InputError, match="project them to metres"):
        load_floor_map(write(tmp_path, boundary, crs=crs))
    path = tmp_path / "map.geojson"
    for text, expected in (
        ("{", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[]", "must be a GeoJSON object"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=expected):
            load_floor_map(path)
    path.write_text(json.dumps({"type": "FeatureCollection"}))
    with pytest.raises(InputError, match="features: must be a list"):
        load_floor_map(path)
    with pytest.raises(InputError, match="no such file"):
        load_floor_map(tmp_path / "gone.geojson")
