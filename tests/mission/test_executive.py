"""The whole control step: in trouble it gives a safe command and says so."""

from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.experiments.parameters import Parameters
from motm_wbc.experiments.run import Setup, make_executive
from motm_wbc.kinematics import load_robot
from motm_wbc.scene.scenario import GraspFailure, load_scenario
from motm_wbc.simulation import make_plant

ROBOT = load_robot("frankie")


def setup(**changes) -> Setup:
    return Setup(
        load_scenario("line"),
        ROBOT,
        "proposed",
        "kinematic",
        GraspFailure(),
        0,
        Parameters(**changes),
    )


def after(seconds, made):
    """Executive and plant of a run that has gone on for a while."""
    executive = make_executive(made)
    plant = make_plant("kinematic", made.scenario, ROBOT, control_period=made.dt)
    while plant.time < seconds:
        plant.step(executive.step(*plant.sense()).command)
    return executive, plant


def assert_safe(command, before, dt):
    assert np.all(np.isfinite(command.base)) and np.all(np.isfinite(command.arm))
    limits = ROBOT.base_limits
    change = np.abs(command.base - before.base)
    assert np.all(change <= np.array([limits.a_max, limits.alpha_max]) * dt * 1.001)
    assert np.all(np.abs(command.arm) <= ROBOT.v_max + 1e-9)


def test_an_object_that_is_not_seen_stays_where_it_was():
    made = setup()
    executive, plant = after(1.0, made)
    state, world = plant.sense()
    seen = executive.step(state, world)
    blind = executive.step(state, replace(world, objects={}))
    assert not [event for event in blind.events if event.kind == "fault"]
    assert_safe(blind.command, seen.command, made.dt)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda state: replace(state, base_pose=np.full(3, np.nan)),
        lambda state: replace(state, q=np.full(7, np.inf)),
        lambda state: replace(state, q=np.zeros(3)),
        lambda state: replace(state, gripper_width=float("nan")),
    ],
)
def test_spoilt_sensing_brakes_and_says_so(spoil):
    made = setup()
    executive, plant = after(1.5, made)
    state, world = plant.sense()
    before = executive.step(state, world).command
    speeds = []
    told = []
    for _ in range(160):
        report = executive.step(spoil(state), world)
        assert_safe(report.command, before, made.dt)
        before = report.command
        speeds.append(abs(float(before.base[0])))
        told += [event.kind for event in report.events]
    assert speeds[-1] < speeds[0]
    assert speeds[-1] < 1e-6
    assert {"fault", "fallback", "method_failed", "emergency"} & set(told)


def test_a_lower_control_rate_is_known_to_the_local_planner():
    made = setup(control_rate=60)
    executive, _ = after(0.5, made)
    local = executive._base._method._local
    assert local.parameters.command_period == pytest.approx(6 / 60)
    assert local.parameters.ramp_steps == 6
