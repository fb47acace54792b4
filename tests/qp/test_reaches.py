"""Random reaches in clutter: reached, without contact, inside the safe distances, at rest after."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from benchmarks import log, reaches
from benchmarks.reaching.chatter import high_share, most_reversals
from benchmarks.reaching.contact import ContactCheck
from benchmarks.reaching.distances import ExactDistances
from benchmarks.reaching.follow import followed_share
from benchmarks.reaching.path import StraightPath
from benchmarks.reaching.reach import Motion, Outcome, Variant, judge, move
from benchmarks.reaching.scenes import make_scene
from benchmarks.reaching.table import CHATTER, reason, table
from benchmarks.reaching.targets import find_target
from motm_wbc.kinematics.pair_search import segment_gap
from motm_wbc.qp import WholeBodyController, WholeBodyParameters

DT = 1.0 / 120.0
ROUNDING = 1e-3  # [m] that distances may pass the safe ones by


def check(outcomes):
    """What must hold of all reaches, and the shares that must get there."""
    text = table(outcomes)
    assert not any(outcome.contacts for outcome in outcomes), text
    assert min(outcome.margin for outcome in outcomes) >= -ROUNDING, text
    assert not any(outcome.limits_broken for outcome in outcomes), text
    assert max(outcome.reversals for outcome in outcomes) <= CHATTER, text
    reached = sum(outcome.reached for outcome in outcomes)
    assert reached >= 0.9 * len(outcomes), text
    at_once = [outcome for outcome in outcomes if outcome.reached and not outcome.regrouped]
    assert len(at_once) >= 0.75 * len(outcomes), text


def test_few_reaches():
    outcomes = [o for seed in range(8) for o in reaches.reaches_of_scene(seed, 3, Variant())]
    assert len(outcomes) >= 20
    check(outcomes)


def test_a_forearm_that_lies_along_a_board_does_not_shake():
    """Its nearest point jumps from end to end: with one row for both it went to and fro."""
    outcomes = reaches.reaches_of_scene(1012, 2, Variant())
    assert outcomes[1].reached and outcomes[1].reversals <= CHATTER


@pytest.mark.slow
def test_many_reaches():
    outcomes = [o for found in reaches.run(range(1000, 1030), 10, Variant(), 2) for o in found]
    assert len(outcomes) >= 290
    check(outcomes)


@pytest.fixture(scope="module")
def case(frankie):
    scene = make_scene(frankie, 3)
    distances = ExactDistances(frankie, scene.bodies)
    contact = ContactCheck(frankie, scene.bodies)
    target = find_target(frankie, scene, distances, 0)
    assert target is not None
    return scene, target, distances, contact


def test_a_scene_and_its_targets_follow_from_the_seed(frankie, case):
    scene, target, distances, _ = case
    again = make_scene(frankie, 3)
    assert [body.name for body in again.bodies] == [body.name for body in scene.bodies]
    for first, second in zip(scene.bodies, again.bodies, strict=True):
        assert np.array_equal(first.pose, second.pose)
    same = find_target(frankie, again, distances, 0)
    assert np.array_equal(same.T_world_target, target.T_world_target)
    other = find_target(frankie, again, distances, 1)
    assert not np.array_equal(other.T_world_target, target.T_world_target)


def test_a_target_that_counts_is_legal_and_at_its_pose(frankie, case):
    _, target, distances, contact = case
    for q in (target.q_start, target.q_found):
        assert distances.is_legal(q)
        assert contact.contacts(np.zeros(3), q) == []
    at = frankie.configuration(np.zeros(3), target.q_found)
    assert at.T_world_tool == pytest.approx(target.T_world_target, abs=2e-3)


def test_a_planted_board_is_seen_by_both_checks(frankie, case, box):
    """A board through the hand: margin, legality, free way and contact must all say so."""
    _, target, distances, contact = case
    at = frankie.configuration(np.zeros(3), target.q_found)
    x, y, z = at.link_pose("panda_hand")[:3, 3]
    board = box("planted", x, y, (0.05, 0.05, 0.05), bottom=z - 0.025)
    bodies = (*case[0].bodies, board)
    q = np.array([target.q_start, target.q_found])
    clear, blocked = distances, ExactDistances(frankie, bodies)
    assert clear.of_run(np.zeros((2, 3)), q).value >= 0.0
    margin = blocked.of_run(np.zeros((2, 3)), q)
    assert margin.value < -0.02
    assert margin.step == 1
    assert margin.pair.endswith("planted")
    assert not blocked.is_legal(target.q_found)
    path = StraightPath(
        frankie.configuration(np.zeros(3), target.q_start).T_world_tool, target.T_world_target
    )
    assert clear.is_free_for_hand(path.samples())
    assert not blocked.is_free_for_hand(path.samples())
    names = ContactCheck(frankie, bodies).contacts(np.zeros(3), target.q_found)
    assert any(name.endswith("planted") for name in names)
    assert contact.contacts(np.zeros(3), target.q_found) == []


def test_the_bound_leaves_no_pair_out(frankie, case):
    """The least margin over many configurations is the least over each by itself."""
    distances = case[2]
    rng = np.random.default_rng(0)
    q = rng.uniform(frankie.q_lower, frankie.q_upper, (40, frankie.n_arm))
    poses = rng.uniform(-0.1, 0.1, (40, 3))
    whole = distances.of_run(poses, q)
    each = [
        distances.of_run(pose[None], joints[None]) for pose, joints in zip(poses, q, strict=True)
    ]
    least = min(range(40), key=lambda k: each[k].value)
    assert whole.value == pytest.approx(each[least].value, abs=1e-12)
    assert whole.step == least


def test_own_distances_are_those_of_capsules(frankie):
    """Without a scene: coal's distances of the robot's capsules against the closed form."""
    distances = ExactDistances(frankie, ())
    q = np.random.default_rng(1).uniform(frankie.q_lower, frankie.q_upper, (50, frankie.n_arm))
    radius = frankie.capsules.radius
    for joints in q:
        margin = distances.of_run(np.zeros((1, 3)), joints[None])
        if margin.kind != "self_collision":
            continue
        ends = frankie.configuration(np.zeros(3), joints).capsule_segments()
        i, j = np.array(frankie.self_pairs).T
        apart = segment_gap(ends[i], ends[j])
        assert margin.value + 0.01 == pytest.approx((apart - radius[i] - radius[j]).min(), abs=1e-5)


def test_a_controller_that_ignores_the_scene_is_found_out(frankie):
    """The same reaches without bodies: margins and contact must fail in some."""
    bad = 0
    for seed in range(6):
        scene = make_scene(frankie, seed)
        checks = ExactDistances(frankie, scene.bodies), ContactCheck(frankie, scene.bodies)
        controller = WholeBodyController(frankie, DT)
        target = find_target(frankie, scene, checks[0], 0)
        motion, path = move(controller, replace(scene, bodies=()), target, Variant())
        outcome = judge(controller, target, scene, motion, path, checks)
        bad += outcome.margin < -ROUNDING
    assert bad >= 1


def test_limits_and_jumps_are_counted(frankie, case):
    scene, target, distances, contact = case
    controller = WholeBodyController(frankie, DT)
    motion, path = move(controller, scene, target, Variant())
    good = judge(controller, target, scene, motion, path, (distances, contact))
    assert good.limits_broken == 0
    jump = replace(motion.results[5], arm=motion.results[5].arm + 1.0)
    results = [*motion.results[:5], jump, *motion.results[6:]]
    bad = Motion(motion.base, motion.q, results, motion.errors)
    assert judge(controller, target, scene, bad, path, (distances, contact)).limits_broken == 2


def test_path_is_straight_and_its_derivatives_fit(frankie, case):
    _, target, _, _ = case
    T_start = frankie.configuration(np.zeros(3), target.q_start).T_world_tool
    path = StraightPath(T_start, target.T_world_target)
    assert path.at(-1.0).T_world_tool == pytest.approx(T_start, abs=1e-12)
    assert path.at(99.0).T_world_tool == pytest.approx(target.T_world_target, abs=1e-12)
    h = 1e-5
    for time in np.linspace(0.1, path.duration - 0.1, 7):
        low, at, high = (path.at(time + shift) for shift in (-h, 0.0, h))
        velocity = (high.T_world_tool[:3, 3] - low.T_world_tool[:3, 3]) / (2.0 * h)
        assert at.twist[:3] == pytest.approx(velocity, abs=1e-6)
        spin = (high.T_world_tool[:3, :3] @ low.T_world_tool[:3, :3].T) / (2.0 * h)
        axial = 0.5 * np.array(
            [spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]
        )
        assert at.twist[3:] == pytest.approx(axial, abs=1e-5)
        assert at.acceleration == pytest.approx((high.twist - low.twist) / (2.0 * h), abs=1e-4)


def test_chatter_is_told_from_a_smooth_motion():
    time = np.arange(480) * DT
    smooth = np.sin(np.pi * time / 4.0)[:, None] * np.array([1.0, -0.5])
    assert most_reversals(smooth, DT) == 0
    assert high_share(smooth, DT) < 1e-6
    shaken = smooth.copy()
    shaken[120:360, 1] = 0.1 * (-1.0) ** np.arange(240)
    assert most_reversals(shaken, DT) > 100
    assert high_share(shaken, DT) > 1e-3
    trembling = 0.01 * np.sin(2.0 * np.pi * 20.0 * time)[:, None]
    assert most_reversals(trembling, DT) == 0  # too slow to count
    assert high_share(trembling, DT) > 0.9  # seen here instead
    slow = 0.1 * np.sin(2.0 * np.pi * 2.0 * time)[:, None]
    assert most_reversals(slow, DT) in (4, 5)


def test_the_log_takes_up_where_it_stopped(tmp_path, frankie, case):
    scene, target, distances, contact = case
    controller = WholeBodyController(frankie, DT, WholeBodyParameters())
    motion, path = move(controller, scene, target, Variant())
    outcome = judge(controller, target, scene, motion, path, (distances, contact))
    first = [replace(outcome, scene=1, target=k) for k in range(2)]
    second = [replace(outcome, scene=2, target=k) for k in range(2)]
    file = tmp_path / "log.jsonl"
    assert log.read(file, Outcome) == []
    log.append(file, first)
    log.append(file, second)
    assert log.read(file, Outcome) == first + second
    torn = file.read_text()[:-7]
    file.write_text(torn)
    assert log.read(file, Outcome) == first
    assert log.read(file, Outcome) == first
    assert all(json.loads(line) for line in file.read_text().splitlines())
    assert asdict(log.read(file, Outcome)[0]) == asdict(first[0])


def test_the_way_of_a_reached_target_can_be_followed_and_a_walled_one_not(frankie, case, box):
    scene, target, distances, _ = case
    assert followed_share(frankie, scene, distances, target) == 1.0
    x, y, z = (
        0.5 * frankie.configuration(np.zeros(3), target.q_start).T_world_tool[:3, 3]
        + 0.5 * target.T_world_target[:3, 3]
    )
    wall = box("wall", x, y, (0.05, 0.05, 0.05), bottom=z - 0.025)
    walled = ExactDistances(frankie, (*scene.bodies, wall))
    assert 0.0 < followed_share(frankie, scene, walled, target) < 0.7


def test_reasons_are_named_by_kind(case, frankie):
    scene, target, distances, contact = case
    controller = WholeBodyController(frankie, DT)
    motion, path = move(controller, scene, target, Variant())
    outcome = judge(controller, target, scene, motion, path, (distances, contact))
    named = replace(outcome, held_back=("panda_joint6 at its limit", "link5 - shelf1_board2"))
    assert reason(named) == "arm and scene + joint limits"
    named = replace(outcome, held_back=("hand - base", "link2 - link5"))
    assert reason(named) == "arm and its own links + hand and the base's body"
    assert reason(replace(outcome, held_back=())).startswith("none")
