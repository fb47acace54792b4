import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.geometry.base_motion import BaseLimits, VelocityRamp
from motm_wbc.interfaces import BaseReport
from motm_wbc.mission.arrival import arrival_in_range, base_prediction
from motm_wbc.mission.base_lead import BaseLead
from motm_wbc.mission.methods import BaseDecision, BaseMoment
from motm_wbc.mission.patience import expected_wait

LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
DT = 1.0 / 120.0
NONE = np.empty((0, 3))


def decision(acceleration, goal=None) -> BaseDecision:
    nothing = np.empty(0)
    report = BaseReport(
        goal, NONE, nothing, nothing.astype(np.int64), ("",), -1, np.empty((0, 2)), NONE, NONE
    )
    plan = np.array([[0.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.0, 0.0]])
    return BaseDecision(np.array(acceleration), plan, plan[:, 1:], report)


class Scripted:
    """A method that answers what it was given."""

    def __init__(self, answer):
        self.answer = answer
        self.asked = 0

    def decide(self, now):
        self.asked += 1
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def moment(v=0.0, omega=0.0, time=0.0) -> BaseMoment:
    return BaseMoment(
        time=time,
        pose=np.zeros(3),
        v=v,
        omega=omega,
        step_index=0,
        target=np.array([1.0, 0.0]),
        next_target=None,
        wait=0.0,
        attempts_fail=False,
    )


def lead(answer) -> BaseLead:
    return BaseLead(Scripted(answer), LIMITS, 6, DT, np.array([0.15, 0.0]))


@given(st.floats(-0.2, 0.5), st.floats(-1.7, 1.7), st.floats(-5.0, 5.0), st.floats(-20.0, 20.0))
def test_the_ramp_keeps_every_limit(v, omega, a, alpha):
    ramp = VelocityRamp(LIMITS, 6 * DT, DT)
    velocity = np.array([v, omega])
    ramp.start(velocity, np.array([a, alpha]))
    for _ in range(12):
        following = ramp.advance(velocity)
        assert np.all(np.abs(following - velocity) <= np.array([0.5, 2.0]) * DT + 1e-12)
        assert -0.2 - 1e-12 <= following[0] <= 0.5 + 1e-12
        assert abs(following[1]) <= 1.745 + 1e-12
        velocity = following
    end = v + np.clip(a, -0.5, 0.5) * 6 * DT
    assert velocity[0] == pytest.approx(min(max(end, -0.2), 0.5), abs=1e-9)


def test_the_method_is_asked_once_a_base_step():
    led = lead(decision([0.5, 0.0]))
    reports = [led.step(moment(time=k * DT)).report for k in range(13)]
    assert [k for k, report in enumerate(reports) if report is not None] == [0, 6, 12]


@pytest.mark.parametrize(
    "answer", [ValueError("lost"), decision([math.nan, 0.0]), decision([1.0]), None]
)
def test_a_method_that_fails_stops_the_base(answer):
    led = lead(answer)
    v, omega = 0.5, 0.8
    events = []
    for k in range(200):
        step = led.step(moment(v, omega, k * DT))
        events += [event.kind for event in step.events]
        v, omega = step.reference
    assert abs(v) < 1e-6 and abs(omega) < 1e-6
    assert "method_failed" in events


def test_goal_switches_are_counted_and_told():
    led = lead(decision([0.0, 0.0], goal=np.array([1.0, 0.0, 0.0])))
    kinds = [event.kind for k in range(12) for event in led.step(moment(time=k * DT)).events]
    assert kinds == ["goal"]
    assert led.goal_switches == 0  # the first goal is no switch
    led._method.answer = decision([0.0, 0.0], goal=np.array([2.0, 0.0, 0.0]))
    led.step(moment(time=12 * DT))
    assert led.goal_switches == 1


def test_prediction_goes_on_along_the_global_path():
    plan = np.array([[0.5, 0.25, 0.0, 0.0]])
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    predicted = base_prediction(np.zeros(3), plan, path, 0.5)
    assert predicted[-1] == pytest.approx([0.5 + 0.75 / 0.5 + 1.0 / 0.5, 1.0, 1.0, math.pi / 2])
    assert np.all(np.diff(predicted[:, 0]) >= 0.0)
    found = arrival_in_range(predicted, np.zeros(2), np.array([2.0, 0.0]), 1.25)
    assert found.time == pytest.approx(0.5 + 0.5 / 0.5, abs=0.11)
    assert arrival_in_range(predicted, np.zeros(2), np.array([9.0, 0.0]), 1.0) is None


def test_the_longer_it_fails_the_longer_the_wait():
    assert expected_wait(2.0, None, 1.5, 0.8) == pytest.approx(2.3)
    assert expected_wait(5.1, 5.0, 0.0, 0.8) == pytest.approx(0.8)
    assert expected_wait(9.0, 5.0, 0.0, 0.8) == pytest.approx(4.0)
