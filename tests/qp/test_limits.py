import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.qp.limits import BaseBounds, JointLimits

DTS = st.sampled_from([1 / 60, 1 / 100, 1 / 120, 1 / 240, 1 / 500])
LOWER, UPPER = np.array([-2.9, -0.1, -1.0]), np.array([2.9, 0.05, 1e-6 - 1.0])
V_MAX, A_MAX = np.array([2.175, 1.0, 2.6]), np.array([15.0, 7.5, 20.0])
RECOVERY = 0.2
SHARES = st.lists(st.floats(-0.1, 1.1), min_size=3, max_size=3).map(np.array)
SPEEDS = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(lambda x: np.array(x) * V_MAX)


def joint_limits(dt):
    return JointLimits(
        position=np.stack([LOWER, UPPER]), v_max=V_MAX, a_max=A_MAX, dt=dt, recovery_speed=RECOVERY
    )


@settings(max_examples=300, deadline=None)
@given(SHARES, SPEEDS, DTS)
def test_the_box_is_never_empty_and_ordered_by_priority(share, v, dt):
    q = LOWER + share * (UPPER - LOWER)
    box = joint_limits(dt).box(q, v)
    assert (box.lower <= box.upper).all()
    assert (box.hard_lower <= box.lower).all() and (box.upper <= box.hard_upper).all()
    assert (np.abs(np.stack([box.lower, box.upper])) <= V_MAX).all()
    reachable = (v - A_MAX * dt <= box.hard_upper) & (v + A_MAX * dt >= box.hard_lower)
    assert (box.upper <= v + A_MAX * dt + 1e-12)[reachable].all()
    assert (box.lower >= v - A_MAX * dt - 1e-12)[reachable].all()


@settings(max_examples=300, deadline=None)
@given(SHARES, SPEEDS, DTS, st.floats(0, 1))
def test_no_step_leaves_the_range_or_goes_further_out(share, v, dt, choice):
    q = LOWER + share * (UPPER - LOWER)
    box = joint_limits(dt).box(q, v)
    following = q + (box.lower + choice * (box.upper - box.lower)) * dt
    for side, limit in ((1.0, UPPER), (-1.0, LOWER)):
        over, then = side * (q - limit), side * (following - limit)
        assert (then[over <= 0.0] <= 0.0).all()
        assert (then <= np.maximum(over, 0.0)).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), DTS)
def test_whoever_starts_inside_keeps_position_and_acceleration_for_ever(seed, dt):
    rng = np.random.default_rng(seed)
    limits = joint_limits(dt)
    q = rng.uniform(LOWER, UPPER)
    v = np.zeros(3)
    for k in range(400):
        box = limits.box(q, v)
        # long pushes against either side, then anything
        push = np.array([1.0, 0.0])[(k // 60) % 2] if k < 240 else rng.uniform()
        chosen = box.lower + push * (box.upper - box.lower)
        assert (np.abs(chosen - v) <= A_MAX * dt * (1 + 1e-9)).all()
        q, v = q + chosen * dt, chosen
        assert (q >= LOWER).all() and (q <= UPPER).all()


@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(1e-4, 0.1), min_size=3, max_size=3), st.booleans(), SPEEDS, DTS)
def test_from_outside_it_comes_back_slowly_and_stays(excess, above, v, dt):
    span = UPPER - LOWER
    q = UPPER + np.array(excess) * span if above else LOWER - np.array(excess) * span
    limits = joint_limits(dt)
    for _ in range(round(3.0 / dt)):
        box = limits.box(q, v)
        outside = (q > UPPER) | (q < LOWER)
        v = np.clip(0.0, box.lower, box.upper)
        toward = -v if above else v
        assert (toward[outside] >= 0.0).all()
        q = q + v * dt
    assert (q <= UPPER).all() and (q >= LOWER).all()


def test_a_joint_outside_is_led_back_within_its_acceleration_at_bounded_speed():
    limits = joint_limits(0.01)
    q, v = np.array([2.9 + 0.29, 0.0, -1.0]), np.zeros(3)
    speeds = []
    while q[0] > 2.9:
        box = limits.box(q, v)
        chosen = np.clip(0.0, box.lower, box.upper)
        assert abs(chosen[0] - v[0]) <= 15.0 * 0.01 + 1e-12
        q, v = q + chosen * 0.01, chosen
        speeds.append(-v[0])
    assert max(speeds) == pytest.approx(RECOVERY)
    assert len(speeds) == pytest.approx(0.29 / RECOVERY / 0.01, abs=4)


def test_a_continuous_joint_has_speed_and_acceleration_bounds_only():
    endless = np.array([[-np.inf], [np.inf]])
    limits = JointLimits(
        position=endless, v_max=np.ones(1), a_max=np.full(1, 5.0), dt=0.1, recovery_speed=0.1
    )
    box = limits.box(np.array([1234.5]), np.array([0.8]))
    assert box.upper[0] == 1.0 and box.lower[0] == pytest.approx(0.3)


BASE = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
SIGNED = st.floats(-1.0, 1.0, allow_subnormal=False)


@settings(max_examples=400, deadline=None)
@given(SIGNED, SIGNED, SIGNED, SIGNED, DTS)
def test_every_scale_in_the_interval_keeps_all_base_limits(v, w, near_v, near_w, dt):
    bounds = BaseBounds(BASE, 2, dt)
    previous = np.array([0.35 * v + 0.15, 1.745 * w])
    reference = previous + 3.0 * bounds.arrays.change * np.array([near_v, near_w])
    interval = bounds.scale_interval(reference, previous)
    if interval is None:
        trial = np.linspace(0, 1, 2001)[:, None] * reference
        inside = (np.abs(trial - previous) <= bounds.arrays.change).all(axis=1)
        inside &= (trial >= bounds.arrays.slowest).all(axis=1) & (
            trial <= bounds.arrays.fastest
        ).all(axis=1)
        assert not inside.any()
        return
    assert 0.0 <= interval[0] <= interval[1] <= 1.0
    for s in interval:
        assert (np.abs(s * reference - previous) <= bounds.arrays.change * (1 + 2e-6)).all()
        assert (s * reference <= bounds.arrays.fastest + 1e-12).all()
        assert (s * reference >= bounds.arrays.slowest - 1e-12).all()


@settings(max_examples=200, deadline=None)
@given(SIGNED, SIGNED, DTS)
def test_a_reference_ramped_at_its_limits_is_followed_in_full(v, w, dt):
    bounds = BaseBounds(BASE, 2, dt)
    previous = np.array([0.3 * v + 0.1, 1.5 * w])
    for signs in ([1, -1], [-1, 1], [1, 1], [-1, -1]):
        reference = np.clip(
            previous + bounds.arrays.change * np.array(signs),
            bounds.arrays.slowest,
            bounds.arrays.fastest,
        )
        interval = bounds.scale_interval(reference, previous)
        assert interval is not None and interval[1] >= 1.0 - 1e-5


@settings(max_examples=200, deadline=None)
@given(SIGNED, SIGNED, DTS)
def test_braking_keeps_the_arc_and_comes_to_rest_in_the_least_time(v, w, dt):
    bounds = BaseBounds(BASE, 2, dt)
    command = np.array([0.35 * v + 0.15, 1.745 * w])
    assume(np.abs(command).max() > 1e-6)
    expected = np.ceil(np.max(np.abs(command) / bounds.arrays.change) - 1e-6)
    steps = 0
    while command.any():
        following = bounds.braked(command)
        assert (np.abs(following - command) <= bounds.arrays.change * (1 + 1e-9)).all()
        assert following[0] * command[1] == pytest.approx(following[1] * command[0], abs=1e-12)
        command, steps = following, steps + 1
        assert steps <= expected + 1
    assert steps >= expected


def test_braking_from_beyond_the_speed_limits_keeps_them():
    bounds = BaseBounds(BASE, 2, 0.01)
    braked = bounds.braked(np.array([2.0, 0.5]))
    assert braked[0] <= 0.5 and braked[1] == pytest.approx(braked[0] * 0.25)


def test_the_position_bound_is_the_largest_from_which_a_stop_is_possible():
    limits = joint_limits(0.01)
    q = np.array([2.85, 0.0, -1.0])
    v = float(stopping_speed(2.9 - 1e-9 - 2.85, 15.0, 0.01))
    box = limits.box(q, np.array([v, 0.0, 0.0]))
    assert box.hard_upper[0] == pytest.approx(v)
    too_fast, position = v + 1e-3, 2.85
    while too_fast > 0:
        position, too_fast = position + too_fast * 0.01, too_fast - 0.15
    assert position > 2.9
