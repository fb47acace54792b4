"""Navigation of the base: global planner, base placement, local planner.

Knows geometry and scene only. Its hot loops are compiled when they are first called and
kept for later runs (see `jit`). Names are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motm_wbc.basenav.goal_field import GoalField, cost_to_go
    from motm_wbc.basenav.local_planner import Goal, LocalPlan, LocalPlanner
    from motm_wbc.basenav.maps import load_world
    from motm_wbc.basenav.navigator import Navigator, NavStatus, NavStep
    from motm_wbc.basenav.obstacle import Disc, Obstacle
    from motm_wbc.basenav.parameters import PlacementParameters
    from motm_wbc.basenav.placement import BasePlacement, PlacementResult
    from motm_wbc.basenav.planner import GlobalPlanner, Path
    from motm_wbc.basenav.reach import ReachRegion
    from motm_wbc.basenav.staa import StaaStar
    from motm_wbc.basenav.staa_parameters import StaaParameters
    from motm_wbc.basenav.teb import TimedElasticBand
    from motm_wbc.basenav.teb_parameters import TebParameters
    from motm_wbc.basenav.world import World

_HOME = {
    "BasePlacement": "placement",
    "Disc": "obstacle",
    "GlobalPlanner": "planner",
    "Goal": "local_planner",
    "GoalField": "goal_field",
    "LocalPlan": "local_planner",
    "LocalPlanner": "local_planner",
    "NavStatus": "navigator",
    "NavStep": "navigator",
    "Navigator": "navigator",
    "Obstacle": "obstacle",
    "Path": "planner",
    "PlacementParameters": "parameters",
    "PlacementResult": "placement",
    "ReachRegion": "reach",
    "StaaParameters": "staa_parameters",
    "StaaStar": "staa",
    "TebParameters": "teb_parameters",
    "TimedElasticBand": "teb",
    "World": "world",
    "cost_to_go": "goal_field",
    "load_world": "maps",
}

__all__ = [
    "BasePlacement",
    "Disc",
    "GlobalPlanner",
    "Goal",
    "GoalField",
    "LocalPlan",
    "LocalPlanner",
    "NavStatus",
    "NavStep",
    "Navigator",
    "Obstacle",
    "Path",
    "PlacementParameters",
    "PlacementResult",
    "ReachRegion",
    "StaaParameters",
    "StaaStar",
    "TebParameters",
    "TimedElasticBand",
    "World",
    "cost_to_go",
    "load_world",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"motm_wbc.basenav.{_HOME[name]}"), name)
    raise AttributeError(f"module 'motm_wbc.basenav' has no attribute {name!r}")
