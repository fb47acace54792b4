"""The tool as a free point on a moving base: what the reference alone makes of it."""

import math

import numpy as np
import pytest

from motm_wbc.geometry import se2
from motm_wbc.mission.arrival import Arrival
from motm_wbc.mission.cylinder import arm_base_position
from motm_wbc.mission.parameters import ReachParameters
from motm_wbc.mission.tool_reference import ToolMotion, ToolReference

ARM = np.array([0.15, 0.0])
DT = 1.0 / 120.0


def drive(parameters, base, twist, target, seconds, arrival=None):
    """Tool positions, relative speeds and errors while the base drives on."""
    reference = ToolReference(parameters, ARM, DT)
    pose = np.array(base, dtype=float)
    T = np.eye(4)
    T[:3, 3] = [*se2.transform_points(pose, np.array([0.6, 0.0])), 0.9]
    errors, steps, radii = [], [], []
    previous = None
    for k in range(round(seconds / DT)):
        motion = ToolMotion(T.copy(), pose, np.array(twist))
        left = None
        if arrival is not None and arrival - k * DT > 0.0:
            there = se2.integrate_twist(pose, *twist, arrival - k * DT)
            left = Arrival(arrival - k * DT, there)
        velocity = reference.toward_point(target, np.zeros(3), motion, 0.8, 0.75, left)
        T[:3, 3] += velocity * DT
        pose = se2.integrate_twist(pose, *twist, DT)
        errors.append(float(np.linalg.norm(T[:3, 3] - target)))
        radii.append(math.dist(T[:2, 3], arm_base_position(pose, ARM)))
        if previous is not None:
            steps.append(float(np.linalg.norm(velocity - previous)) / DT)
        previous = velocity
    return np.array(errors), np.array(steps), np.array(radii)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("speed", [0.25, 0.5])
def test_it_catches_an_object_that_is_driven_past(side, speed):
    target = np.array([0.0, 0.6 * side, 0.65])
    errors, steps, radii = drive(
        ReachParameters(), [-0.75, 0.0, 0.0], [speed, 0.0, 0.0], target, 1.0 / speed
    )
    assert errors[-1] < 2e-3
    assert steps.max() < 2.5 * ReachParameters().acceleration
    assert radii.max() < 0.78


def test_it_follows_on_an_orbit():
    target = np.array([0.0, 0.0, 0.65])
    errors, _, _ = drive(
        ReachParameters(), [0.6, 0.0, math.pi / 2], [0.5, 0.0, 0.5 / 0.6], target, 3.0
    )
    assert errors[round(1.7 / DT) :].max() < 2e-3


def test_it_goes_round_the_front_not_across_the_back():
    """From 140 degrees on one side to 140 on the other: never behind the arm."""
    reference = ToolReference(ReachParameters(), np.zeros(2), DT)
    pose, still = np.zeros(3), np.zeros(3)
    angle = math.radians(140.0)
    T = np.eye(4)
    T[:3, 3] = [0.5 * math.cos(angle), 0.5 * math.sin(angle), 0.7]
    target = np.array([0.5 * math.cos(angle), -0.5 * math.sin(angle), 0.7])
    for _ in range(480):
        motion = ToolMotion(T.copy(), pose, still)
        T[:3, 3] += reference.toward_point(target, still, motion, 0.8, 0.75, None) * DT
        assert abs(math.atan2(T[1, 3], T[0, 3])) <= angle + 0.05
        assert math.hypot(T[0, 3], T[1, 3]) > 0.4
    assert np.allclose(T[:3, 3], target, atol=1e-3)


def test_the_quintic_arrives_when_the_base_does():
    target = np.array([0.0, 0.6, 0.65])
    errors, _, _ = drive(
        ReachParameters(form="quintic"),
        [-2.0, 0.0, 0.0],
        [0.5, 0.0, 0.0],
        target,
        4.4,
        arrival=3.4,
    )
    assert errors[round(3.4 / DT)] < 0.05
    assert errors[-1] < 3e-3
