"""`motm nav`: a map and two poses in, figures, a recording and a picture out."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from motm_wbc import cli
from motm_wbc.experiments.nav.command import NavRequest, navigate
from motm_wbc.experiments.nav.request import base_of, pose

CONTRACT = {
    "success",
    "failure_reason",
    "time_s",
    "collisions",
    "min_clearance_m",
    "path_length_m",
    "global_path_length_m",
    "step_ms",
}
FLOOR = [[-2, -3], [8, -3], [8, 3], [-2, 3], [-2, -3]]
TABLE = [[1.5, -0.3], [2.5, -0.3], [2.5, 1.2], [1.5, 1.2], [1.5, -0.3]]
TO = ["--start", "0,0,0", "--goal", "4,0,0"]


def motm(capsys, monkeypatch, *words):
    """Exit status, stdout and stderr of `motm nav words...`."""
    monkeypatch.setattr("sys.argv", ["motm", "nav", *map(str, words)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    shown = capsys.readouterr()
    return stopped.value.code, shown.out, shown.err


def polygon(ring, **properties):
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


@pytest.fixture
def map_file(tmp_path):
    path = tmp_path / "map.geojson"
    features = [polygon(FLOOR, boundary=True), polygon(TABLE, name="table")]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_json_is_one_object_with_the_contract_s_keys(capsys, monkeypatch, map_file):
    status, out, err = motm(capsys, monkeypatch, map_file, *TO, "--stop", "--json")
    result = json.loads(out)
    assert status == 0 and err == "" and set(result) >= CONTRACT
    assert result["success"] is True and result["collisions"] == 0
    assert set(result["step_ms"]) == {"median", "p99", "max"}
    assert result["min_clearance_m"] > 0.0


def test_a_table_is_printed_for_people(capsys, monkeypatch, map_file):
    status, out, _ = motm(capsys, monkeypatch, map_file, "--start", "0,-2,0", "--goal", "1.5,-2")
    assert status == 0 and "goal reached" in out and "least clearance" in out


def test_a_task_that_fails_is_1(capsys, monkeypatch, map_file):
    words = [map_file, *TO, "--json", "--time-limit", "0.5"]
    status, out, _ = motm(capsys, monkeypatch, *words)
    assert status == 1 and json.loads(out)["failure_reason"].startswith("time limit")
    content = json.loads(map_file.read_text())
    content["features"].append(polygon([[3, -4], [3.2, -4], [3.2, 4], [3, 4], [3, -4]]))
    map_file.write_text(json.dumps(content))
    status, out, _ = motm(capsys, monkeypatch, map_file, *TO, "--json")
    assert status == 1 and json.loads(out)["failure_reason"].startswith("no path")
    assert json.loads(out)["global_path_length_m"] is None


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--start", "0,0"], "--start: must be X,Y,HEADING"),
        (["--start", "0;0;0"], "--start: must be X,Y,HEADING"),
        (["--start", "0,nan,0"], "finite numbers"),
        (["--goal", "4,0,90"], "90 degrees are 1.571"),
        (["--goal", "4"], "--goal: must be X,Y or X,Y,HEADING"),
        (["--start", "2,0.4,0"], "--start: at (2, 0.4, 0 rad) the base is in collision"),
        (["--goal", "20,0,0"], "(20, 0, 0 rad) the base is not wholly inside of the boundary"),
        (["--goal", "7.9,0,0"], "boundary (it spans -2..8 m by -3..3 m)"),
        (["--footprint", "0.6"], "--footprint: must be LENGTH,WIDTH"),
        (["--footprint", "0.6,-1"], "--footprint: must be two numbers in 0.01..50 m"),
        (["--v-max", "0"], "--v-max: must be in 0.001..100, got 0"),
        (["--v-max", "1e9"], "--v-max: must be in 0.001..100, got 1e+09"),
        (["--a-max", "1e-9"], "--a-max: must be in 0.001..100, got 1e-09"),
        (["--alpha-max", "nan"], "--alpha-max: must be in 0.001..100, got nan"),
        (["--v-reverse=-1"], "--v-reverse: must be in 0.001..100 or 0, got -1"),
        (["--robot", "frankee"], "did you mean 'frankie'"),
        (["--planner", "stax"], "did you mean 'staa'"),
        (["--unknown", "maybe"], "legal: blocked, free"),
        (["--seed=-1"], "--seed: must be 0 or more"),
        (["--time-limit", "0"], "--time-limit: must be in"),
        (["--set", "staa.expand=1"], "staa.expand"),
        (["--record", "/none/a.rrd"], "--record: the folder /none does not exist"),
        (["--record", "a.txt"], "must end in .rrd"),
        (["--draw", "/none/a.png"], "--draw: the folder /none does not exist"),
        (["--draw", "a.what"], "--draw: must end in one of .png"),
    ],
)
def test_bad_words(capsys, monkeypatch, tmp_path, map_file, words, expected):
    monkeypatch.chdir(tmp_path)
    given = dict(zip(TO[::2], TO[1::2], strict=True))
    rest = [word for name, value in given.items() if name not in words for word in (name, value)]
    status, out, err = motm(capsys, monkeypatch, map_file, *rest, *words, "--json")
    assert status == 2 and out == ""
    assert expected in err
    assert err.count("\n") == 1 and "Traceback" not in err


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("gone.geojson", None, "no such file"),
        ("map.txt", "", "legal endings"),
        ("map.json", "{", "not valid JSON"),
        ("map.json", '{"type": "Point", "coordinates": [0, 0]}', "without a radius"),
        ("map.yaml", "resolution: 0.05", "image"),
    ],
)
def test_bad_maps(capsys, monkeypatch, tmp_path, name, text, expected):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    status, out, err = motm(capsys, monkeypatch, path, *TO)
    assert status == 2 and out == "" and expected in err and str(path) in err
    assert err.count("\n") == 1


def test_a_polygon_without_area_is_named(capsys, monkeypatch, tmp_path):
    path = tmp_path / "map.json"
    flat = polygon([[0, 5], [1, 5], [2, 5], [0, 5]])
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [polygon(TABLE), flat]}))
    status, _, err = motm(capsys, monkeypatch, path, *TO)
    assert status == 2 and f"{path}: features[1]: has no area" in err


def test_it_records_and_draws(tmp_path, map_file):
    content = json.loads(map_file.read_text())
    post = {"type": "Point", "coordinates": [6, -1]}
    properties = {"radius": 0.3, "velocity": [0.0, 0.1]}
    content["features"].append({"type": "Feature", "geometry": post, "properties": properties})
    map_file.write_text(json.dumps(content))
    record, draw = tmp_path / "drive.rrd", tmp_path / "drive.png"
    request = NavRequest(map_file, "0,0,0", "4,0,0", time_limit=0.6, record=record, draw=draw)
    navigate(request)
    assert draw.read_bytes().startswith(b"\x89PNG")
    entities = _entities(record)
    assert {
        "/base/pose",
        "/plan/global_path",
        "/plan/local_plan",
        "/plan/braking",
        "/plan/goal",
        "/scene/still",
        "/scene/boundary",
        "/scene/moving/0",
        "/series/v/value",
        "/series/omega/value",
        "/series/distance/value",
        "/series/base_time/value",
        "/log",
    } <= entities


def _entities(record):
    from rerun.chunk import RrdReader

    return {str(chunk.entity_path) for chunk in RrdReader(record).stream()}


def test_robots_bring_their_base_and_options_change_it():
    base = base_of("frankie", None, {"v_max": None, "a_max": 0.9})
    assert base.limits.v_max == 0.5 and base.limits.a_max == 0.9
    assert np.ptp(base.footprint, axis=0) == pytest.approx([0.68, 0.47])
    assert np.ptp(base_of("frankie", "1,0.5", {}).footprint, axis=0) == pytest.approx([1.0, 0.5])


def test_a_goal_may_have_a_free_heading():
    assert math.isnan(pose("1,2", "--goal", free_heading=True)[2])
    assert pose("1,2,3", "--goal", free_heading=True).tolist() == [1.0, 2.0, 3.0]
