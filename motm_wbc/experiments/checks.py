"""What can be said of a scenario before it is run."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.basenav.placement import REASONS, BasePlacement
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import RobotModel
from motm_wbc.scene.footprints import base_obstacles
from motm_wbc.scene.scenario import Scenario, Step


def check_start(scenario: Scenario, model: RobotModel) -> None:
    """Refuse a start in collision.

    Raises:
        InputError: names what the base would stand in.
    """
    where = f"{scenario.name}: start.pose"
    base = Polygon(polygons.place(model.footprint, scenario.start_pose))
    for name, outline in base_obstacles(scenario).items():
        if base.intersection(Polygon(outline)).area > 1e-9:
            raise InputError(f"the base would stand in {name!r}", where)
    if scenario.boundary is not None and not Polygon(scenario.boundary).covers(base):
        raise InputError(
            "the base would stand outside the boundary", f"{scenario.name}: start.pose"
        )


def check_still(scenario: Scenario) -> None:
    """Refuse obstacles that move: navigation does not foresee them yet.

    Raises:
        InputError: names the first one.
    """
    for index, obstacle in enumerate(scenario.obstacles):
        if any(obstacle.velocity):
            raise InputError(
                f"{obstacle.name!r} moves, which navigation does not foresee yet; legal: "
                "[0.0, 0.0, 0.0]",
                f"{scenario.name}: obstacles[{index}].velocity",
            )


def check_targets(scenario: Scenario, placement: BasePlacement, region: ReachRegion) -> None:
    """Refuse a task with a step that no placement of the base serves.

    Raises:
        InputError: names the step and why its candidates were rejected.
    """
    for index, step in enumerate(scenario.task):
        target = step_target(scenario, step)
        ranking = placement.evaluate(scenario.start_pose, target, None, region=region)
        if ranking.selected >= 0:
            continue
        reasons = [REASONS[code] for code in np.unique(ranking.rejections) if code]
        what = "picked" if step.pick is not None else "placed"
        raise InputError(
            f"no place of the base from which {step.object!r} could be {what} "
            f"at ({target[0]:g}, {target[1]:g}): all are rejected ({', '.join(reasons)})",
            f"{scenario.name}: task[{index}]",
        )


def step_target(scenario: Scenario, step: Step) -> Array:
    """(2,) where a step acts at the start of the run [m]."""
    if step.at is not None:
        return np.array(step.at)
    return np.array(scenario.object(step.object).position)
