"""How long a grasp pose is held while the base drives past or round it."""

import math

import numpy as np
import pytest

from benchmarks import drive_past as bench

TRAVEL = {0.25: 0.90, 0.5: 0.85, 0.75: 0.50, 1.0: 0.30}
"""Speed [m/s] -> travel that is held at least [m]."""
MEDIAN = {0.25: 0.1e-3, 0.5: 0.3e-3, 0.75: 0.3e-3, 1.0: 0.3e-3}
"""Speed [m/s] -> median error while held, at most [m]."""


def check(track, model):
    """All limits are kept; nothing but the tool task gives way."""
    assert track.rungs == {"full"}
    assert (track.scale == 1.0).all()  # navigation leads
    assert track.clearance.min() >= 0.01
    assert (np.abs(track.arm) <= model.v_max + 1e-9).all()
    assert (track.q >= model.q_lower).all() and (track.q <= model.q_upper).all()
    change = np.abs(np.diff(track.arm, axis=0)) * 120.0
    assert (change <= model.a_max + 1e-6).all()


def check_straight(model, v, height, side=1, **more):
    track = bench.drive_past(model, v, height, side, **more)
    check(track, model)
    assert track.travel_held() >= TRAVEL[v]
    assert track.travel_held(strict=True) >= TRAVEL[v]  # by no tilt of the tool
    assert track.median_error() <= MEDIAN[v]
    # the plan's whole hold is driven, and from where the plan has it
    planned = 0.01 * (len(track.foreseen.q) - 1)
    assert track.held().start == 0
    assert track.travel_held() >= planned - 0.01


@pytest.mark.parametrize("height", [0.425, 0.625])
@pytest.mark.parametrize("side", [1, -1])
def test_straight_past_at_half_a_metre_a_second(frankie, height, side):
    check_straight(frankie, 0.5, height, side)


def test_with_osqp_as_well(frankie):
    check_straight(frankie, 0.5, 0.625, solver="osqp")


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("yaw_free", [True, False])
def test_round_the_object_without_letting_go(frankie, side, yaw_free):
    track = bench.drive_round(frankie, 0.5, 0.625, side, yaw_free)
    check(track, frankie)
    half_circle = math.pi * bench.LATERAL
    assert track.travel_held() >= half_circle
    held = track.held()
    assert track.median_error() <= 0.1e-3
    assert track.tilt[held].max() <= 0.06
    turned = np.ptp(track.q[: int(half_circle / 0.5 * 120.0), 6])
    assert turned < 0.1 if yaw_free else abs(turned - math.pi) < 0.2


def test_a_pose_out_of_reach_is_refused(frankie):
    target = np.diag([1.0, -1.0, -1.0, 1.0])
    target[:3, 3] = [0.0, 2.0, 0.6]
    with pytest.raises(ValueError, match="can't hold"):
        bench.drive(frankie, target, np.zeros(3), (0.5, 0.0), 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("v", sorted(TRAVEL))
@pytest.mark.parametrize("height", [0.425, 0.525, 0.625, 0.725])
def test_straight_past_at_all_speeds_and_heights(frankie, v, height):
    check_straight(frankie, v, height)


@pytest.mark.slow
@pytest.mark.parametrize("v", [0.25, 0.75, 1.0])
@pytest.mark.parametrize("yaw_free", [True, False])
def test_round_the_object_at_other_speeds(frankie, v, yaw_free):
    track = bench.drive_round(frankie, v, 0.625, 1, yaw_free)
    check(track, frankie)
    assert track.travel_held() >= math.pi * bench.LATERAL


def test_the_picture_is_written(frankie, tmp_path):
    tracks = [(0.5, bench.drive_past(frankie, 0.5, 0.625))] * 4
    bench.write_picture(frankie, tracks, 0.625, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 10_000
