"""ROS maps: what map_server would say of each cell, and errors."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from PIL import Image
from shapely.geometry import Point, Polygon

from motm_wbc.errors import InputError
from motm_wbc.scene.floor_map import MapArea, load_floor_map
from motm_wbc.scene.ros_map import read_ros_map

KEYS = {"image": "map.pgm", "resolution": 0.05, "origin": [0.0, 0.0, 0.0]}
KEYS |= {"negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}


def write(folder, pixels, **changed):
    """A map of shades (rows, columns) 0..255, row 0 the uppermost."""
    keys = {**KEYS, **changed}
    pixels = np.asarray(pixels, dtype=np.uint8)
    rows, columns = pixels.shape
    name = keys.get("image")
    if name == "map.pgm":
        (folder / name).write_bytes(
            b"P5\n# made\n%d %d\n255\n" % (columns, rows) + pixels.tobytes()
        )
    path = folder / "map.yaml"
    path.write_text(
        "".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None)
    )
    return path


def shape(floor) -> shapely.Geometry:
    areas = [thing for thing in floor.things if isinstance(thing, MapArea)]
    return shapely.union_all([Polygon(area.outline, area.holes) for area in areas])


def room() -> np.ndarray:
    pixels = np.full((40, 60), 254)
    pixels[:2], pixels[-2:], pixels[:, :2], pixels[:, -2:] = 0, 0, 0, 0
    pixels[5:9, 10:20] = 0  # upper left: y from 31 to 35 cells
    pixels[30:34, 40:44] = 205  # unknown
    return pixels


def test_cells_are_where_the_origin_says(tmp_path):
    floor = read_ros_map(write(tmp_path, room(), origin=[1.0, -2.0, 0.0]))
    blocked = shape(floor)
    assert blocked.contains(Point(1.0 + 0.05 * 15, -2.0 + 0.05 * 33))
    assert blocked.contains(Point(1.0 + 0.05 * 42, -2.0 + 0.05 * 8))
    assert not blocked.contains(Point(1.0 + 0.05 * 15, -2.0 + 0.05 * 8))
    walls = 40 * 60 - 36 * 56
    assert blocked.area == pytest.approx(0.05**2 * (walls + 40 + 16))
    assert np.ptp(floor.boundary, axis=0) == pytest.approx([3.0, 2.0])


def test_unknown_cells_may_count_as_free(tmp_path):
    path = write(tmp_path, room())
    blocked = shape(read_ros_map(path, "free"))
    assert not blocked.contains(Point(0.05 * 42, 0.05 * 8))
    assert blocked.contains(Point(0.05 * 15, 0.05 * 33))


def test_yaw_turns_the_map_about_its_corner(tmp_path):
    plain = read_ros_map(write(tmp_path, room()))
    turned = read_ros_map(write(tmp_path, room(), origin=[0.0, 0.0, np.pi / 2]))
    expected = shapely.affinity.rotate(shape(plain), 90.0, origin=(0, 0))
    assert shape(turned).symmetric_difference(expected).area < 1e-9


def test_negate_swaps_black_and_white(tmp_path):
    plain = shape(read_ros_map(write(tmp_path, room()), "free"))
    swapped = shape(read_ros_map(write(tmp_path, 255 - room(), negate=1), "free"))
    assert swapped.symmetric_difference(plain).area < 1e-9


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_thresholds_are_strict_as_in_map_server(tmp_path, mode):
    # occupancy (255 - shade) / 255: 0.6 is not above 0.6, 0.2 not below 0.2
    pixels = [[102, 101, 204, 205, 254, 254]]
    changed = {"occupied_thresh": 0.6, "free_thresh": 0.2, "mode": mode}
    path = write(tmp_path, pixels, **changed)
    occupied = shape(read_ros_map(path, "free"))
    assert occupied.bounds == pytest.approx((0.05, 0.0, 0.10, 0.05))
    unfree = shape(read_ros_map(path, "blocked"))
    assert unfree.bounds == pytest.approx((0.0, 0.0, 0.15, 0.05))


def test_plain_and_deep_pgm_and_png_say_the_same(tmp_path):
    pixels = room()
    expected = shape(read_ros_map(write(tmp_path, pixels)))
    rows, columns = pixels.shape
    text = "\n".join(" ".join(map(str, row)) for row in pixels)
    (tmp_path / "plain.pgm").write_text(f"P2\n{columns} {rows}\n255\n{text}\n")
    deep = (pixels * 257).astype(">u2").tobytes()
    (tmp_path / "deep.pgm").write_bytes(b"P5 %d %d 65535\n" % (columns, rows) + deep)
    Image.fromarray(pixels.astype(np.uint8)).save(tmp_path / "map.png")
    for name in ("plain.pgm", "deep.pgm", "map.png"):
        found = shape(read_ros_map(write(tmp_path, pixels, image=name)))
        assert found.symmetric_difference(expected).area < 1e-9


def test_transparent_pixels_are_unknown_in_mode_scale(tmp_path):
    pixels = np.dstack([np.full((10, 10), 255), np.full((10, 10), 255)]).astype(np.uint8)
    pixels[2:5, 2:5, 1] = 0
    Image.fromarray(pixels, mode=None).save(tmp_path / "map.png")
    path = write(tmp_path, pixels[..., 0], image="map.png", mode="scale")
    assert shape(read_ros_map(path)).area == pytest.approx(9 * 0.05**2)
    assert read_ros_map(path, "free").things == ()


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"resolution": None}, "resolution"),
        ({"origin": None}, "origin"),
        ({"image": None}, "image"),
        ({"resolution": 0}, "greater than 0"),
        ({"resolution": "wide"}, "resolution"),
        ({"origin": "[0.0, 0.0]"}, "origin"),
        ({"mode": "raw"}, "'trinary' or 'scale'"),
        ({"occupied_thresh": 1.4}, "occupied_thresh"),
        ({"free_thresh": 0.9}, "must not be greater"),
        ({"image": "gone.pgm"}, "gone.pgm: no such image"),
        ({"image": "map.yaml"}, "can't be read as an image"),
    ],
)
def test_bad_files(tmp_path, changed, expected):
    with pytest.raises(InputError, match=r"map\.yaml|gone") as caught:
        read_ros_map(write(tmp_path, room(), **changed))
    assert expected in str(caught.value)


def test_more_bad_files(tmp_path):
    path = tmp_path / "map.yaml"
    for content, expected in (
        ("- 1\n", "keys"),
        ("a: [\n", "YAML"),
        ("[" * 3000, "YAML"),
        ("", "keys"),
    ):
        path.write_text(content)
        with pytest.raises(InputError, match=expected):
            read_ros_map(path)
    with pytest.raises(InputError, match="no free cell"):
        read_ros_map(write(tmp_path, np.zeros((4, 4))))
    (tmp_path / "map.pgm").write_bytes(b"P5\n60 40\n255\nshort")
    path.write_text("image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    with pytest.raises(InputError, match="can't be read as an image"):
        read_ros_map(path)
    with pytest.raises(InputError, match=r"give the .yaml beside it"):
        load_floor_map(tmp_path / "map.pgm")
    with pytest.raises(InputError, match="no such file"):
        load_floor_map(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="legal endings"):
        load_floor_map(tmp_path / "map.txt")


def test_a_large_image_is_opened_without_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1500)  # of 2400; twice as many are an error
    path = write(tmp_path, room())
    assert read_ros_map(path).boundary is not None
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)
    with pytest.raises(InputError, match="can't be read as an image"):
        read_ros_map(path)


@pytest.mark.slow
def test_a_large_map_loads_in_seconds(tmp_path):
    side = 4000
    row, column = np.mgrid[0:side, 0:side]
    pixels = np.full((side, side), 254, dtype=np.uint8)
    pixels[np.abs(np.sin(column / 170 + row / 400)) < 0.02] = 0
    pixels[np.abs(np.cos(row / 230 - column / 900)) < 0.015] = 0
    path = write(tmp_path, pixels)
    began = time.process_time()
    read_ros_map(path)
    assert time.process_time() - began < 10.0
