from pathlib import Path

import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.scene.finder import data_folder, scenario_names
from motm_wbc.scene.scenario import load_scenario


def changed(tmp_path: Path, old: str, new: str) -> Path:
    text = (data_folder("scenarios") / "line.toml").read_text()
    assert old in text
    path = tmp_path / "changed.toml"
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_load_and_are_named_like_their_files(name):
    assert load_scenario(name).name == name


def test_poses_of_the_paper():
    scenario = load_scenario("obstructed_turn")
    assert scenario.start_pose == pytest.approx([1.0, 2.0, -np.pi / 2])
    assert scenario.T_world_object("cube")[:3, 3] == pytest.approx([0.0, 0.0, 0.625])
    wall = scenario.obstacles[0].footprint()
    assert wall.min(axis=0) == pytest.approx([-0.25, 0.25])
    assert wall.max(axis=0) == pytest.approx([0.25, 2.75])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("radius = 0.2", "radios = 0.2", "did you mean 'radius'"),
        ("radius = 0.2", "radius = -0.2", "greater than 0"),
        ("radius = 0.2", 'radius = "wide"', "supports[0].radius"),
        ("radius = 0.2\n", "", "a cylinder has the keys height and radius"),
        ('on = "table"', 'on = "tabel"', "did you mean 'table'"),
        ('pick = "cube"', 'pick = "cub"', "did you mean 'cube'"),
        ('pick = "cube"', 'place = "cube"', "a place step needs 'at' and 'on'"),
        ("mass = 0.2", "mass = 200.0", "less than or equal to 50"),
        ("at = [0.0, -2.0]", "at = [0.0, -1.0]", "not over the support 'tray'"),
        ("at = [0.0, -2.0]", "at = [0.0, nan]", "finite"),
        ("position = [0.0, -2.0]", "position = [0.0, -2000.0]", "metres"),
        ("[start]", "[start", "not valid TOML"),
        ("-1.5707963267948966", "-90.0", "heading is in radians"),
        ("[start]", "boundary = [[0.0, 0.0], [1.0, 0.0]]\n[start]", "boundary must be a simple"),
        (
            "[[task]]",
            '[[objects]]\nname = "other"\nshape = "box"\nsize = [0.05, 0.05, 0.05]\n'
            'on = "table"\nposition = [0.02, 0.0]\n\n[[task]]',
            "'cube' and 'other' overlap",
        ),
        ('[[task]]\nplace = "cube"\non = "tray"\nat = [0.0, -2.0]\n', "", "ends with 'cube'"),
        ('name = "tray"', 'name = "table"', "two solids are named 'table'"),
    ],
)
def test_each_slip_is_one_clear_line(tmp_path, old, new, expected):
    path = changed(tmp_path, old, new)
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    message = str(caught.value)
    assert expected in message
    assert "\n" not in message
    assert str(path) in message


def test_missing_files_and_unknown_names():
    with pytest.raises(InputError, match="no such file"):
        load_scenario("nowhere/at_all.toml")
    with pytest.raises(InputError, match="did you mean 'line'"):
        load_scenario("lime")


def test_a_place_needs_the_object_in_hand(tmp_path):
    path = changed(tmp_path, '[[task]]\npick = "cube"\n', "")
    with pytest.raises(InputError, match="the gripper holds nothing"):
        load_scenario(path)
