"""PathRTR against times worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.basenav.pathrtr import BACKWARD, FORWARD, Speeds, direct_time, end_turn, path_time

SPEEDS = Speeds(forward=0.5, backward=0.2, turning=math.radians(90.0))
CORNER = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])

headings = st.one_of(st.none(), st.floats(-10.0, 10.0))


def test_straight_ahead_is_length_over_speed():
    assert path_time(np.array([[0.0, 0.0], [3.0, 0.0]]), 0.0, 0.0, SPEEDS) == 6.0


def test_turns_at_start_bend_and_goal_add_up():
    # 90 deg at the start, 90 at the bend, 180 at the goal; 3 m
    time = path_time(CORNER, -math.pi / 2, -math.pi / 2, SPEEDS)
    assert time == pytest.approx((90 + 90 + 180) / 90 + 3.0 / 0.5)


def test_backward_turns_by_the_complement():
    # 180 - 90 at the start, 90 at the bend, 180 - 180 at the goal; 3 m in reverse
    time = path_time(CORNER, -math.pi / 2, -math.pi / 2, SPEEDS, backward=True)
    assert time == pytest.approx((90 + 90 + 0) / 90 + 3.0 / 0.2)


def test_free_headings_cost_nothing():
    assert path_time(CORNER, None, None, SPEEDS) == pytest.approx(90 / 90 + 3.0 / 0.5)


def test_the_authors_worked_example():
    # 4 m, turned by 30 deg at one end and 90 deg at the other, 0.5 m/s, 100 deg/s: 9.2 s
    speeds = Speeds(0.5, 0.0, math.radians(100.0))
    line = np.array([[0.0, 0.0], [4.0, 0.0]])
    time = path_time(line, math.radians(30.0), math.radians(90.0), speeds)
    assert time == pytest.approx(9.2)


def test_one_place_is_a_turn_and_repeated_points_do_nothing():
    one = np.array([[1.0, 2.0], [1.0, 2.0]])
    assert path_time(one, 3.0, -3.0, SPEEDS) == pytest.approx((math.tau - 6.0) / SPEEDS.turning)
    assert path_time(one, None, 1.0, SPEEDS) == 0.0
    doubled = np.repeat(CORNER, 2, axis=0)
    assert path_time(doubled, 0.3, 1.2, SPEEDS) == path_time(CORNER, 0.3, 1.2, SPEEDS)


def test_no_reverse_speed_forbids_the_gear():
    assert path_time(CORNER, 0.0, 0.0, Speeds(0.5, 0.0, 1.0), backward=True) == math.inf
    assert direct_time(1.0, 0.0, 0.0, 0.0, Speeds(0.5, 0.0, 1.0), BACKWARD) == math.inf


@given(st.floats(-5, 5), st.floats(-5, 5), headings, headings, st.booleans())
def test_kernel_equals_the_reference(dx, dy, start, goal, backward):
    line = np.array([[0.0, 0.0], [dx, dy]])
    as_float = [math.nan if heading is None else heading for heading in (start, goal)]
    found = direct_time(dx, dy, *as_float, SPEEDS, BACKWARD if backward else FORWARD)
    assert found == pytest.approx(path_time(line, start, goal, SPEEDS, backward), abs=1e-9)


@given(st.floats(-20, 20), st.floats(-20, 20))
def test_turns_of_both_gears_make_half_a_circle(direction, heading):
    forward = end_turn(direction, heading, FORWARD)
    assert 0.0 <= forward <= math.pi
    assert forward + end_turn(direction, heading, BACKWARD) == pytest.approx(math.pi)
