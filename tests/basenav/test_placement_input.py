"""Base placement: its options, what it reports, and what it refuses."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from motm_wbc.basenav.choice import choose, rules_of
from motm_wbc.basenav.footprint_check import edge_map, outline_of, pose_is_clear
from motm_wbc.basenav.obstacle import Obstacle
from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.placement import REASONS, BasePlacement
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.polygons import disc, rectangle

FOOTPRINT = rectangle(0.68, 0.47)
LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
TABLE = disc(0.2, 12)
OBJECT, AFTER = np.zeros(2), np.array([3.0, 1.0])
START = np.array([-3.0, 0.0, 0.0])


def placement(obstacles=(TABLE,), boundary=None, **parameters):
    world = World(list(obstacles), boundary)
    return BasePlacement(world, FOOTPRINT, LIMITS, PlacementParameters(**parameters))


def test_each_option_can_be_switched_off():
    rules = rules_of(PlacementParameters())
    assert rules.tie_slack > 0.0
    assert rules.hold == 1.0
    assert rules_of(PlacementParameters(ties_to_next=False)).tie_slack == 0.0
    assert rules_of(PlacementParameters(hold=False)).hold == 0.0
    paper = PlacementParameters.paper()
    switches = (paper.hold, paper.ties_to_next, paper.price_wait, paper.stop_here, paper.next_ring)
    assert not any(switches)


def test_without_holding_the_last_choice_does_not_count():
    held, free = placement(), placement(hold=False)
    first = held.evaluate(START, OBJECT, None)
    near = np.flatnonzero(
        (first.costs <= first.costs[first.selected] + 0.09) & (np.arange(72) != first.selected)
    )
    assert near.size > 0
    previous = first.candidates[near[0]]
    assert held.evaluate(START, OBJECT, None, previous=previous).selected == near[0]
    assert free.evaluate(START, OBJECT, None, previous=previous).selected == first.selected


def test_reasons_are_words():
    result = placement([TABLE, rectangle(0.5, 0.5) + np.array([0.7, 0.0])]).evaluate(
        START, OBJECT, None
    )
    assert len(result.reasons) == 72
    assert set(result.reasons) == {"", "collision"}
    assert [REASONS.index(reason) for reason in result.reasons] == result.rejections.tolist()


def test_pushes_are_reported():
    beside = disc(0.1, 12) + AFTER + np.array([0.2, 0.0])
    literal = placement([TABLE, beside], next_ring=False)
    inside = literal.evaluate(np.array([-0.3, 0.0, 0.0]), OBJECT, AFTER)
    assert inside.robot_push == pytest.approx(0.2, abs=0.02)
    assert inside.next_push == pytest.approx(0.2, abs=0.02)
    ringed = placement([TABLE, beside]).evaluate(START, OBJECT, AFTER)
    assert ringed.robot_push == 0.0
    assert ringed.next_push == 0.0  # some pose about it is free


def test_a_world_without_anything_is_no_special_case():
    result = placement([]).evaluate(START, OBJECT, AFTER)
    assert (result.rejections == 0).all()
    straight = math.dist(START[:2], result.goal[:2]) / LIMITS.v_max
    assert straight <= result.leg1[result.selected] < straight + math.tau / LIMITS.omega_max


def test_nowhere_to_go_is_an_answer():
    filled = placement([rectangle(30.0, 30.0)]).evaluate(START, OBJECT, AFTER)
    assert set(filled.reasons) == {"collision"}
    assert filled.goal is None
    assert filled.path is None
    small = placement([TABLE], boundary=rectangle(0.5, 0.5)).evaluate(START, OBJECT, AFTER)
    assert small.selected == -1


def test_a_robot_at_a_candidate_is_there():
    ready = placement()
    goal = ready.evaluate(START, OBJECT, None).goal
    there = ready.evaluate(goal, OBJECT, None)
    assert there.leg1[there.selected] == pytest.approx(0.0, abs=1e-9)
    assert there.path.length == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(bad):
    ready = placement()
    with pytest.raises(InputError, match="pose: must be finite"):
        ready.evaluate(np.array([0.0, bad, 0.0]), OBJECT, None)
    with pytest.raises(InputError, match="object_xy: must be finite"):
        ready.evaluate(START, np.array([bad, 0.0]), None)
    with pytest.raises(InputError, match="next_xy: must be finite"):
        ready.evaluate(START, OBJECT, np.array([0.0, bad]))


def test_other_shapes_are_refused_and_lists_are_taken():
    ready = placement()
    with pytest.raises(InputError, match="pose: must be 3 numbers"):
        ready.evaluate(np.zeros(2), OBJECT, None)
    with pytest.raises(InputError, match="object_xy: must be 2 numbers"):
        ready.evaluate(START, np.zeros((2, 2)), None)
    listed = ready.evaluate([-3, 0, 0], [0, 0], [3, 1], previous=[0.6, 0, 1.57])
    plain = ready.evaluate(START, OBJECT, AFTER, previous=np.array([0.6, 0.0, 1.57]))
    assert listed.costs.tobytes() == plain.costs.tobytes()
    assert listed.selected == plain.selected


def test_what_the_caller_gave_stays_the_callers():
    ready = placement()
    pose, stop = np.array([-0.9, 0.0, 1.57]), np.array([-0.8, 0.0, 1.57])
    result = ready.evaluate(pose, OBJECT, None, stop_pose=stop)
    assert result.stop_here
    stop[:] = pose[:] = 7.0
    assert result.goal == pytest.approx([-0.8, 0.0, 1.57])
    assert result.path.points[0] == pytest.approx([-0.9, 0.0])


def test_what_is_kept_can_not_be_written_to_by_way_of_a_result():
    result = placement().evaluate(START, OBJECT, AFTER)
    for values in (result.candidates, result.leg2):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0
    result.goal[:] = 0.0  # a copy


def test_arrays_that_can_not_be_written_to_do_not_compile_anew():
    ready = placement()
    previous = ready.evaluate(START, OBJECT, AFTER).goal
    previous.flags.writeable = False
    known = len(choose.signatures)
    ready.evaluate(START, OBJECT, AFTER, previous=previous)
    assert len(choose.signatures) == known


@pytest.mark.parametrize("margin", [0.02, 0.1])
def test_a_pointed_footprint_is_checked_with_its_whole_margin(margin):
    nose = np.array([[0.9, 0.0], [-0.3, 0.12], [-0.3, -0.12]])
    outline = outline_of(nose)
    for x in np.arange(0.0, 1.2, 0.1):  # ahead of the nose of a candidate
        block = rectangle(0.05, 0.05) + np.array([0.6, 0.95 + x])
        world = World([block])
        found = BasePlacement(
            world, nose, LIMITS, PlacementParameters(footprint_margin=margin)
        ).evaluate(START, OBJECT, None)
        everything = edge_map(world.rings, False, 5.0)
        clear = [pose_is_clear(everything, outline, pose, margin) for pose in found.candidates]
        assert [reason != "collision" for reason in found.reasons] == clear


def test_a_wall_that_goes_round_everything_is_not_what_a_target_stands_on():
    tray = rectangle(0.4, 0.4) + AFTER
    room = Obstacle(rectangle(10.0, 10.0), holes=(rectangle(9.0, 9.0),))
    literal = {"next_ring": False, "radius": 0.8}
    within = placement([TABLE, tray, room], **literal).evaluate(START, OBJECT, AFTER)
    split = [rectangle(10.0, 0.5) + np.array([0.0, y]) for y in (-4.75, 4.75)]
    split += [rectangle(0.5, 10.0) + np.array([x, 0.0]) for x in (-4.75, 4.75)]
    apart = placement([TABLE, tray, *split], **literal).evaluate(START, OBJECT, AFTER)
    assert within.costs == pytest.approx(apart.costs, abs=1e-9)
    outside = placement([TABLE, tray, room], **literal).evaluate(
        START, OBJECT, np.array([7.0, 0.0])
    )
    assert not outside.next_reachable  # the wall is in the way, and stays there


@pytest.mark.parametrize(
    "wrong",
    [
        {"count": 3},
        {"radius": 0.0},
        {"headings": ()},
        {"headings": (9.0,)},
        {"headings": (0.0, math.tau)},
        {"weight": 0.9},
    ],
)
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(ValidationError):
        PlacementParameters(**wrong)


@pytest.mark.parametrize(
    "settings", [{"count": 4}, {"count": 360}, {"radius": 5.0}, {"radius": 0.01}]
)
def test_rings_of_any_size(settings):
    ready = placement(**settings)
    result = ready.evaluate(START, OBJECT, AFTER)
    assert len(result.candidates) == 2 * ready.parameters.count
    assert (
        result.costs.tobytes()
        == placement(**settings).evaluate(START, OBJECT, AFTER).costs.tobytes()
    )
