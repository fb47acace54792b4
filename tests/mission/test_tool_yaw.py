import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.kinematics import load_robot
from motm_wbc.mission.tool_yaw import (
    YawRange,
    bearing_sweep,
    choose_yaw,
    yaw_on_the_way,
    yaw_range,
)

ARM = np.array([0.15, 0.0])
angle = st.floats(-3.1, 3.1)
FRANKIE = YawRange(math.radians(-120.0), math.radians(210.0))


def test_the_sweep_of_an_orbit_is_its_angle():
    angles = np.linspace(0.0, math.pi, 40)
    poses = np.column_stack([0.6 * np.cos(angles), 0.6 * np.sin(angles), angles + 0.5 * math.pi])
    sweep = bearing_sweep(poses, ARM, np.zeros(2), 0.75)
    assert sweep[-1] - sweep[0] == pytest.approx(math.pi, abs=1e-6)


def test_the_chosen_yaw_has_the_sweep_best_inside():
    sweep = np.radians([-38.0, 44.0])
    choices = [math.radians(value) for value in (0.0, 90.0, 180.0, 270.0)]
    chosen = choose_yaw(choices, sweep, FRANKIE, 0.0)
    offsets = chosen - sweep
    assert offsets.min() > FRANKIE.lower and offsets.max() < FRANKIE.upper
    assert math.degrees(chosen) in (pytest.approx(0.0), pytest.approx(90.0))


@given(angle, angle, angle, angle)
def test_turning_never_crosses_the_end_of_the_range(goal, now, goal_bearing, bearing):
    """While the tool goes to its target and turns on the way, its offset stays in the range."""
    middle = FRANKIE.middle
    half = 0.5 * (FRANKIE.upper - FRANKIE.lower)
    for yaw, at in ((goal, goal_bearing), (now, bearing)):
        if abs(math.remainder(yaw - at - middle, math.tau)) > half - 1e-3:
            return
    yaw, at = now, bearing
    for _ in range(600):
        ahead = yaw_on_the_way(goal, yaw, goal_bearing, at, FRANKIE) - yaw
        assert abs(ahead) <= 0.5 * math.pi + 1e-9
        if abs(ahead) > 0.5 * math.pi - 1e-9:
            return  # held back: yaw and bearing do not keep step, the wrist's limit decides
        left = math.remainder(goal_bearing - at, math.tau)
        yaw += 0.05 * ahead  # tool and bearing cover the same share of their ways
        at += 0.05 * left
        assert abs(math.remainder(yaw - at - middle, math.tau)) <= half + 1e-6
    assert math.remainder(yaw - goal, math.tau) == pytest.approx(0.0, abs=1e-3)


def test_the_range_of_the_robot_is_that_of_its_wrist():
    found = yaw_range(load_robot("frankie"), 0.6, 0.635)
    assert math.radians(300.0) < found.upper - found.lower < math.radians(400.0)
    assert found.lower < 0.0 < found.upper


def test_the_long_way_round_is_taken_where_the_short_one_leads_out_of_range():
    """From offset -100 to offset 160 degrees: up through zero, not down across -120."""
    now, goal = math.radians(-100.0), math.radians(160.0)
    ahead = yaw_on_the_way(goal, now, 0.0, 0.0, FRANKIE) - now
    assert ahead == pytest.approx(0.5 * math.pi)
    assert abs(math.remainder(goal - now, math.tau)) < math.pi  # the short way would be down
    assert math.remainder(goal - now, math.tau) < 0.0
