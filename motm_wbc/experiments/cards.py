"""The card that `motm check` prints of a robot or a scenario."""

from __future__ import annotations

from pathlib import Path

from motm_wbc.errors import UnknownName
from motm_wbc.experiments.parameters import Parameters
from motm_wbc.experiments.run import Setup, make_executive
from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.card import summarise
from motm_wbc.mission.methods import method_names
from motm_wbc.scene.files import read_toml
from motm_wbc.scene.finder import robot_names, scenario_names
from motm_wbc.scene.scenario import Scenario, load_scenario
from motm_wbc.simulation import default_plant

Rows = list[tuple[str, str]]


def card(name: str, robot: str) -> tuple[str, Rows]:
    """Title and rows of what `name` is: a shipped name, a file, or a robot's folder.

    A scenario is built for a robot as for a run, so that what a run would refuse is said.

    Args:
        name: what to check.
        robot: that a scenario is checked with.

    Raises:
        InputError: it is neither a robot nor a scenario, or it can't be built.
    """
    if name in robot_names() or Path(name).is_dir():
        return _robot_card(name)
    if name in scenario_names():
        return _scenario_card(load_scenario(name), robot)
    if not name.endswith(".toml") and "/" not in name:
        raise UnknownName("robot or scenario", name, [*robot_names(), *scenario_names()])
    if {"arm", "base", "tool"} & set(read_toml(Path(name))):
        return _robot_card(name)
    return _scenario_card(load_scenario(name), robot)


def _robot_card(name: str) -> tuple[str, Rows]:
    model = load_robot(name)
    return f"robot {model.name}", summarise(model)


def _scenario_card(scenario: Scenario, robot: str) -> tuple[str, Rows]:
    model = load_robot(robot)
    method, plant = method_names()[0], default_plant()
    setup = Setup(scenario, model, method, plant, scenario.grasp_failure, 0, Parameters())
    make_executive(setup)
    rows: Rows = [("what it is", scenario.description or "-")]
    x, y, heading = scenario.start.pose
    rows.append(("start", f"({x:g}, {y:g}) m, heading {heading:.3f} rad"))
    for solid in (*scenario.supports, *scenario.obstacles, *scenario.objects):
        at = f"at ({solid.position[0]:g}, {solid.position[1]:g}) m"
        rows.append((solid.name, f"{solid.shape}, {solid.top:g} m high, {at}"))
    for index, step in enumerate(scenario.task):
        if step.pick is not None:
            rows.append((f"step {index + 1}", f"pick {step.pick}"))
        elif step.at is not None:
            place = f"({step.at[0]:g}, {step.at[1]:g}) m"
            rows.append((f"step {index + 1}", f"place {step.place} on {step.on} at {place}"))
    sensing = {key: value for key, value in scenario.sensing if value}
    rows.append(("sensing", ", ".join(f"{k} {v:g}" for k, v in sensing.items()) or "exact"))
    failure = scenario.grasp_failure
    rows.append(("grasps fail", f"for {failure.delay:g} s, then with {failure.probability:g}"))
    rows.append(("boundary", "none" if scenario.boundary is None else "set"))
    rows.append(("time limit", f"{scenario.time_limit:g} s"))
    rows.append(("built for", f"{model.name}: nothing stands against a run"))
    return f"scenario {scenario.name}", rows
