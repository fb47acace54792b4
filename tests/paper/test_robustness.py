"""The scenarios from other starts and with other numbers: long, and marked so."""

from pathlib import Path

import numpy as np
import pytest

from motm_wbc import load_robot, load_scenario, make_parameters, run
from motm_wbc.experiments.parameters import Parameters
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.loading import build_model, load_description
from motm_wbc.scene.finder import find_robot
from motm_wbc.scene.scenario import Scenario

SCENARIOS = ("line", "turn", "obstructed_turn")
FRANKIE = load_robot("frankie")


def require_done(scenario: Scenario, robot: RobotModel, delay, plant, parameters=None):
    result = run(
        scenario,
        robot=robot,
        failure_delay=delay,
        plant=plant,
        parameters=parameters or Parameters(),
    )
    summary = result.summary
    assert summary.success, summary.failure_reason
    assert summary.collisions == 0, result.collisions
    assert summary.limit_violation_max <= 1e-4
    assert summary.object_error_at_drop_m <= 0.03


def changed_robot(part: str, **values) -> RobotModel:
    """Frankie with other numbers in one part of its file."""
    description = load_description("frankie")
    piece = getattr(description, part).model_copy(update=values)
    path = Path(find_robot("frankie"))
    return build_model(description.model_copy(update={part: piece}), path.parent, str(path))


def with_start(scenario: Scenario, seed: int) -> Scenario:
    """Another start, up to 0.15 m and 0.3 rad off."""
    generator = np.random.default_rng(seed)
    off = [*generator.uniform(-0.15, 0.15, 2), generator.uniform(-0.3, 0.3)]
    pose = tuple(float(a + b) for a, b in zip(scenario.start.pose, off, strict=True))
    return scenario.model_copy(update={"start": scenario.start.model_copy(update={"pose": pose})})


def with_heights(scenario: Scenario, height: float) -> Scenario:
    """All tables and trays as high as this [m]."""
    supports = []
    for support in scenario.supports:
        if support.size is None:
            supports.append(support.model_copy(update={"height": height}))
        else:
            supports.append(support.model_copy(update={"size": (*support.size[:2], height)}))
    return scenario.model_copy(update={"supports": tuple(supports)})


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["kinematic", "bullet"])
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("delay", [0.0, 4.0])
@pytest.mark.parametrize("seed", range(50))
def test_from_random_starts(seed, delay, name, plant):
    if plant == "bullet":
        pytest.importorskip("pybullet")
    require_done(with_start(load_scenario(name), seed), FRANKIE, delay, plant)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize(
    ("part", "values"),
    [
        ("base", {"a_max": 0.4, "alpha_max": 1.6}),
        ("base", {"a_max": 0.6, "alpha_max": 2.4}),
        ("base", {"v_reverse": 0.16}),
        ("base", {"v_reverse": 0.24}),
        ("gripper", {"min_closing_time": 0.36}),
    ],
)
def test_with_another_base_or_gripper(name, part, values):
    require_done(load_scenario(name), changed_robot(part, **values), 3.0, "kinematic")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("height", [0.48, 0.70])
def test_with_other_heights(name, height):
    require_done(with_heights(load_scenario(name), height), FRANKIE, 3.0, "kinematic")


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.40, 0.50])
def test_with_another_wall(height):
    scenario = load_scenario("obstructed_turn")
    (wall,) = scenario.obstacles
    changed = wall.model_copy(update={"size": (*wall.size[:2], height)})
    require_done(scenario.model_copy(update={"obstacles": (changed,)}), FRANKIE, 3.0, "kinematic")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("mass", [0.16, 0.24])
def test_with_another_mass(name, mass):
    scenario = load_scenario(name)
    things = tuple(thing.model_copy(update={"mass": mass}) for thing in scenario.objects)
    require_done(scenario.model_copy(update={"objects": things}), FRANKIE, 3.0, "kinematic")


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_with_a_longer_attempt_period(name):
    parameters = make_parameters(settings=["grasp.attempt_period=0.6"])
    require_done(load_scenario(name), FRANKIE, 3.0, "kinematic", parameters)


@pytest.mark.parametrize(
    "sensing",
    [
        {"delay": 0.1},
        {
            "delay": 0.03,
            "object_position_noise": 0.003,
            "base_position_noise": 0.003,
            "base_heading_noise": 0.003,
        },
    ],
)
def test_with_noise_and_delay(sensing):
    scenario = load_scenario("line")
    noisy = scenario.sensing.model_copy(update=sensing)
    result = run(
        scenario.model_copy(update={"sensing": noisy}),
        robot=FRANKIE,
        failure_delay=1.0,
        plant="kinematic",
        seed=1,
    )
    assert result.summary.success, result.summary.failure_reason
    assert result.summary.collisions == 0
