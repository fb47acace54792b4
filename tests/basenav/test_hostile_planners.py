"""Degenerate and hostile input for placement and the local planner: errors or safe answers."""

import faulthandler
import math
import sys
import time

import numpy as np
import pytest
from pydantic import ValidationError

from motm_wbc.basenav import (
    BasePlacement,
    GlobalPlanner,
    Obstacle,
    PlacementParameters,
    StaaParameters,
    StaaStar,
    World,
)
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.placement import REASONS
from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.base_motion import BaseLimits

SECONDS = 1.0  # that any call may take
BOX = polygons.rectangle(0.68, 0.47)
TABLE = polygons.disc(0.2)
ROOM = polygons.rectangle(10.0, 10.0)
PEN = Obstacle(polygons.rectangle(8.0, 8.0), (polygons.rectangle(4.0, 4.0),))
LIMITS = {"v_max": 0.5, "v_reverse": 0.2, "omega_max": 1.745, "a_max": 0.5, "alpha_max": 2.0}
COLLISION = REASONS.index("collision")
nan, inf = math.nan, math.inf


@pytest.fixture(autouse=True)
def watchdog():
    faulthandler.dump_traceback_later(300.0, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture(autouse=True, scope="module")
def compiled():
    evaluate()
    drive()


def bounded(call, seconds=SECONDS):
    began = time.process_time()
    try:
        return call()
    finally:
        assert time.process_time() - began < seconds


def placement(world=None, footprint=BOX, limits=None, **options):
    world = World([TABLE]) if world is None else world
    limits = BaseLimits(**(limits or LIMITS))
    return BasePlacement(world, footprint, limits, PlacementParameters(**options))


def evaluate(world=None, robot=(-3.0, 0.0, 0.0), target=(0.0, 0.0), onward=(4.0, 0.0), **more):
    robot, target = np.array(robot, dtype=float), np.array(target, dtype=float)
    onward = None if onward is None else np.array(onward, dtype=float)
    options = {key: more.pop(key) for key in list(more) if key in PlacementParameters.model_fields}
    return placement(world, **options).evaluate(robot, target, onward, **more)


def staa(world=None, footprint=BOX, limits=None, **options):
    world = World([TABLE]) if world is None else world
    planner = GlobalPlanner(world, 0.5, 1.745, 0.3, 0.2)
    limits = BaseLimits(**(limits or LIMITS))
    return StaaStar(world, footprint, limits, StaaParameters(**options), planner)


def drive(world=None, pose=(-3.0, 0.0, 0.0), v=0.0, omega=0.0, goal=(3.0, 0.0, 0.0), stop=False):
    goal = Goal(np.array(goal, dtype=float), stop)
    return staa(world).plan(np.array(pose, dtype=float), v, omega, goal)


FOOTPRINTS = {
    "two points": [[0, 0], [1, 1]],
    "on a line": [[0, 0], [1, 0], [2, 0]],
    "concave": [[0, 0], [2, 0], [2, 1], [1, 0.2], [0, 1]],
    "crossing itself": [[0, 0], [1, 1], [1, 0], [0, 1]],
    "NaN": [[0, 0], [1, nan], [1, 1]],
    "infinite": [[0, 0], [1, inf], [1, 1]],
    "empty": [],
    "no area": BOX * 1e-9,
    "three columns": np.zeros((4, 3)),
    "nothing": None,
    "text": "abc",
    "ragged": [[0, 0], [1]],
}


@pytest.mark.parametrize("footprint", FOOTPRINTS.values(), ids=FOOTPRINTS)
@pytest.mark.parametrize("make", [placement, staa])
def test_what_is_no_footprint_is_named(make, footprint):
    with pytest.raises(InputError) as caught:
        bounded(lambda: make(footprint=footprint))
    assert caught.value.where == "footprint"
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("footprint", [BOX[::-1], BOX.tolist(), np.repeat(BOX, 2, axis=0)])
def test_odd_boxes_are_boxes(footprint):
    robot, target = np.array([-3.0, 0.0, 0.0]), np.zeros(2)
    plain = placement().evaluate(robot, target, None)
    found = bounded(lambda: placement(footprint=footprint).evaluate(robot, target, None))
    assert np.array_equal(found.rejections, plain.rejections)
    goal = Goal(np.array([3.0, 0.0, 0.0]))
    plans = [staa(footprint=outline).plan(robot, 0.0, 0.0, goal) for outline in (BOX, footprint)]
    assert plans[0].acceleration == plans[1].acceleration


@pytest.mark.parametrize("number", [nan, inf, -1.0, None, "a"])
@pytest.mark.parametrize("name", LIMITS)
@pytest.mark.parametrize("make", [placement, staa])
def test_limits_out_of_range_are_named(make, name, number):
    with pytest.raises(InputError) as caught:
        bounded(lambda: make(limits={**LIMITS, name: number}))
    assert caught.value.where == name


@pytest.mark.parametrize("name", ["v_max", "omega_max", "a_max", "alpha_max"])
@pytest.mark.parametrize("make", [placement, staa])
def test_limits_of_zero_are_named(make, name):
    with pytest.raises(InputError) as caught:
        bounded(lambda: make(limits={**LIMITS, name: 0.0}))
    assert caught.value.where == name


PARAMETERS = [
    *(("count", value) for value in (0, 3, 361, 10**9, 2.5, nan)),
    *(("radius", value) for value in (0.0, -1.0, nan, inf, 1e9)),
    *(("weight", value) for value in (0.5, nan, inf)),
    *(("inflation", value) for value in (-0.1, nan, inf)),
    *(("footprint_margin", value) for value in (-0.1, nan)),
    ("bogus", 1),
]


@pytest.mark.parametrize(("name", "value"), PARAMETERS)
def test_parameters_out_of_range_are_named(name, value):
    with pytest.raises(ValidationError, match=name):
        PlacementParameters(**{name: value})


@pytest.mark.parametrize("options", [{"count": 4}, {"count": 360}, {"radius": 5.0}])
def test_extreme_parameters_give_candidates(options):
    found = bounded(lambda: evaluate(**options))
    assert found.selected >= 0
    assert np.isfinite(found.costs[found.selected])


@pytest.mark.parametrize("options", [{"radius": 1e-9}, {"inflation": 5.0, "onward": None}])
def test_extreme_parameters_that_leave_no_candidate_say_so(options):
    found = bounded(lambda: evaluate(**options))
    assert found.costs.shape == (72,)
    assert (found.rejections[~np.isfinite(found.costs)] != 0).all()


NOWHERE = {
    "robot at NaN": {"robot": (nan, 0.0, 0.0)},
    "robot at infinity": {"robot": (inf, 0.0, 0.0)},
    "object at NaN": {"target": (nan, 0.0)},
    "object at infinity": {"target": (inf, 0.0)},
    "next at NaN": {"onward": (nan, 0.0)},
}


@pytest.mark.parametrize("query", NOWHERE.values(), ids=NOWHERE)
def test_no_goal_is_made_of_what_is_not_finite(query):
    """An error, or no goal: never one that looks good."""
    try:
        found = bounded(lambda: evaluate(**query))
    except InputError as error:
        assert error.where
        return
    assert found.goal is None or np.isfinite(found.goal).all()
    assert np.isfinite(found.costs[found.rejections == 0]).all()
    if "onward" not in query:
        assert found.selected == -1


def test_a_robot_without_heading_is_named():
    with pytest.raises(InputError, match="pose: must be finite numbers"):
        bounded(lambda: evaluate(robot=(-3.0, 0.0, nan)))


def test_wrong_shapes_are_named():
    for query in ({"robot": (0.0, 0.0)}, {"target": (0.0,)}, {"onward": 0.0}):
        with pytest.raises(InputError):
            bounded(lambda query=query: evaluate(**query))


HOPELESS = {
    "a filled room": (World([polygons.rectangle(40, 40)], ROOM), (0, 0, 0), (0, 0)),
    "a room smaller than the disc": (World([], 0.05 * ROOM), (0, 0, 0), (0, 0)),
    "object walled in": (World([PEN]), (7, 0, 0), (0, 0)),
    "object outside": (World([], ROOM), (0, 0, 0), (9, 0)),
    "robot walled in": (World([PEN]), (0, 0, 0), (7, 0)),
}


@pytest.mark.parametrize(("world", "robot", "target"), HOPELESS.values(), ids=HOPELESS)
def test_where_no_candidate_can_be_reached_each_says_why(world, robot, target):
    found = bounded(lambda: evaluate(world, robot, target, None))
    assert found.selected == -1
    assert found.goal is None
    assert (found.rejections != 0).all()


@pytest.mark.parametrize("robot", [(0.05, 0.0, 0.0), (0.3, 0.0, 1.0), (0.499, 0.0, 3.0)])
def test_a_robot_in_the_inflation_is_pushed_out_and_finds_a_goal(robot):
    found = bounded(lambda: evaluate(robot=robot))
    assert found.robot_push == pytest.approx(0.5 - robot[0], abs=0.02)
    assert found.selected >= 0


@pytest.mark.parametrize("offset", [1e5, 1e6])
def test_far_from_the_origin_costs_are_the_same(offset):
    found = bounded(
        lambda: evaluate(
            World([TABLE + offset]),
            (offset - 3.0, offset, 0.0),
            (offset, offset),
            (offset + 4.0, offset),
        )
    )
    plain = evaluate()
    both = np.isfinite(plain.costs) & np.isfinite(found.costs)
    assert both.sum() >= 60
    assert found.costs[both] == pytest.approx(plain.costs[both], abs=1e-5)


BRAKES = {
    "pose NaN": {"pose": (nan, 0.0, 0.0), "v": 0.3},
    "pose infinite": {"pose": (inf, 0.0, 0.0)},
    "heading NaN": {"pose": (-3.0, 0.0, nan)},
    "v NaN": {"v": nan},
    "omega infinite": {"omega": inf},
    "goal NaN": {"goal": (nan, 0.0, 0.0)},
    "goal infinite": {"goal": (0.0, inf, 0.0)},
    "goal's heading NaN": {"goal": (3.0, 0.0, nan)},
    "start in an obstacle": {"pose": (0.0, 0.0, 0.0)},
    "start outside": {"world": World([], ROOM), "pose": (9.0, 0.0, 0.0)},
    "a filled room": {"world": World([polygons.rectangle(40, 40)], ROOM)},
    "goal walled in": {"world": World([PEN]), "pose": (7.0, 0.0, 0.0), "goal": (0.0, 0.0, 0.0)},
}


@pytest.mark.parametrize("query", BRAKES.values(), ids=BRAKES)
def test_where_nothing_can_be_planned_the_base_brakes(query):
    plan = bounded(lambda: drive(**query))
    assert plan.emergency
    assert not plan.reached
    assert_sound(plan, query.get("v", 0.0))


DRIVES = {
    "goal in an obstacle": {"goal": (0.0, 0.0, 0.0)},
    "goal outside": {"world": World([], ROOM), "goal": (9.0, 0.0, 0.0)},
    "goal 1 cm inside the inflation": {"goal": (-0.49, 0.0, 0.0), "stop": True},
    "goal 100 km away": {"goal": (1e5, 0.0, 0.0)},
    "goal beyond doubles' squares": {"goal": (1e300, 0.0, 0.0)},
    "start equals goal": {"goal": (-3.0, 0.0, 0.0), "stop": True},
    "start equals goal, other heading": {"goal": (-3.0, 0.0, 3.0), "stop": True},
    "far from all": {"pose": (1e5, 1e5, 0.0)},
    "faster than allowed": {"v": 1e9},
    "heading 1e9": {"pose": (-3.0, 0.0, 1e9)},
    "an empty world": {"world": World([])},
    "a world 10 km wide": {"world": World([TABLE, TABLE + 1e4])},
}


@pytest.mark.parametrize("query", DRIVES.values(), ids=DRIVES)
def test_odd_drives_have_sound_commands(query):
    plan = bounded(lambda: drive(**query))
    assert_sound(plan, min(query.get("v", 0.0), 0.5))


def assert_sound(plan, v):
    """Finite, within the limits, and what follows is, too."""
    a, alpha = plan.acceleration
    assert abs(a) <= LIMITS["a_max"] + 1e-12
    assert abs(alpha) <= LIMITS["alpha_max"] + 1e-12
    if math.isfinite(v):
        assert -0.2 - 1e-9 <= v + 0.05 * a <= 0.5 + 1e-9
    for rows in (plan.poses, plan.velocities, plan.braking):
        assert np.isfinite(rows).all()
