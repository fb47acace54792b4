import numpy as np
import pytest

from motm_wbc.basenav.choice import time_until_leaving as leaving
from motm_wbc.basenav.departure import turning_lag
from motm_wbc.basenav.waiting import Wait

LEG1 = np.array([0.2, 1.0, 3.0])
RESTARTS = np.array([0.5, 0.7, 0.9])


def time_until_leaving(leg1, wait, restarts):
    return [
        leaving(way, restart, wait.expected, wait.open_end)
        for way, restart in zip(leg1, restarts, strict=True)
    ]


def test_without_a_wait_only_the_way_counts():
    assert time_until_leaving(LEG1, Wait(), RESTARTS) == pytest.approx(LEG1)


def test_ways_within_the_wait_are_free():
    found = time_until_leaving(LEG1, Wait(expected=2.0), np.zeros(3))
    assert found == pytest.approx([2.0, 2.0, 3.0])


def test_who_waits_has_to_start_again():
    found = time_until_leaving(LEG1, Wait(expected=2.0), RESTARTS)
    assert found == pytest.approx([2.5, 2.7, 3.0])
    barely = time_until_leaving(LEG1, Wait(expected=1.1), RESTARTS)
    assert barely[1] == pytest.approx(1.2)  # a short wait is driven out by going slower


def test_with_an_open_end_there_is_no_driving_through():
    found = time_until_leaving(LEG1, Wait(expected=2.0, open_end=True), RESTARTS)
    assert found == pytest.approx([2.5, 2.7, 3.9])


def test_turning_from_rest_to_rest_against_the_trapezoid():
    rate, acceleration = 1.745, 2.0
    for turn in (0.1, 0.8, 1.5, 2.0, 3.0):
        peak = min(rate, np.sqrt(turn * acceleration))
        exact = turn / peak + peak / acceleration
        assert turning_lag(turn, rate, acceleration) == pytest.approx(exact - turn / rate)
