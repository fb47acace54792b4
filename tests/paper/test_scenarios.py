"""The paper's scenarios, from start to drop, in the kinematic plant."""

import json
import subprocess
import sys

import pytest

from motm_wbc import load_robot, load_scenario, run

SCENARIOS = ("line", "turn", "obstructed_turn")


@pytest.fixture(scope="module")
def robot():
    return load_robot("frankie")


def done(scenario, delay, robot, plant="kinematic"):
    result = run(load_scenario(scenario), robot=robot, failure_delay=delay, plant=plant)
    summary = result.summary
    assert summary.success, summary.failure_reason
    assert summary.collisions == 0, result.collisions
    assert summary.limit_violation_max <= 1e-4
    assert summary.object_error_at_drop_m <= 0.03
    assert summary.clock_guard_firings == 0
    return result


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_failed_grasp_is_recovered(scenario, robot):
    summary = done(scenario, 3.0, robot).summary
    assert summary.grasp_attempts >= 2
    assert summary.grasp_time_s >= summary.first_attempt_time_s + 3.0


@pytest.mark.parametrize("scenario", ("line", "obstructed_turn"))
def test_the_object_is_picked_at_speed(scenario, robot):
    """With the first grasp holding, the base does not stop between start and drop."""
    result = done(scenario, 0.0, robot)
    assert result.summary.base_speed_at_grasp_m_s >= 0.45
    trace = result.trace.to_pydict()
    drop = result.summary.task_time_s
    speeds = [
        speed
        for time, speed in zip(trace["time"], trace["base_v_command"], strict=True)
        if 1.0 < time < drop - 2.0
    ]
    assert min(speeds) > 0.1


def test_failures_that_end_on_the_way_cost_no_time(robot):
    """Obstructed turn: the base is on its way around the object in any case."""
    at_once = done("obstructed_turn", 0.0, robot).summary.task_time_s
    recovered = done("obstructed_turn", 3.0, robot).summary.task_time_s
    assert recovered <= at_once + 0.5


def test_the_failure_delay_is_the_plants_secret(robot):
    """Two delays: the same run, to the bit, until the shorter one has passed."""
    short, long = (done("line", delay, robot) for delay in (2.0, 6.0))
    until = short.summary.first_attempt_time_s + 2.0
    first, second = short.trace.to_pydict(), long.trace.to_pydict()
    count = sum(time < until for time in first["time"])
    assert count > 400
    timings = {"arm_step_s", "base_step_s"}
    for name in set(first) - timings:
        assert str(first[name][:count]) == str(second[name][:count]), name
    assert short.summary.task_time_s < long.summary.task_time_s - 2.0


def test_the_same_run_in_another_process(robot):
    """Figures but the timings are equal, to the bit."""
    here = done("turn", 1.0, robot).summary.as_dict()
    words = ["-m", "motm_wbc", "run", "turn", "--failure-delay", "1"]
    other = subprocess.run(
        [sys.executable, *words, "--plant", "kinematic", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    there = json.loads(other.stdout)
    timings = {"base_step_ms", "arm_step_ms", "real_time_factor"}
    assert {key: there[key] for key in there if key not in timings} == {
        key: here[key] for key in here if key not in timings
    }


def test_four_steps_with_two_objects(robot):
    summary = done("two_objects", 1.0, robot).summary
    assert summary.grasp_attempts >= 4


@pytest.mark.parametrize(("scenario", "apart"), [("line", 0.1), ("turn", 0.5)])
def test_both_plants_agree(scenario, apart, robot):
    """Task times [s]. In `turn` the base turns back by half a turn, to either side of the drop:
    plans that cost the same, between which a millimetre decides."""
    pytest.importorskip("pybullet")
    one, other = (done(scenario, 1.0, robot, plant).summary for plant in ("kinematic", "bullet"))
    assert one.grasp_attempts == other.grasp_attempts
    assert abs(one.task_time_s - other.task_time_s) <= apart


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["kinematic", "bullet"])
@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("delay", [0.0, 1.0, 3.0, 6.0, 10.0])
def test_the_grid(scenario, delay, plant, robot):
    if plant == "bullet":
        pytest.importorskip("pybullet")
    done(scenario, delay, robot, plant)
