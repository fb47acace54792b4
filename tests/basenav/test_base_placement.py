"""Base placement: candidates, costs by the planner itself, and the choice."""

import math

import numpy as np
import pytest
from shapely.geometry import Polygon

from motm_wbc.basenav.choice import rules_of
from motm_wbc.basenav.choice import select as select_by
from motm_wbc.basenav.departure import departure_time, turn_is_clear
from motm_wbc.basenav.footprint_check import edge_map, outline_of
from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.placement import REASONS, BasePlacement
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.waiting import Wait
from motm_wbc.basenav.world import World
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.polygons import disc, place, rectangle

FOOTPRINT = rectangle(0.68, 0.47)
LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)
TABLE, TRAY = disc(0.2, 32), rectangle(0.4, 0.4) + np.array([-1.0, 2.0])
WALL = rectangle(0.5, 2.5) + np.array([0.0, 1.5])
OBJECT, DROP = np.zeros(2), np.array([-1.0, 2.0])
START = np.array([1.0, 2.0, -math.pi / 2])
ARM = ReachRegion(np.array([0.15, 0.0]), 0.75, math.radians(150.0))


def placement(obstacles=(TABLE, TRAY, WALL), parameters=None, boundary=None):
    return BasePlacement(World(list(obstacles), boundary), FOOTPRINT, LIMITS, parameters)


def test_candidates_are_tangential_on_the_ring_and_never_move():
    result = placement().evaluate(START, OBJECT, DROP, region=ARM)
    poses = result.candidates
    assert poses.shape == (72, 3)
    assert np.hypot(poses[:, 0], poses[:, 1]) == pytest.approx(np.full(72, 0.6))
    out = np.arctan2(poses[:, 1], poses[:, 0])
    turned = np.remainder(poses[:, 2] - out + math.pi, math.tau) - math.pi
    assert turned[0::2] == pytest.approx(np.full(36, math.pi / 2))
    assert turned[1::2] == pytest.approx(np.full(36, -math.pi / 2))


def test_collisions_are_those_of_the_true_footprint():
    result = placement().evaluate(START, OBJECT, DROP)
    solids = [Polygon(points) for points in (TABLE, TRAY, WALL)]
    near = np.array(
        [min(s.distance(Polygon(place(FOOTPRINT, p))) for s in solids) for p in result.candidates]
    )
    said = np.array([REASONS[code] == "collision" for code in result.rejections])
    assert said[near < 0.02 - 1e-9].all()
    assert not said[near > 0.02 * math.sqrt(2.0) + 1e-9].any()  # the margin's corners are sharp
    assert 10 < said.sum() < 40
    assert np.isinf(result.costs[said]).all()


@pytest.mark.parametrize("start", [START, [0.4, -0.2, 0.3], [-0.5, 1.0, 0.0], [-1.2, 2.0, 2.0]])
def test_legs_are_the_planners_own(start):
    start = np.array(start)
    ranked = placement()
    result = ranked.evaluate(start, OBJECT, DROP, region=ARM)
    assert (result.robot_push > 0.0) == (start[0] < 1.0)  # all but START are inside inflation
    onward = ranked.evaluate(start, DROP, None, region=ARM)
    targets = onward.candidates[onward.rejections == 0]
    legal = np.flatnonzero(result.rejections == 0)
    assert legal.size > 20
    for i in legal:
        pose = result.candidates[i]
        expected = cost_to_go(ranked.planner.goal_field(pose), *start)
        assert result.leg1[i] == pytest.approx(expected, abs=1e-9)
        times = [cost_to_go(ranked.planner.goal_field(goal), *pose) for goal in targets]
        assert result.leg2[i] == pytest.approx(min(times), abs=1e-9)
        assert result.costs[i] == pytest.approx(result.leg1[i] + 1.05 * result.leg2[i])


def test_the_goal_is_near_the_cheapest_and_its_path_leads_there():
    result = placement().evaluate(START, OBJECT, DROP, region=ARM)
    assert result.selected >= 0
    assert result.costs[result.selected] <= result.costs.min() + 0.15
    assert result.goal == pytest.approx(result.candidates[result.selected])
    assert result.path.points[0] == pytest.approx(START[:2])
    assert result.path.points[-1] == pytest.approx(result.goal[:2])
    assert result.path.time == pytest.approx(result.leg1[result.selected], abs=1e-9)
    # the drop lies behind the wall: the robot goes round the object to its far side
    assert result.goal[0] < -0.4


def test_a_step_costs_the_same_from_kept_data_as_from_scratch():
    kept = placement()
    kept.evaluate(START, OBJECT, DROP, region=ARM)
    later = np.array([0.8, 0.5, -1.8])
    again = kept.evaluate(later, OBJECT, DROP, region=ARM)
    fresh = placement().evaluate(later, OBJECT, DROP, region=ARM)
    assert again.costs.tobytes() == fresh.costs.tobytes()
    assert again.selected == fresh.selected


def test_without_a_next_target_the_nearest_in_time_is_chosen():
    result = placement().evaluate(START, OBJECT, None)
    assert not result.leg2.any()
    assert result.costs[result.selected] <= result.costs.min() + 0.15


def test_out_of_reach_is_measured_from_the_arm():
    ahead_only = ReachRegion(np.array([0.3, 0.0]), 0.62, math.pi)
    result = placement([TABLE]).evaluate(START, OBJECT, DROP, region=ahead_only)
    assert {REASONS[code] for code in result.rejections} == {"out of reach"}  # 0.67 m away
    assert result.selected == -1
    assert result.goal is None
    assert result.path is None


def test_unreachable_candidates_and_targets_are_said_so():
    pen = [rectangle(4.0, 0.2) + np.array([0, y]) for y in (-2, 2)]
    pen += [rectangle(0.2, 4.0) + np.array([x, 0]) for x in (-2, 2)]
    outside = np.array([5.0, 0.0, 0.0])
    result = placement([TABLE, *pen]).evaluate(outside, OBJECT, None)
    assert {REASONS[code] for code in result.rejections} == {"unreachable"}
    inside = np.array([1.0, 0.0, 0.0])
    result = placement([TABLE, *pen]).evaluate(inside, OBJECT, np.array([6.0, 0.0]))
    assert not result.next_reachable
    assert result.selected >= 0  # the object can be worked on all the same
    assert result.leg1[result.selected] <= result.leg1.min() + 0.15


def test_a_candidate_inside_anothers_inflation_stays_legal():
    beside = rectangle(0.2, 2.0) + np.array([1.05, 0.0])  # its inflation reaches to x = 0.65
    result = placement([TABLE, beside]).evaluate(np.array([0.0, -2.0, 0.0]), OBJECT, None)
    ahead = 0  # at angle 0, heading along y: 0.115 m clear of the wall's side
    assert result.rejections[ahead] == 0
    wide = PlacementParameters(inflation=0.36)
    pushed = placement([TABLE, beside], wide).evaluate(np.array([0.0, -2.0, 0.0]), OBJECT, None)
    assert pushed.rejections[ahead] == 0
    assert np.isfinite(pushed.leg1[ahead])


def test_the_literal_form_drives_to_the_drop_itself():
    literal = placement(parameters=PlacementParameters.paper())
    result = literal.evaluate(START, OBJECT, DROP)
    open_floor = GlobalPlanner(World([TABLE, WALL]), 0.5, 1.745, inflation=0.3, v_reverse=0.2)
    field = open_floor.goal_field((*DROP, None))
    for i in np.flatnonzero(result.rejections == 0):
        assert result.leg2[i] == pytest.approx(cost_to_go(field, *result.candidates[i]), abs=1e-9)
    assert result.selected == int(np.argmin(result.costs))


def test_stopping_is_chosen_only_where_it_is_cheapest():
    ranked = placement()
    wait = Wait(expected=3.0, restart=0.5, open_end=True)
    best = ranked.evaluate(START, OBJECT, DROP, region=ARM, wait=wait).goal
    stop = best + 0.2 * np.array([math.cos(best[2]), math.sin(best[2]), 0.0])
    offer = {"region": ARM, "stop_pose": stop, "wait": wait}
    near = ranked.evaluate(stop, OBJECT, DROP, **offer)
    assert near.stop_here
    assert near.selected == -1
    assert (near.goal == stop).all()
    assert near.stop_cost < near.costs.min()
    late = ranked.evaluate(stop, OBJECT, DROP, stop_time=30.0, **offer)
    assert not late.stop_here
    assert late.stop_cost == pytest.approx(near.stop_cost + 27.0)
    never = placement(parameters=PlacementParameters(stop_here=False))
    off = never.evaluate(stop, OBJECT, DROP, region=ARM, stop_pose=stop)
    assert off.stop_cost == math.inf
    assert off.selected >= 0


# --- the choice ---

POSES = np.array([[0.6, 0.0, 1.0], [0.5, 0.3, 1.2], [0.3, 0.5, 1.4], [0.0, 0.6, 1.6]])
DEFAULT = PlacementParameters()


def select(poses, costs, leg2, previous, parameters):
    nowhere = np.full(3, math.nan)
    return select_by(
        poses, costs, leg2, nowhere if previous is None else previous, rules_of(parameters)
    )


def test_ties_go_toward_the_next_target():
    costs, leg2 = np.array([10.0, 10.1, 10.2, 9.99]), np.array([5.0, 4.0, 1.0, 6.0])
    assert select(POSES, costs, leg2, None, DEFAULT) == 1
    assert select(POSES, costs, leg2, None, PlacementParameters(tie_slack=0.0)) == 3
    assert select(POSES, np.full(4, math.inf), leg2, None, DEFAULT) == -1


def test_the_last_choice_is_kept_unless_another_is_progress():
    costs, leg2 = np.array([10.0, 10.24, 10.2, 12.0]), np.array([5.0, 4.0, 6.0, 6.0])
    assert select(POSES, costs, leg2, None, DEFAULT) == 0
    assert select(POSES, costs, leg2, POSES[1], DEFAULT) == 0  # 0.24 dearer: given up
    costs[1] = 10.16  # out of the ties, yet within the hysteresis of the best
    assert select(POSES, costs, leg2, POSES[1], DEFAULT) == 0
    costs[1] = 10.09
    assert select(POSES, costs, leg2, POSES[0], DEFAULT) == 1  # progress is never held up
    costs[0], costs[1] = 10.0, 10.3
    leg2[1] = 6.0
    assert select(POSES, costs + np.array([0.05, 0, 0, 0]), leg2, POSES[2], DEFAULT) == 0
    far = np.array([9.0, 9.0, 0.0])
    assert select(POSES, costs, leg2, far, DEFAULT) == 0


# --- leaving a stop ---


def departure(obstacles, pose, goal, margin=0.02, v_reverse=0.2):
    world = World(obstacles)
    nav = GlobalPlanner(world, 0.5, 1.745, inflation=0.3, v_reverse=v_reverse)
    outline = outline_of(FOOTPRINT)
    edges = edge_map(world.rings, False, outline.radius + 2 * margin)
    field, routes = nav.solve(np.array([goal]))
    time, way = departure_time(field, routes, edges, outline, *pose, margin, 1e9)
    assert way >= math.dist(pose[:2], goal[:2])
    return time, cost_to_go(field, *pose)


def test_on_open_floor_leaving_is_turning_and_driving():
    found, planned = departure([TABLE], (2.0, 0.0, 1.0), (5.0, 1.0, 0.0))
    assert found == pytest.approx(planned, abs=1e-8)


def test_on_the_ring_the_base_cannot_turn_and_pulls_out_first():
    pose, goal = (0.6, 0.0, -math.pi / 2), (3.0, 0.0, 0.0)
    outline = outline_of(FOOTPRINT)
    edges = edge_map([TABLE], False, 0.5)
    assert not turn_is_clear(edges, outline, *pose, 0.0, 0.02)
    assert turn_is_clear(edges, outline, *pose, -math.pi / 2 + 0.1, 0.02)
    found, planned = departure([TABLE], pose, goal)
    assert planned + 0.1 < found < planned + 3.0


def test_a_stop_without_a_way_out_is_infinite():
    sides = [rectangle(1.4, 0.3) + np.array([0, y]) for y in (-0.5, 0.5)]
    ends = [rectangle(0.3, 1.4) + np.array([x, 0]) for x in (-0.6, 0.6)]
    found, _ = departure([*sides, ends[0]], (0.0, 0.0, math.pi), (5.0, 0.0, 0.0))
    assert np.isfinite(found)  # nose in: it backs out
    found, _ = departure([*sides, ends[0]], (0.0, 0.0, math.pi), (5.0, 0.0, 0.0), v_reverse=0.0)
    assert found == math.inf
    found, _ = departure([*sides, *ends], (0.0, 0.0, math.pi), (5.0, 0.0, 0.0))
    assert found == math.inf


# --- reach ---


def test_reach_is_a_sector_about_the_arms_base():
    region = ReachRegion(np.array([0.15, 0.0]), 0.75, math.radians(150.0))
    pose = np.array([1.0, 2.0, math.pi / 2])  # the arm's base is at (1, 2.15)
    assert region.contains(pose, np.array([1.0, 2.89]))
    assert not region.contains(pose, np.array([1.0, 2.91]))
    assert region.contains(pose, np.array([0.3, 2.15]))
    assert not region.contains(pose, np.array([1.0, 1.5]))  # straight behind
    assert region.contains(pose, np.array([1.4, 1.66]))  # 140 deg to the right
    assert not region.contains(pose, np.array([1.2, 1.66]))  # 158 deg
