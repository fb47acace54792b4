import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.kinematics.description import Gripper as GripperData
from motm_wbc.scene.scenario import GraspFailure, upright_pose
from motm_wbc.scene.solids import Object
from motm_wbc.simulation.bodies import ObjectShape
from motm_wbc.simulation.grasp import FailureModel, Fingers, Gripper
from motm_wbc.simulation.parameters import PhysicsParameters

PERIOD = 1.0 / 120.0
DT = 1.0 / 240.0
DATA = GripperData(max_width=0.08, closing_speed=0.1, opening_speed=0.2, force=40.0)
CUBE = Object(name="cube", shape="box", size=(0.05, 0.05, 0.05), on="table")
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
Y = np.array([0.0, 1.0, 0.0])
GRASP = np.array([0.0, 0.0, CUBE.grasp_height])


def failures(delay=0.0, probability=0.0, seed=0, period=PERIOD):
    failure = GraspFailure(delay=delay, probability=probability)
    return FailureModel(failure, period, np.random.default_rng(seed))


@given(
    delay=st.floats(0.0, 12.0),
    first=st.integers(0, 10_000),
    later=st.lists(st.integers(0, 3000), max_size=10),
)
def test_an_attempt_fails_within_the_delay_and_only_then(delay, first, later):
    model = failures(delay)
    assert model.fails("cube", first) is (delay > 1e-6 * PERIOD)
    for steps in sorted(later):
        if abs(steps * PERIOD - delay) > 1e-4 * PERIOD:
            assert model.fails("cube", first + steps) is (steps * PERIOD < delay)


@pytest.mark.parametrize("period", [1 / 50, 1 / 60, 1 / 100, 1 / 120, 1 / 240, 1 / 1000])
@pytest.mark.parametrize("delay", [1.0, 2.0, 3.0, 7.0, 10.0])
def test_whole_seconds_are_whole_steps(period, delay):
    model = failures(delay, period=period)
    steps = round(delay / period)
    assert model.fails("cube", 17)
    assert model.fails("cube", 17 + steps - 1)
    assert not model.fails("cube", 17 + steps)


def test_each_object_has_its_own_first_attempt():
    model = failures(1.0)
    assert model.fails("a", 0)
    assert not model.fails("a", 120)
    assert model.fails("b", 120)
    assert not model.fails("b", 240)


def test_failures_by_chance_are_as_frequent_as_asked():
    model = failures(probability=0.3, seed=5)
    rate = np.mean([model.fails("cube", step) for step in range(4000)])
    assert rate == pytest.approx(0.3, abs=0.03)


def test_draws_do_not_depend_on_the_delay():
    long, short = failures(5.0, 0.5), failures(0.0, 0.5)
    after = range(600, 700)
    drawn = [short.fails("cube", step) for step in [0, *after]][1:]
    assert [long.fails("cube", step) for step in [0, *after]][1:] == drawn


def run(fingers, seconds, actual=None):
    for _ in range(round(seconds / DT)):
        fingers.advance(fingers.reference if actual is None else actual, DT)


def test_fingers_follow_their_speeds():
    fingers = Fingers(DATA)
    assert fingers.command(0.0, 0.08)
    run(fingers, 0.4)
    assert fingers.reference == pytest.approx(0.04)
    assert not fingers.command(0.08, 0.04)
    run(fingers, 0.1)
    assert fingers.reference == pytest.approx(0.06)


def test_closing_on_something_takes_its_time():
    fingers = Fingers(DATA)
    fingers.command(0.0, 0.08)
    fingers.close_on(0.065)  # 0.15 s at full speed
    run(fingers, 0.3)
    assert fingers.reference == pytest.approx(0.065)


def test_a_ramp_of_commands_is_one_motion():
    fingers = Fingers(DATA)
    begins = []
    for k in range(60):
        begins.append(fingers.command(0.08 - 0.0005 * k, fingers.reference))
        run(fingers, PERIOD)
    assert sum(begins) == 1


def test_closing_further_after_a_rest_is_a_new_motion():
    fingers = Fingers(DATA)
    assert fingers.command(0.06, 0.08)
    run(fingers, 0.5)
    assert not fingers.closing
    assert fingers.command(0.0, 0.06)


def test_the_reference_waits_for_fingers_that_are_stopped():
    fingers = Fingers(DATA)
    fingers.command(0.0, 0.08)
    run(fingers, 2.0, actual=0.05)
    assert fingers.reference == pytest.approx(0.045)
    fingers.command(0.08, 0.05)
    assert fingers.reference == pytest.approx(0.05)


def gripper(delay=0.0):
    shapes = {"cube": ObjectShape.of(CUBE)}
    return Gripper(shapes, Fingers(DATA), failures(delay), PhysicsParameters())


def close(hand, offset, step=0):
    T_world_tool = DOWN.copy()
    T_world_tool[:3, 3] = GRASP + offset
    if hand.fingers.command(0.0, hand.fingers.reference):
        objects = {"cube": upright_pose(np.zeros(3), 0.0)}
        hand.begin_closing(step, step * PERIOD, T_world_tool, Y, objects)


@given(
    direction=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda d: math.hypot(*d) > 0.1),
    distance=st.floats(0.0, 0.03),
)
def test_attempts_start_within_a_centimetre(direction, distance):
    hand = gripper()
    close(hand, distance * np.array(direction) / math.hypot(*direction))
    if abs(distance - 0.01) > 1e-9:
        assert len(hand.attempts) == (distance < 0.01)


def test_a_failing_attempt_leaves_a_centimetre():
    hand = gripper(delay=5.0)
    close(hand, np.zeros(3))
    run(hand.fingers, 2.0)
    assert hand.fingers.reference == pytest.approx(0.06)
    assert not hand.may_hold("cube", DOWN, np.eye(4))


def test_what_is_taken_is_let_go_when_the_fingers_open():
    hand = gripper()
    close(hand, np.zeros(3))
    assert hand.may_hold("cube", DOWN, np.eye(4))
    hand.take("cube", 0.05, 0.3)
    assert hand.ideal_width == 0.08
    run(hand.fingers, 1.0, actual=0.05)
    assert hand.ideal_width == 0.05
    assert not hand.must_release()
    hand.fingers.command(0.08, 0.05)
    run(hand.fingers, 0.01)
    assert hand.must_release()
    assert hand.release(1.5) == "cube"
    assert hand.releases[0].time == 1.5
    assert hand.attempts[0].held


@given(yaw=st.floats(-math.pi, math.pi))
def test_width_of_a_turned_box(yaw):
    shape = ObjectShape.of(CUBE)
    expected = 0.05 * (abs(math.cos(yaw)) + abs(math.sin(yaw)))
    assert shape.width(upright_pose(np.zeros(3), yaw), Y) == pytest.approx(expected)
