import numpy as np
import pytest

from motm_wbc.experiments.metrics import MotionTrace, limit_violation, spread_ms
from motm_wbc.kinematics import load_robot

DT = 1.0 / 120.0
MODEL = load_robot("frankie")


def trace(base=None, arm=None, q=None, counted=None) -> MotionTrace:
    count = 12
    return MotionTrace(
        base=np.zeros((count, 2)) if base is None else base,
        arm=np.zeros((count, 7)) if arm is None else arm,
        q=np.tile(MODEL.home, (count, 1)) if q is None else q,
        counted=np.ones(count) if counted is None else counted,
        dt=DT,
    )


def test_rest_violates_nothing():
    assert limit_violation(MODEL, trace()) == 0.0


def test_a_jump_of_the_base_is_an_acceleration():
    base = np.zeros((12, 2))
    base[5:, 0] = 0.01  # 1.2 m/s^2 for one step, 0.5 allowed
    assert limit_violation(MODEL, trace(base=base)) == pytest.approx(1.4)
    excused = np.ones(12)
    excused[5] = 0
    assert limit_violation(MODEL, trace(base=base, counted=excused)) == 0.0


def test_reverse_has_a_limit_of_its_own():
    base = np.tile(np.linspace(0.0, -0.03, 12)[:, None] * [1.0, 0.0], 1)
    assert limit_violation(MODEL, trace(base=base)) == 0.0
    base = np.full((12, 2), [-0.3, 0.0])
    assert limit_violation(MODEL, trace(base=base, counted=np.zeros(12))) == pytest.approx(0.5)


def test_a_joint_driven_over_its_end_counts_by_its_range():
    q = np.tile(MODEL.home, (12, 1))
    q[:, 0] = MODEL.q_upper[0] - 0.001
    arm = np.zeros((12, 7))
    arm[:, 0] = 0.6
    span = MODEL.q_upper[0] - MODEL.q_lower[0]
    expected = (0.6 * DT - 0.001) / span
    found = limit_violation(MODEL, trace(arm=arm, q=q, counted=np.zeros(12)))
    assert found == pytest.approx(expected)


def test_spread():
    assert spread_ms(np.array([])) is None
    spread = spread_ms(np.array([0.001] * 99 + [0.1]))
    assert spread.median == 1.0 and spread.max == 100.0 and spread.p99 < 2.0
