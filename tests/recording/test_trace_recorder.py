from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.recording import TraceRecorder

EXPECTED = [
    "time",
    "base_x",
    "base_y",
    "base_heading",
    "base_v",
    "base_omega",
    "base_v_command",
    "base_omega_command",
    "base_v_reference",
    "base_omega_reference",
    "q_shoulder",
    "q_elbow",
    "v_shoulder",
    "v_elbow",
    "v_command_shoulder",
    "v_command_elbow",
    "tool_target_x",
    "tool_target_y",
    "tool_target_z",
    "tool_error",
    "gripper_width",
    "gripper_command",
    "held",
    "goal_x",
    "goal_y",
    "goal_heading",
    "step_index",
    "stage",
    "rung",
    "active",
    "arm_step_s",
    "base_step_s",
    "selected",
    "selected_cost",
    "expansions",
    "clock_guard_fired",
    "object_cube_x",
    "object_cube_y",
    "object_cube_z",
    "object_cube_qx",
    "object_cube_qy",
    "object_cube_qz",
    "object_cube_qw",
    "moving_trolley_x",
    "moving_trolley_y",
    "moving_trolley_heading",
    "distance_base",
]


@pytest.fixture(scope="module")
def trace(run: Any) -> TraceRecorder:
    recorder = TraceRecorder(("shoulder", "elbow"), ("v", "omega"), {"seed": "0"})
    for truth, report in run.steps:
        recorder.step(truth, report)
        if report.base is not None:
            recorder.scalars(report.time, {"base": 0.25})
    recorder.close()
    return recorder


def test_schema_has_units_and_meanings(trace: TraceRecorder) -> None:
    schema = trace.table().schema
    assert schema.names == EXPECTED
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert all(field.metadata[b"meaning"] for field in schema)
    assert units["time"] == units["arm_step_s"] == units["base_step_s"] == "s"
    assert units["base_heading"] == units["goal_heading"] == "rad"
    assert (units["base_v"], units["base_omega_reference"]) == ("m/s", "rad/s")
    assert units["object_cube_z"] == units["tool_error"] == units["distance_base"] == "m"
    assert units["stage"] == ""
    assert schema.metadata[b"seed"] == b"0"


def test_rows_are_the_steps(run: Any, trace: TraceRecorder) -> None:
    table = trace.table()
    assert len(trace) == table.num_rows == len(run.steps) == 600
    np.testing.assert_array_equal(table["time"], [report.time for _, report in run.steps])
    for name, index in (("base_x", 0), ("base_y", 1), ("base_heading", 2)):
        np.testing.assert_array_equal(
            table[name], [truth.base_pose[index] for truth, _ in run.steps]
        )
    np.testing.assert_array_equal(table["q_elbow"], [truth.q[1] for truth, _ in run.steps])
    assert set(table["base_v"].to_pylist()) == {0.4}
    assert set(table["base_v_command"].to_pylist()) == {0.41}
    assert set(table["base_v_reference"].to_pylist()) == {0.42}
    assert table["active"][:51].to_pylist() == [["elbow speed"], *[[]] * 49, ["elbow speed"]]
    assert set(table["object_cube_z"].to_pylist()) == {0.625}
    assert set(table["object_cube_qw"].to_pylist()) == {1.0}
    np.testing.assert_allclose(table["moving_trolley_x"][-1].as_py(), 1.5 - 0.1 * 599 / 120)


def test_what_is_missing_is_null_and_the_goal_stays_in_force(
    run: Any, trace: TraceRecorder
) -> None:
    table = trace.table()
    with_base = [report.base is not None for _, report in run.steps]
    for name in ("base_step_s", "selected", "selected_cost", "expansions", "distance_base"):
        assert [value is not None for value in table[name].to_pylist()] == with_base
    assert table["goal_x"].null_count == 0
    goals = table["goal_x"].to_pylist()
    assert goals[6:12] == [float(run.steps[6][1].base.goal[0])] * 6
    assert table["held"].null_count == 600
    target = table["tool_target_z"].to_pylist()
    error = table["tool_error"].to_pylist()
    assert [value is None for value in target] == [math.isnan(value) for value in error]
    assert target.count(None) == 63


def test_events_have_a_table(run: Any, trace: TraceRecorder) -> None:
    events = trace.events_table().to_pylist()
    assert len(events) == len(trace.events) == 6
    assert events[0] == {
        "time": 50 / 120,
        "kind": "attempt",
        "text": "attempt at 0.42 s",
        "level": "warn",
    }


def test_parquet_comes_back(trace: TraceRecorder, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    path = tmp_path / "trace.parquet"
    trace.write_parquet(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["trace.parquet"]
    back = pq.read_table(path)
    assert back.schema.names == EXPECTED
    assert back.field("tool_error").metadata[b"unit"] == b"m"
    assert back.drop(["tool_error"]).equals(trace.table().drop(["tool_error"]))
    np.testing.assert_array_equal(back["tool_error"], trace.table()["tool_error"])


def test_parquet_in_no_folder(trace: TraceRecorder, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="can't be written"):
        trace.write_parquet(tmp_path / "missing" / "trace.parquet")


def test_empty_trace_has_its_columns() -> None:
    table = TraceRecorder(("j1",), ("v_x", "v_y", "omega")).table()
    assert table.num_rows == 0
    assert {"time", "base_v_y", "base_v_y_command", "q_j1", "goal_heading"} <= set(
        table.schema.names
    )


def test_trace_keeps_no_reference(run: Any) -> None:
    truth, report = run.steps[0]
    recorder = TraceRecorder(("shoulder", "elbow"), ("v", "omega"))
    recorder.step(truth, report)
    cube = truth.objects["cube"]
    before = cube[2, 3]
    cube[2, 3] = 9.0
    try:
        assert recorder.table()["object_cube_z"].to_pylist() == [before]
    finally:
        cube[2, 3] = before
