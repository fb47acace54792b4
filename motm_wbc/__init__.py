"""Mobile manipulation on the move, with failure recovery.

Names are imported when they are first used, so that a part of the package can be used
without the packages that the others need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from motm_wbc._version import __version__

if TYPE_CHECKING:
    from motm_wbc.experiments.parameters import make_parameters
    from motm_wbc.experiments.run import run
    from motm_wbc.kinematics import load_robot
    from motm_wbc.scene.scenario import load_scenario

_HOME = {
    "load_robot": "motm_wbc.kinematics",
    "load_scenario": "motm_wbc.scene.scenario",
    "make_parameters": "motm_wbc.experiments.parameters",
    "run": "motm_wbc.experiments.run",
}

__all__ = ["__version__", "load_robot", "load_scenario", "make_parameters", "run"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'motm_wbc' has no attribute {name!r}")
