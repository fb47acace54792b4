"""All parameters of a run in one tree, its presets, and setting one by its path."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any, Literal

from pydantic import BaseModel

from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.errors import InputError, UnknownName
from motm_wbc.mission.parameters import GraspParameters, MissionParameters, ReachParameters
from motm_wbc.qp import WholeBodyParameters
from motm_wbc.scene.files import Data, parse
from motm_wbc.simulation.parameters import PhysicsParameters

_PRESETS: Mapping[str, Mapping[str, Any]] = {
    "ours": {},
    # What the paper says and no more: see the table of open choices in the documentation.
    "paper": {
        "placement": PlacementParameters.paper().model_dump(),
        "staa": {"linear_actions": 7, "angular_actions": 7, "expansions": 2000}
        | {"local_target": "window"},
        "reach": {"form": "quintic"},
    },
}


_ROBOT_KEYS = ("base", "arm", "gripper", "tool")


class Parameters(Data):
    """Everything that a run can be set by."""

    control_rate: Literal[60, 120, 240] = 120
    """Control steps per second [Hz]."""
    solver: str = "osqp"
    """QP solver of the whole-body controller."""
    placement: PlacementParameters = PlacementParameters()
    """Base placement."""
    staa: StaaParameters = StaaParameters()
    """Local planner."""
    teb: TebParameters = TebParameters()
    """Local planner of the baseline."""
    whole_body: WholeBodyParameters = WholeBodyParameters()
    """Whole-body controller."""
    reach: ReachParameters = ReachParameters()
    """The arm's reach."""
    grasp: GraspParameters = GraspParameters()
    """Grasping and placing."""
    mission: MissionParameters = MissionParameters()
    """Rates."""
    physics: PhysicsParameters = PhysicsParameters()
    """Simulated plants."""


def preset_names() -> list[str]:
    """Names of the presets."""
    return sorted(_PRESETS)


def make_parameters(preset: str = "ours", settings: Iterable[str] = ()) -> Parameters:
    """A preset with single parameters set on top of it.

    Args:
        preset: `ours`, or `paper` for the paper's literal form.
        settings: each `path.to.parameter=value`, the value as in TOML.

    Raises:
        InputError: unknown preset or path, or a value that is not legal.
    """
    if preset not in _PRESETS:
        raise UnknownName("preset", preset, _PRESETS, "--preset")
    content = json.loads(json.dumps(_PRESETS[preset]))
    for setting in settings:
        _set(content, setting)
    return parse(Parameters, content, "--set")


def split_setting(setting: str) -> tuple[list[str], Any]:
    """Path and value of `path.to.parameter=value`.

    Raises:
        InputError: it has another form.
    """
    path, separator, text = setting.partition("=")
    if not separator or not path.strip():
        raise InputError(f"{setting!r} is not of the form KEY=VALUE", "--set")
    return path.strip().split("."), _value(text.strip())


def _set(content: dict[str, Any], setting: str) -> None:
    keys, value = split_setting(setting)
    _check_path(keys)
    for key in keys[:-1]:
        content = content.setdefault(key, {})
    content[keys[-1]] = value


def _check_path(keys: list[str]) -> None:
    model: type[BaseModel] = Parameters
    for depth, key in enumerate(keys):
        where = "--set " + ".".join(keys[: depth + 1])
        if depth == 0 and key in _ROBOT_KEYS:
            raise InputError("is a key of the robot's file, not a parameter of a run", where)
        if key not in model.model_fields:
            raise UnknownName("parameter", key, model.model_fields, where)
        inner = model.model_fields[key].annotation
        nested = isinstance(inner, type) and issubclass(inner, BaseModel)
        last = depth == len(keys) - 1
        if last and nested:
            raise InputError("is a group of parameters; name one of them", where)
        if not last and not nested:
            raise InputError("is one parameter and has none inside", where)
        if nested:
            assert isinstance(inner, type)
            model = inner


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
