"""The example drives through each of the maps beside it."""

import importlib.util
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("drive_map", EXAMPLES / "drive_map.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["flat.geojson", "flat.yaml"])
def test_it_drives_and_draws(script, tmp_path, name):
    picture = tmp_path / "flat.png"
    result = script.main(str(EXAMPLES / name), "2.5,4.2,0", "6,3,0", str(picture))
    assert result.success and result.collisions == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_it_minds_who_walks_there(script, tmp_path):
    words = ["1,4.5,0", "8,5.2,1.57", str(tmp_path / "flat.png")]
    result = script.main(str(EXAMPLES / "flat_person.geojson"), *words)
    assert result.success and result.collisions == 0
