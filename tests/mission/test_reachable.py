from itertools import pairwise

import pytest

from motm_wbc.kinematics import load_robot
from motm_wbc.mission.parameters import GraspParameters
from motm_wbc.mission.reachable import grip_height, hold_radius, reachable_radius
from motm_wbc.scene.scenario import load_scenario

MODEL = load_robot("frankie")


def test_the_reach_shrinks_with_height():
    radii = [reachable_radius(MODEL, height) for height in (0.70, 0.80, 0.90, 1.00)]
    assert radii[0] == pytest.approx(0.75)
    assert all(higher < lower for lower, higher in pairwise(radii))
    assert radii[-1] > 0.4


def test_nothing_is_reached_far_above():
    assert reachable_radius(MODEL, 2.5) == 0.0


def test_the_base_keeps_within_the_least_reach_of_the_task():
    grasp = GraspParameters()
    low = hold_radius(MODEL, load_scenario("line"), grasp)
    high = hold_radius(MODEL, load_scenario("two_objects"), grasp)
    assert low == pytest.approx(0.72)
    assert 0.6 < high <= low


def test_a_grip_is_near_the_top_of_its_object():
    scenario = load_scenario("line")
    assert grip_height(scenario, 0) == pytest.approx(0.6 + 0.05 - 0.015)
    assert grip_height(scenario, 1) == pytest.approx(0.6 + 0.05 - 0.015)
