import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.geometry import se2
from motm_wbc.mission.cylinder import (
    arm_base_position,
    as_cylinder,
    carried_velocity,
    relative_velocity,
)

ARM = np.array([0.15, -0.05])
near = st.floats(-1.0, 1.0)


@given(near, near, near, near, near, st.floats(-3.0, 3.0), near, near)
def test_rates_against_finite_differences(px, py, vx, vy, v, heading, omega, side):
    pose, twist = np.array([0.3, -0.2, heading]), np.array([v, side, omega])
    point, velocity = np.array([px, py, 0.6]), np.array([vx, vy, 0.1])
    if math.dist(arm_base_position(pose, ARM), point[:2]) < 0.2:
        return
    h = 1e-6
    now = as_cylinder(point, velocity, pose, twist, ARM)
    later_pose = se2.integrate_twist(pose, v, side, omega, h)
    later = as_cylinder(point + h * velocity, velocity, later_pose, twist, ARM)
    assert abs((later.radius - now.radius) / h - now.radius_rate) < 1e-4
    turned = math.remainder(later.bearing - now.bearing, math.tau) / h
    assert abs(turned - now.bearing_rate) < 1e-4
    assert abs((later.height - now.height) / h - now.height_rate) < 1e-6


@given(near, near, st.floats(-3.0, 3.0), near, near)
def test_a_tool_at_the_target_moves_with_it(px, py, heading, v, omega):
    """Carried motion plus the target's own rates is the target's velocity: nothing here."""
    pose, twist = np.array([0.1, 0.2, heading]), np.array([v, 0.0, omega])
    point = np.array([px, py, 0.6])
    centre = arm_base_position(pose, ARM)
    if math.dist(centre, point[:2]) < 0.2:
        return
    target = as_cylinder(point, np.zeros(3), pose, twist, ARM)
    own = relative_velocity(
        point[:2], centre, target.radius_rate, target.bearing_rate, target.height_rate
    )
    assert np.allclose(carried_velocity(point, pose, twist) + own, 0.0, atol=1e-9)
