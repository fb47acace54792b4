"""The command line on bad input: one clear line, exit status 2, no traceback."""

import json

import pytest

from motm_wbc import cli
from motm_wbc.scene.finder import data_folder


def motm(capsys, *words):
    """Exit status, stdout and stderr of `motm words...`."""
    import sys

    before, sys.argv = sys.argv, ["motm", *words]
    try:
        with pytest.raises(SystemExit) as stopped:
            cli.main()
    finally:
        sys.argv = before
    shown = capsys.readouterr()
    return stopped.value.code, shown.out, shown.err


def changed(tmp_path, old, new, name="line"):
    text = (data_folder("scenarios") / f"{name}.toml").read_text()
    assert old in text
    path = tmp_path / "changed.toml"
    path.write_text(text.replace(old, new, 1))
    return str(path)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["run", "missing.toml"], "missing.toml: no such file"),
        (["run", "lime"], "did you mean 'line'"),
        (["run", "line", "--robot", "frankiee"], "did you mean 'frankie'"),
        (["run", "line", "--method", "propsed"], "did you mean 'proposed'"),
        (["run", "line", "--plant", "balet"], "did you mean 'bullet'"),
        (["run", "line", "--failure-delay=-1"], "0 to 600"),
        (["run", "line", "--failure-delay", "nan"], "0 to 600"),
        (["run", "line", "--failure-delay", "soon"], "--failure-delay"),
        (["run", "line", "--seed=-3"], "seed"),
        (["run", "line", "--set", "placement.hold_on=1"], "placement.hold_on"),
        (["run", "line", "--set", "solver=simplex"], "simplex"),
        (["run", "line", "--preset", "hers"], "legal: ours, paper"),
        (["run", "line", "--record", "/proc/none/run.rrd"], "/proc/none/run.rrd"),
        (["run", "line", "--trace", "/proc/none/run.parquet"], "/proc/none/run.parquet"),
        (["run"], "Missing argument"),
        (["rum", "line"], "rum"),
        (["check", "nothing"], "unknown robot or scenario"),
        (["check", "line", "--robot", "nobody"], "unknown robot"),
        (["run", "line", "--set", "base.v_max=9"], "key of the robot's file"),
        (["run", "line", "--set", "mission.base_rate_divider=60"], "longer than staa.step"),
    ],
)
def test_bad_words(capsys, words, expected):
    status, out, err = motm(capsys, *words)
    assert status == 2
    assert out == ""
    assert expected in err
    assert err.count("\n") == 1 and "Traceback" not in err


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("radius = 0.2", "radios = 0.2", "did you mean 'radius'"),
        ("pose = [0.0, 2.0", "pose = [0.0, 0.3", "would stand in 'table'"),
        ("radius = 0.2", "radius = 0.9", "no place of the base"),
        ("size = [0.4, 0.4, 0.6]", "size = [2.4, 2.4, 0.6]", "could be placed"),
        ("size = [0.05, 0.05, 0.05]", "size = [0.15, 0.15, 0.05]", "gripper takes at most"),
        ("height = 0.6", "height = 1.9", "too high or too low for the arm"),
        (
            "[[objects]]",
            '[[obstacles]]\nname = "cart"\nshape = "box"\nsize = [0.3, 0.3, 0.3]\n'
            "position = [3.0, 0.0]\nvelocity = [0.1, 0.0, 0.0]\n\n[[objects]]",
            "'cart' moves",
        ),
    ],
)
def test_bad_scenarios(capsys, tmp_path, old, new, expected):
    status, out, err = motm(capsys, "run", changed(tmp_path, old, new), "--json")
    assert status == 2
    assert out == ""
    assert expected in err
    assert err.count("\n") == 1


def test_lists(capsys):
    status, out, _ = motm(capsys, "scenarios")
    assert status == 0 and "obstructed_turn" in out
    status, out, _ = motm(capsys, "robots")
    assert status == 0 and "frankie" in out
    status, out, _ = motm(capsys, "check", "frankie")
    assert status == 0 and "panda_joint4" in out
    status, out, _ = motm(capsys, "check", "turn")
    assert status == 0 and "tray" in out
    status, out, _ = motm(capsys, "--version")
    assert status == 0 and out.startswith("motm ")


def test_json_is_one_object(capsys):
    status, out, _ = motm(capsys, "run", "line", "--plant", "kinematic", "--json")
    summary = json.loads(out)
    assert status == 0 and summary["success"] is True
    assert summary["plant"] == "kinematic" and summary["collisions"] == 0
