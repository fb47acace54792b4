from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.interfaces import Event
from motm_wbc.kinematics.loading import load_robot
from motm_wbc.kinematics.urdf import BASE_JOINTS
from motm_wbc.recording import RecordingParameters, RrdRecorder, reading
from motm_wbc.scene.finder import robot_names

FRAMES = {
    "/base/pose",
    "/base/trail",
    "/target",
    "/tool_target",
    "/plan/rejected",
    "/plan/candidates",
    "/plan/goal",
    "/plan/global_path",
    "/plan/local_plan",
    "/plan/braking",
    "/scene/objects/cube",
    "/scene/trolley",
    "/robot/joints/base_x",
    "/robot/joints/base_yaw",
    "/robot/joints/elbow",
    "/robot/joints/left",
}
EVERY_STEP = {
    "/series/v/value",
    "/series/omega/value",
    "/series/tool_error/value",
    "/series/gripper/value",
    "/series/joint_speed/value",
    "/series/joint_position/value",
    "/series/arm_time/value",
}


def record(run: Any, target: Path, count: int | None = None, **more: Any) -> None:
    recorder = RrdRecorder(target, scenario=run.scenario, title="test", **run.robot, **more)
    try:
        for truth, report in run.steps[:count]:
            recorder.step(truth, report)
            if report.base is not None:
                recorder.scalars(report.time, {"base": 0.3, "arm": 0.1})
    finally:
        recorder.close()


@pytest.fixture(scope="module")
def recorded(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole run, in several batches."""
    path = tmp_path_factory.mktemp("recorded") / "run.rrd"
    record(run, path, parameters=RecordingParameters(batch=1.3))
    return path


def seconds(table: Any) -> np.ndarray:
    return np.array(table["sim"].cast("int64")) * 1e-9


def first(table: Any, column: str, row: int) -> Any:
    return table[column][row].as_py()


def test_file_is_valid_and_brings_its_views(recorded: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(recorded)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "1 file verified without error" in done.stdout + done.stderr
    assert reading.has_blueprint(recorded)
    assert [entry.name for entry in recorded.parent.iterdir()] == ["run.rrd"]


def test_every_entity_is_stamped_at_each_of_its_instants(run: Any, recorded: Path) -> None:
    counts = reading.entities(recorded)
    frames = [report.time for _, report in run.steps if report.base is not None]
    steps = [report.time for _, report in run.steps]
    assert set(counts) >= FRAMES | EVERY_STEP
    for entity in FRAMES:
        np.testing.assert_allclose(seconds(reading.rows(recorded, entity)), frames, atol=2e-9)
    for entity in EVERY_STEP:
        np.testing.assert_allclose(seconds(reading.rows(recorded, entity)), steps, atol=2e-9)
    for entity in ("/series/distance/base", "/series/distance/arm", "/series/base_time/value"):
        np.testing.assert_allclose(seconds(reading.rows(recorded, entity)), frames, atol=2e-9)


def test_solids_are_there_once(recorded: Path) -> None:
    counts = reading.entities(recorded)
    for entity in ("/scene/table", "/scene/tray", "/scene/corner", "/scene/boundary"):
        assert counts[entity] == 0
    assert any(name.startswith("/robot/boxes/visual_geometries") for name in counts)


def test_values_are_those_of_the_run(run: Any, recorded: Path) -> None:
    last_truth, last = run.steps[-1]
    speed = reading.rows(recorded, "/series/v/value")
    assert first(speed, "Scalars:scalars", -1) == [0.4, 0.42, 0.41]
    shares = reading.rows(recorded, "/series/joint_speed/value")
    np.testing.assert_allclose(
        first(shares, "Scalars:scalars", -1), np.abs(last_truth.v) / 2.0, atol=1e-12
    )
    places = reading.rows(recorded, "/series/joint_position/value")
    np.testing.assert_allclose(
        first(places, "Scalars:scalars", -1), (last_truth.q + 2.0) / 4.0, atol=1e-12
    )
    errors = [
        math.nan if report.T_world_target is None else report.tool_error for _, report in run.steps
    ]
    values = reading.rows(recorded, "/series/tool_error/value")["Scalars:scalars"].to_pylist()
    np.testing.assert_array_equal([value for (value,) in values], errors)
    arm_time = reading.rows(recorded, "/series/arm_time/value")
    assert first(arm_time, "Scalars:scalars", -1) == [1e3 * last.compute_time]


def test_base_pose_and_joints_follow_the_truth(run: Any, recorded: Path) -> None:
    frames = [(truth, report) for truth, report in run.steps if report.base is not None]
    truth = frames[40][0]
    pose = reading.rows(recorded, "/base/pose")
    (position,) = first(pose, "Transform3D:translation", 40)
    np.testing.assert_allclose(position, [*truth.base_pose[:2], 0.0], atol=1e-6)
    (across,) = first(reading.rows(recorded, "/robot/joints/base_y"), "Transform3D:translation", 40)
    np.testing.assert_allclose(across, [0.0, truth.base_pose[1], 0.0], atol=1e-6)
    (finger,) = first(reading.rows(recorded, "/robot/joints/left"), "Transform3D:translation", 40)
    np.testing.assert_allclose(finger, [0.28, 0.02 + 0.5 * truth.gripper_width, 0.0], atol=1e-6)


def test_candidates_and_rejections_add_up(run: Any, recorded: Path) -> None:
    reports = [report.base for _, report in run.steps if report.base is not None]
    legal = reading.rows(recorded, "/plan/candidates")
    rejected = reading.rows(recorded, "/plan/rejected")
    for row in (0, 50, 99):
        report = reports[row]
        costs = report.costs[np.isfinite(report.costs)]
        assert 0 < len(costs) < 72
        colours = first(legal, "Arrows3D:colors", row)
        assert len(first(legal, "Arrows3D:origins", row)) == len(costs) == len(colours)
        assert colours[int(np.argmin(costs))] == 0xFDE725FF
        assert first(legal, "Arrows3D:labels", row)[0] == f"{costs[0]:.2f} s"
        reasons = first(rejected, "Arrows3D:labels", row)
        assert reasons == [report.reasons[int(k)] for k in report.rejections if k > 0]
    (label,) = first(reading.rows(recorded, "/plan/goal"), "Arrows3D:labels", 50)
    assert label == f"goal, {reports[50].costs[reports[50].selected]:.2f} s"


def test_what_is_not_there_is_taken_off_the_scene(run: Any, recorded: Path) -> None:
    frames = [report for _, report in run.steps if report.base is not None]
    shown = reading.rows(recorded, "/tool_target")["Arrows3D:vectors"].to_pylist()
    assert [len(arrows) for arrows in shown] == [
        0 if report.T_world_target is None else 3 for report in frames
    ]
    assert {len(arrows) for arrows in shown} == {0, 3}


def test_things_that_the_truth_leaves_out_stay_where_they_were(run: Any, target: Path) -> None:
    truth, report = run.steps[0]
    recorder = RrdRecorder(target, scenario=run.scenario, **run.robot)
    recorder.step(replace(truth, objects={}, moving={}), report)
    recorder.close()
    for entity, place in (("objects/cube", [0.0, 0.0, 0.625]), ("trolley", [1.5, -1.5, 0.0])):
        table = reading.rows(target, f"/scene/{entity}")
        (position,) = first(table, "Transform3D:translation", 0)
        np.testing.assert_allclose(position, place, atol=1e-6)


def test_old_plans_vanish(run: Any, target: Path) -> None:
    recorder = RrdRecorder(target, scenario=run.scenario, **run.robot)
    for index, (truth, report) in enumerate(run.steps[:120]):
        recorder.step(truth, report if index < 30 else replace(report, base=None))
    recorder.close()
    goals = reading.rows(target, "/plan/goal")
    last_report = 24 / 120.0
    for time, arrows in zip(seconds(goals), goals["Arrows3D:origins"].to_pylist(), strict=True):
        assert len(arrows) == (1 if time < last_report + 0.25 - 1e-6 else 0)
    assert len(goals) == 20


def test_log_and_states(run: Any, recorded: Path) -> None:
    log = reading.rows(recorded, "/log")
    events = [event for _, report in run.steps for event in report.events]
    assert len(events) == 6
    assert log["TextLog:text"].to_pylist() == [
        [f"{event.time:6.2f} s  attempt: {event.text}"] for event in events
    ]
    assert log["TextLog:level"].to_pylist() == [["WARN"]] * 6
    stages = reading.rows(recorded, "/states/stage")["StateChange:state"].to_pylist()
    assert stages == [["travel"], ["reach"]] * 3
    assert reading.rows(recorded, "/states/task")["StateChange:state"].to_pylist() == [
        ["pick cube"]
    ]


def test_limit_lines_span_the_run(recorded: Path) -> None:
    for entity, height in (
        ("v/upper_limit", 0.5),
        ("v/lower_limit", -0.2),
        ("arm_time/budget", 1e3 / 120),
    ):
        line = reading.rows(recorded, f"/series/{entity}")
        times = seconds(line)
        assert times[0] == 0.0
        assert times[-1] == pytest.approx(599 / 120, abs=1e-8)
        assert {value for (value,) in line["Scalars:scalars"].to_pylist()} == {height}


def test_an_error_in_the_run_leaves_a_valid_file(run: Any, target: Path) -> None:
    with (
        pytest.raises(ZeroDivisionError),
        RrdRecorder(target, scenario=run.scenario, **run.robot) as recorder,
    ):
        for truth, report in run.steps[:100]:
            recorder.step(truth, report)
        raise ZeroDivisionError
    assert len(reading.rows(target, "/series/v/value")) == 100
    assert reading.has_blueprint(target)


def test_file_appears_only_when_closed_and_close_may_be_repeated(run: Any, target: Path) -> None:
    target.write_text("an older file")
    recorder = RrdRecorder(target, scenario=run.scenario, **run.robot)
    recorder.event(Event(0.0, "note", "before the first step"))
    assert target.read_text() == "an older file"
    recorder.close()
    recorder.close()
    assert reading.rows(target, "/log")["TextLog:level"].to_pylist() == [["INFO"]]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing/run.rrd", "can't be written: No such file or directory"),
        ("run.rec", "must end in .rrd"),
        ("folder.rrd", "is no regular file"),
    ],
)
def test_places_that_cannot_be_written_are_told_at_once(
    run: Any, tmp_path: Path, name: str, message: str
) -> None:
    (tmp_path / "folder.rrd").mkdir()
    with pytest.raises(InputError, match=message) as caught:
        RrdRecorder(tmp_path / name, scenario=run.scenario, **run.robot)
    assert str(tmp_path / name) in str(caught.value)
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder.rrd"]


def test_bad_robots_are_told_and_leave_nothing(run: Any, target: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="unknown joint 'elbo'; did you mean 'elbow'"):
        RrdRecorder(
            target, scenario=run.scenario, **{**run.robot, "arm_joints": ("shoulder", "elbo")}
        )
    with pytest.raises(InputError, match="can't be read as a URDF"):
        RrdRecorder(
            target, scenario=run.scenario, **{**run.robot, "urdf_path": tmp_path / "none.urdf"}
        )
    assert list(tmp_path.iterdir()) == []


def test_two_recordings_of_a_process_are_two(run: Any, tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    ids = set()
    for name in ("a.rrd", "b.rrd"):
        record(run, tmp_path / name, 10)
        (entry,) = RrdReader(tmp_path / name).recordings()
        ids.add(entry.recording_id)
    assert len(ids) == 2


def test_recording_changes_nothing_and_keeps_no_reference(run: Any, target: Path) -> None:
    truth, report = run.steps[0]
    pose, q = truth.base_pose.copy(), truth.q.copy()
    recorder = RrdRecorder(target, scenario=run.scenario, **run.robot)
    recorder.step(replace(truth, base_pose=pose, q=q), report)
    np.testing.assert_array_equal(pose, truth.base_pose)
    np.testing.assert_array_equal(q, truth.q)
    pose += 100.0
    q += 1.0
    recorder.close()
    (position,) = first(reading.rows(target, "/base/pose"), "Transform3D:translation", 0)
    np.testing.assert_allclose(position, [*truth.base_pose[:2], 0.0], atol=1e-6)
    (place,) = reading.rows(target, "/series/joint_position/value")["Scalars:scalars"].to_pylist()
    np.testing.assert_allclose(place, (truth.q + 2.0) / 4.0, atol=1e-12)


def test_reading_tells_what_there_is(recorded: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="unknown entity '/series/tool_err/value'; did you mean"):
        reading.rows(recorded, "/series/tool_err/value")
    (tmp_path / "text.rrd").write_text("no recording")
    with pytest.raises(InputError, match="can't be read as a recording"):
        reading.entities(tmp_path / "text.rrd")


@pytest.mark.parametrize("name", robot_names())
def test_shipped_robots_have_their_meshes(run: Any, target: Path, name: str) -> None:
    robot = load_robot(name)
    recorder = RrdRecorder(
        target,
        scenario=run.scenario,
        urdf_path=robot.urdf_path,
        base_joints=BASE_JOINTS,
        arm_joints=robot.arm_joints,
        finger_joints=robot.finger_joints,
        base_kind=robot.base_kind,
        base_limits=robot.base_limits,
        footprint=robot.footprint,
        q_lower=robot.q_lower,
        q_upper=robot.q_upper,
        v_limits=robot.v_max,
        ring_radius=0.6,
        reach_radius=0.75,
    )
    recorder.close()
    bodies = [
        entity for entity in reading.entities(target) if f"{name}/visual_geometries/" in entity
    ]
    assert len(bodies) > robot.n_arm
