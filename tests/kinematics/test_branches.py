import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.errors import InputError
from motm_wbc.geometry import se2
from motm_wbc.kinematics import solve_ik
from motm_wbc.kinematics.branches import HoldParameters, longest_hold
from motm_wbc.kinematics.following import arm_numbers, follow
from motm_wbc.kinematics.parameters import PairClass, PairClasses
from motm_wbc.kinematics.rotations import axis_angle, inverse_pose, planar_pose

YAW_FREE = (1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
POINT = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
SPACING = 0.01


def top_down(x, y, height, yaw=0.0):
    T = np.eye(4)
    c, s = np.cos(yaw), np.sin(yaw)
    T[:3, :3] = [[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]
    T[:3, 3] = [x, y, height]
    return T


def straight(length=1.5):
    x = np.arange(-0.15 - 0.5 * length, -0.15 + 0.5 * length + 1e-9, SPACING)
    return np.column_stack((x, np.zeros((len(x), 2))))


def arc(v, omega, duration, dt):
    times = np.arange(round(duration / dt) + 1) * dt
    start = np.array([-0.5, 0.0, 0.1])
    return np.array([se2.integrate_twist(start, v, 0.0, omega, t) for t in times])


def distances(model, q):
    """Least distance of pairs of capsules, and of capsules and base; by brute force."""
    ends = model.configuration(np.zeros(3), q).capsule_segments()
    share = np.linspace(0.0, 1.0, 41)[None, :, None]
    points = ends[:, None, 0] * (1.0 - share) + ends[:, None, 1] * share
    radius = model.capsules.radius
    own = [
        np.linalg.norm(points[i][:, None] - points[j][None], axis=2).min() - radius[i] - radius[j]
        for i, j in model.self_pairs
    ]
    half, centre = 0.5 * model.base_box.size, model.base_box.centre
    beyond = np.maximum(np.abs(points - centre) - half, 0.0)
    base = np.linalg.norm(beyond, axis=2).min(axis=1) - radius
    return min(own), min(base[list(model.base_pairs)])


def check(model, hold, T_world_target, poses, dt, weights):
    """All that a hold promises."""
    assert 0 <= hold.first <= hold.last < len(poses)
    for q, base_pose in zip(hold.q, poses[hold.first : hold.last + 1], strict=True):
        T = model.configuration(base_pose, q).T_world_tool
        error = T[:3, :3].T @ (T_world_target[:3, 3] - T[:3, 3])
        assert np.linalg.norm(error[np.array(weights[:3]) > 0.0]) <= 1e-4 + 1e-9
        if weights == YAW_FREE:
            assert T[:3, 2] @ T_world_target[:3, 2] >= math.cos(1.001e-3)
        if weights[3:] == (1.0, 1.0, 1.0):
            turn = 0.5 * (np.trace(T[:3, :3].T @ T_world_target[:3, :3]) - 1.0)
            assert turn >= math.cos(1.001e-3)
    assert (hold.q >= model.q_lower).all() and (hold.q <= model.q_upper).all()
    speed = np.abs(np.diff(hold.q, axis=0)) / dt
    assert (speed <= model.v_max + 1e-9).all()


@pytest.mark.parametrize(("v", "least"), [(0.25, 0.98), (0.5, 0.86), (0.75, 0.71), (1.0, 0.57)])
@pytest.mark.parametrize("side", [1, -1])
def test_holds_a_grasp_while_the_base_drives_past(frankie, v, least, side):
    poses, dt = straight(), SPACING / v
    target = top_down(0.0, 0.6 * side, 0.625)
    hold = longest_hold(frankie, target, poses, dt, YAW_FREE)
    check(frankie, hold, target, poses, dt, YAW_FREE)
    assert SPACING * (len(hold.q) - 1) >= least
    own, base = np.min([distances(frankie, q) for q in hold.q[::10]], axis=0)
    assert own >= 0.01 and base >= 0.02


def test_comes_near_to_what_the_reach_allows_and_not_beyond(frankie):
    # shoulder to wrist at most with joint 4 at its limit; the wrist is 88 mm beside the tool
    elbow = -0.6
    x = 0.0825 - 0.0825 * math.cos(elbow) - 0.384 * math.sin(elbow)
    z = 0.316 - 0.0825 * math.sin(elbow) + 0.384 * math.cos(elbow)
    rise = (0.525 + 0.1034 + 0.107) - (0.38 + 0.333)
    reach = math.sqrt(x * x + z * z - rise * rise) + 0.088
    chord = 2.0 * math.sqrt(reach**2 - 0.6**2)
    hold = longest_hold(frankie, top_down(0.0, 0.6, 0.525), straight(), SPACING / 0.05, YAW_FREE)
    assert chord - 0.05 <= SPACING * (len(hold.q) - 1) <= chord + 1e-3


def test_the_slower_the_longer(frankie):
    target = top_down(0.0, 0.6, 0.625)
    lengths = [
        len(longest_hold(frankie, target, straight(), SPACING / v, YAW_FREE).q)
        for v in (1.5, 1.0, 0.5, 0.25)
    ]
    assert lengths == sorted(lengths)


def test_backward_in_time_is_as_good(frankie):
    target, dt = top_down(0.1, 0.55, 0.6), SPACING / 0.5
    poses = straight()
    there = longest_hold(frankie, target, poses, dt, YAW_FREE)
    back = longest_hold(frankie, target, poses[::-1], dt, YAW_FREE)
    assert abs(len(there.q) - len(back.q)) <= 0.06 * len(there.q)
    check(frankie, back, target, poses[::-1], dt, YAW_FREE)


def test_finds_a_better_branch_than_the_given_posture_leads_to(frankie):
    target, poses, dt = top_down(0.0, 0.6, 0.425), straight(), SPACING / 1.0
    poor = np.array([-1.35, -1.4, 2.6, -1.9, 1.4, 1.4, 0.8])  # shoulder and wrist turned round
    middle = int(np.argmin(np.abs(poses[:, 0] + 0.15)))
    T_base_target = inverse_pose(planar_pose(poses[middle])) @ target
    assert solve_ik(frankie, T_base_target, poor, YAW_FREE).converged
    alone = HoldParameters(starts=1)
    one = longest_hold(frankie, target, poses, dt, YAW_FREE, poor, alone)
    best = longest_hold(frankie, target, poses, dt, YAW_FREE, poor)
    assert len(best.q) >= len(one.q) + 5
    check(frankie, best, target, poses, dt, YAW_FREE)


def test_among_equals_the_posture_stays(frankie):
    target, poses, dt = top_down(0.0, 0.6, 0.525), straight(), SPACING / 0.25
    first = longest_hold(frankie, target, poses, dt, YAW_FREE)
    again = longest_hold(frankie, target, poses, dt, YAW_FREE, first.q_anchor)
    assert np.abs(again.q_anchor - first.q_anchor).max() < 0.3


def test_a_yaw_that_is_given_is_held_round_half_a_circle(frankie):
    v, dt = 0.5, SPACING / 0.5
    centre = np.array([0.0, 0.6])
    times = np.arange(round(math.pi * 0.6 / SPACING) + 1) * dt
    poses = np.array([se2.integrate_twist(np.zeros(3), v, 0.0, v / 0.6, t) for t in times])
    target = top_down(*centre, 0.625, yaw=math.pi)
    hold = longest_hold(frankie, target, poses, dt)
    check(frankie, hold, target, poses, dt, (1.0,) * 6)
    assert len(hold.q) == len(poses)
    turned = hold.q[-1, 6] - hold.q[0, 6]
    assert abs(abs(turned) - math.pi) < 0.5  # the wrist undoes what the base turns


def test_keeps_off_itself_and_the_base(frankie):
    target, poses, dt = top_down(0.0, 0.45, 0.42), straight(), SPACING / 0.25
    usual = longest_hold(frankie, target, poses, dt, YAW_FREE)
    far = PairClass(name="arm_base", safe=0.17, influence=0.3)
    parameters = HoldParameters(pairs=PairClasses(arm_base=far))
    careful = longest_hold(frankie, target, poses, dt, YAW_FREE, parameters=parameters)
    nearest = min(distances(frankie, q)[1] for q in usual.q)
    assert nearest < 0.17  # there is something to keep off
    assert careful is None or min(distances(frankie, q)[1] for q in careful.q) >= 0.17
    wide = PairClass(name="self_collision", safe=0.9, influence=1.0)
    parameters = HoldParameters(pairs=PairClasses(self_collision=wide))
    assert longest_hold(frankie, target, poses, dt, YAW_FREE, parameters=parameters) is None


def test_out_of_reach_there_is_none(frankie):
    assert longest_hold(frankie, top_down(0.0, 1.5, 0.6), straight(), 0.02, YAW_FREE) is None


def test_does_not_hold_upside_down(frankie):
    up = top_down(0.0, 0.6, 0.6)
    up[:3, :3] = np.eye(3)  # the tool would have to point up
    poses = straight()
    hold = longest_hold(frankie, up, poses, 0.02, YAW_FREE)
    if hold is not None:
        check(frankie, hold, up, poses, 0.02, YAW_FREE)


def test_one_base_pose_is_a_hold_of_one(frankie):
    hold = longest_hold(frankie, top_down(0.15, 0.6, 0.6), np.zeros((1, 3)), 0.1, YAW_FREE)
    assert hold.first == hold.last == 0
    np.testing.assert_array_equal(hold.q[0], hold.q_anchor)


@pytest.mark.parametrize(("poses", "dt"), [(np.zeros((0, 3)), 0.1), (np.zeros((3, 3)), 0.0)])
def test_no_way_or_no_time_is_refused(frankie, poses, dt):
    with pytest.raises(InputError):
        longest_hold(frankie, top_down(0.0, 0.6, 0.6), poses, dt)


def test_same_input_same_answer(frankie):
    call = frankie, top_down(0.0, 0.5, 0.6), straight(), 0.02, YAW_FREE
    first, second = longest_hold(*call), longest_hold(*call)
    assert first.first == second.first
    np.testing.assert_array_equal(first.q, second.q)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_held_is_held_inside_all_limits(robot, seed):
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.02, 0.1)
    poses = arc(rng.uniform(0.1, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(0.5, 2.0), dt)
    somewhere = poses[rng.integers(len(poses))]
    lower, upper = np.maximum(robot.q_lower, -3.0), np.minimum(robot.q_upper, 3.0)
    # a pose that the arm has, turned a little
    target = robot.configuration(somewhere, rng.uniform(lower, upper)).T_world_tool
    target[:3, :3] = target[:3, :3] @ axis_angle(rng.normal(size=3), 0.01)
    weights = YAW_FREE if robot.n_arm >= 6 else POINT
    hold = longest_hold(robot, target, poses, dt, weights)
    if hold is not None:
        check(robot, hold, target, poses, dt, weights)
        own, base = np.min([distances(robot, q) for q in hold.q[::5]], axis=0)
        assert own >= 0.01 - 1e-9
        if len(robot.footprint) == 4:  # the other's body is narrower than its box
            assert base >= 0.02 - 1e-9


def test_what_is_turned_over_is_not_followed(frankie):
    arm, poses = arm_numbers(frankie), np.zeros((2, 3))
    right = top_down(0.6, 0.0, 0.6)
    q = np.empty((2, 7))
    q[0] = longest_hold(frankie, right, poses, 1.0, YAW_FREE).q[0]
    over = frankie.configuration(poses[0], q[0]).T_world_tool
    over[:3, 1:3] *= -1.0
    for target, last in ((right, 1), (over, 0)):
        targets, counted = np.array([right, target]), np.array(YAW_FREE)
        still = np.zeros(7)
        reached = follow(
            arm, targets, counted, 0.02, still, still, (1e-4, 1e-3), (0.01, 0.02), 0, 1, q
        )
        assert reached == last
