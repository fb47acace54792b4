import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.geometry import se2

number = st.floats(-5.0, 5.0)
pose = st.tuples(number, number, st.floats(-math.pi, math.pi)).map(np.array)


@given(pose, pose)
def test_inverse_undoes_compose(first, second):
    back = se2.compose(se2.inverse(first), se2.compose(first, second))
    assert np.allclose(back[:2], second[:2], atol=1e-9)
    assert abs(math.remainder(back[2] - second[2], math.tau)) < 1e-9


@given(pose, st.lists(st.tuples(number, number), min_size=1, max_size=4).map(np.array))
def test_to_local_undoes_transform(frame, points):
    assert np.allclose(se2.to_local(frame, se2.transform_points(frame, points)), points, atol=1e-9)


@given(pose, number, number, st.floats(-3.0, 3.0))
def test_arc_is_the_limit_of_small_steps(start, vx, vy, omega):
    count, dt = 4000, 0.5
    walked = start.copy()
    for _ in range(count):
        heading = walked[2] + 0.5 * omega * dt / count
        c, s = math.cos(heading), math.sin(heading)
        walked += dt / count * np.array([c * vx - s * vy, s * vx + c * vy, omega])
    exact = se2.integrate_twist(start, vx, vy, omega, dt)
    assert np.allclose(exact[:2], walked[:2], atol=1e-6)
    assert abs(math.remainder(exact[2] - walked[2], math.tau)) < 1e-9


def test_quarter_circle():
    end = se2.integrate_twist(np.zeros(3), 1.0, 0.0, 1.0, math.pi / 2)
    assert np.allclose(end, [1.0, 1.0, math.pi / 2])
