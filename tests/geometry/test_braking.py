import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.geometry.base_motion import BaseLimits, braking_arc, stopping_time
from motm_wbc.geometry.braking import stopping_speed

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)


def distance_braked(speed: float, acceleration: float, dt: float) -> float:
    travelled = 0.0
    while speed > 0.0:
        travelled += speed * dt
        speed -= acceleration * dt
    return travelled


@given(st.floats(0.0, 3.0), st.floats(0.5, 20.0), st.floats(1e-3, 0.05))
def test_the_speed_stops_within_the_distance_and_is_the_largest(distance, acceleration, dt):
    speed = float(stopping_speed(distance, acceleration, dt))
    slack = 1e-9 * (1.0 + distance)
    assert distance_braked(speed, acceleration, dt) <= distance + slack
    faster = speed + 1e-6 * max(1.0, speed)
    assert distance_braked(faster, acceleration, dt) > distance


def test_negative_distance_allows_no_speed():
    assert float(stopping_speed(-0.1, 1.0, 0.01)) == 0.0


@given(st.floats(-0.2, 0.5), st.floats(-1.7, 1.7))
def test_braking_arc_ends_where_integration_ends(v, omega):
    start = np.array([1.0, -2.0, 0.7])
    arc = braking_arc(start, v, omega, LIMITS)
    total = stopping_time(v, omega, LIMITS)
    count = 2000
    pose = start.copy()
    for k in range(count):
        factor = 1.0 - (k + 0.5) / count
        dt = total / count
        heading = pose[2] + 0.5 * factor * omega * dt
        pose += dt * factor * np.array([v * math.cos(heading), v * math.sin(heading), omega])
    assert np.allclose(arc[0], start)
    assert np.allclose(arc[-1][:2], pose[:2], atol=1e-5)
    assert abs(math.remainder(arc[-1][2] - pose[2], math.tau)) < 1e-6
    steps = np.hypot(*np.diff(arc[:, :2], axis=0).T)
    assert steps.max(initial=0.0) <= 0.03 + 1e-9
