"""How far the arm reaches at a given height: it shrinks as targets stand higher.

MotM takes an object to be in range where the arm's manipulability at arrival is above a
bound; the bound here is a share of the best that the arm has at that height, so that it
needs no number of its own for each robot.
"""

from __future__ import annotations

import numpy as np

from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.inverse import solve_ik
from motm_wbc.mission.grip import grip_in_tool
from motm_wbc.mission.orientation import top_down
from motm_wbc.mission.parameters import GraspParameters
from motm_wbc.scene.scenario import Scenario

_YAW_FREE = (1.0, 1.0, 1.0)
_STEP = 0.01  # [m] between sampled radii
_SHORTEST = 0.3  # [m] below which no radius is sampled
_SHARE = 0.5  # of the best manipulability at that height


def reachable_radius(model: RobotModel, height: float) -> float:
    """Largest distance from the arm's base axis at which the tool, straight down, can work.

    Args:
        model: the robot.
        height: of the grip above the floor [m].

    Returns:
        Radius [m], at most the robot's `grasp_range`; zero if no sampled radius is reachable.
    """
    furthest = model.description.reach.grasp_range
    radii = np.arange(furthest, _SHORTEST, -_STEP)
    quality = np.array([_manipulability(model, radius, height) for radius in radii])
    good = quality >= _SHARE * quality.max()
    return float(radii[good][0]) if quality.max() > 0.0 else 0.0


def grip_height(scenario: Scenario, index: int) -> float:
    """Height of the grip at a step's target, wherever earlier steps have put it [m]."""
    step = scenario.task[index]
    thing = scenario.object(step.object)
    placed = [s for s in scenario.task[: index + 1] if s.place == step.object]
    stands = scenario.T_world_drop(placed[-1]) if placed else scenario.T_world_object(thing.name)
    return float(stands[2, 3]) + thing.grasp_height


def reach_of_step(
    model: RobotModel, scenario: Scenario, index: int, grasp: GraspParameters
) -> float:
    """Radius from which a step's target can be hovered over, and so worked on [m]."""
    return reachable_radius(model, grip_height(scenario, index) + grasp.hover)


def hold_radius(model: RobotModel, scenario: Scenario, grasp: GraspParameters) -> float:
    """Radius within which the base keeps every target of the task while it waits [m].

    It is as much shorter than the reach as the robot's file has it.
    """
    reach = model.description.reach
    count = len(scenario.task)
    least = min(reach_of_step(model, scenario, index, grasp) for index in range(count))
    return max(least - (reach.grasp_range - reach.hold_radius), 0.0)


def _manipulability(model: RobotModel, radius: float, height: float) -> float:
    """Of the arm with the tool straight down in front of it; zero out of reach."""
    target = np.eye(4)
    R_tool_grip = grip_in_tool(model.description)
    target[:3, :3] = top_down(0.0) @ R_tool_grip.T
    target[:3, 3] = [model.arm_base_xy[0] + radius, model.arm_base_xy[1], height]
    free = 1.0 - np.abs(R_tool_grip[:, 2])  # about the approach axis any angle will do
    answer = solve_ik(model, target, model.home, (*_YAW_FREE, *free.tolist()))
    if not answer.converged:
        return 0.0
    return model.configuration(np.zeros(3), answer.q).manipulability
