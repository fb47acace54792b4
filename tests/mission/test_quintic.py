import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motm_wbc.mission.quintic import quintic_coefficients, quintic_state

states = arrays(float, (3, 2), elements=st.floats(-2.0, 2.0))


@given(states, states, st.floats(0.1, 4.0))
def test_it_starts_and_ends_as_asked(start, end, duration):
    coefficients = quintic_coefficients(start, end, duration)
    assert np.allclose(quintic_state(coefficients, 0.0), start, atol=1e-9)
    assert np.allclose(quintic_state(coefficients, duration), end, atol=1e-6)


@given(states, states, st.floats(0.3, 3.0), st.floats(0.1, 0.9))
def test_velocity_and_acceleration_are_derivatives(start, end, duration, share):
    coefficients = quintic_coefficients(start, end, duration)
    t, h = share * duration, 1e-5
    before, now, after = (quintic_state(coefficients, t + k * h) for k in (-1, 0, 1))
    assert np.allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-4, rtol=1e-5)
    assert np.allclose((after[1] - before[1]) / (2 * h), now[2], atol=1e-3, rtol=1e-5)
