"""Where the shipped scenarios and robots are: one finder for a checkout and for a wheel."""

from __future__ import annotations

from pathlib import Path

from motm_wbc.errors import InputError, UnknownName

_PACKAGE = Path(__file__).resolve().parent.parent


def data_folder(kind: str) -> Path:
    """The shipped folder `robots` or `scenarios`.

    In a wheel it lies inside the package, in a checkout beside it.

    Raises:
        InputError: the installation lacks it.
    """
    for folder in (_PACKAGE / kind, _PACKAGE.parent / kind):
        if folder.is_dir():
            return folder
    raise InputError("this installation has no such data folder", kind)


def scenario_names() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.stem for path in data_folder("scenarios").glob("*.toml"))


def robot_names() -> list[str]:
    """Names of the shipped robots."""
    return sorted(path.parent.name for path in data_folder("robots").glob("*/robot.toml"))


def find_scenario(name: str | Path) -> Path:
    """Path of a scenario file, from a shipped name or a path."""
    if _is_path(name):
        return Path(name)
    if str(name) not in scenario_names():
        raise UnknownName("scenario", str(name), scenario_names())
    return data_folder("scenarios") / f"{name}.toml"


def find_robot(name: str | Path) -> Path:
    """Path of a robot file, from a shipped name, a folder with a robot.toml, or a path."""
    if _is_path(name):
        path = Path(name)
        return path / "robot.toml" if path.is_dir() else path
    if str(name) not in robot_names():
        raise UnknownName("robot", str(name), robot_names())
    return data_folder("robots") / str(name) / "robot.toml"


def _is_path(name: str | Path) -> bool:
    return isinstance(name, Path) or name.endswith(".toml") or "/" in name
