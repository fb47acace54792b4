"""The card that `motm check` prints of a robot or a scenario."""

from __future__ import annotations

from pathlib import Path

from motm_wbc.errors import UnknownName
from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.card import summarise
from motm_wbc.scene.files import read_toml
from motm_wbc.scene.finder import robot_names, scenario_names
from motm_wbc.scene.scenario import Scenario, load_scenario

Rows = list[tuple[str, str]]


def card(name: str) -> tuple[str, Rows]:
    """Title and rows of what `name` is: a shipped name, a file, or a robot's folder.

    Raises:
        InputError: it is neither a robot nor a scenario, or it can't be built.
    """
    if name in robot_names() or Path(name).is_dir():
        return _robot_card(name)
    if name in scenario_names():
        return _scenario_card(load_scenario(name))
    if not name.endswith(".toml") and "/" not in name:
        raise UnknownName("robot or scenario", name, [*robot_names(), *scenario_names()])
    if {"arm", "base", "tool"} & set(read_toml(Path(name))):
        return _robot_card(name)
    return _scenario_card(load_scenario(name))


def _robot_card(name: str) -> tuple[str, Rows]:
    model = load_robot(name)
    return f"robot {model.name}", summarise(model)


def _scenario_card(scenario: Scenario) -> tuple[str, Rows]:
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
    return f"scenario {scenario.name}", rows
