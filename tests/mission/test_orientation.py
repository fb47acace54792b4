import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.mission.orientation import top_down, yaw_of

angle = st.floats(-3.0, 3.0)


@given(angle)
def test_top_down_is_a_rotation_that_looks_down(yaw):
    R = top_down(yaw)
    assert np.allclose(R @ R.T, np.eye(3)) and np.linalg.det(R) == pytest.approx(1.0)
    assert np.allclose(R[:, 2], [0.0, 0.0, -1.0])
    assert yaw_of(R) == pytest.approx(yaw)
