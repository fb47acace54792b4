"""The candidates' costs, pose by pose, against plans of their own and shapely's footprints."""

import math

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon

from benchmarks.exact.maps import KINDS, make_map, random_pose
from benchmarks.exact.sight import FreeSpace
from motm_wbc.basenav import BasePlacement, GlobalPlanner, PlacementParameters, World
from motm_wbc.basenav.placement import REASONS
from motm_wbc.errors import NoPath
from motm_wbc.geometry import polygons
from motm_wbc.geometry.base_motion import BaseLimits

FOOTPRINT = polygons.rectangle(0.68, 0.47)
MARGIN = 0.02
LEGAL, COLLISION, UNREACHABLE = (REASONS.index(why) for why in ("", "collision", "unreachable"))


def time_between(planner, start, goal):
    try:
        return planner.plan(tuple(start), tuple(goal)).time
    except NoPath:
        return math.inf


def blocked_by(world):
    """What the footprint may not overlap."""
    solids = [Polygon(solid.outline, solid.holes) for solid in world.solids]
    blocked = shapely.union_all(solids)
    if world.boundary is None:
        return blocked
    return blocked.union(Polygon(world.boundary).buffer(20.0).difference(Polygon(world.boundary)))


def overlap(pose, blocked):
    """Area of the grown footprint that lies in what is blocked [m^2]."""
    grown = polygons.rectangle(0.68 + 2 * MARGIN, 0.47 + 2 * MARGIN)
    return Polygon(polygons.place(grown, pose)).intersection(blocked).area


def scene(kind, seed, inflation, reverse):
    rng = np.random.default_rng([seed, *kind.encode()])
    drawn = make_map(kind, rng)
    world = World(drawn.obstacles[:12], drawn.boundary)
    region = world.inflated(inflation).region
    if world.bounded and region.is_empty:
        return scene(kind, seed + 1000, inflation, reverse)
    space = FreeSpace(region, world.bounded)
    robot = random_pose(rng, space, drawn.side)
    robot = np.array([*robot[:2], robot[2] or 0.0])
    object_xy, next_xy = rng.uniform(-0.4 * drawn.side, 0.4 * drawn.side, (2, 2))
    return world, robot, object_xy, next_xy


@pytest.mark.parametrize("reverse", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", KINDS)
def test_both_legs_are_those_of_single_plans(kind, seed, reverse):
    inflation = 0.2
    world, robot, object_xy, next_xy = scene(kind, seed, inflation, reverse)
    limits = BaseLimits(0.5, reverse, 1.745, 0.5, 2.0)
    parameters = PlacementParameters(
        count=6, inflation=inflation, footprint_margin=MARGIN, price_wait=False
    )
    placement = BasePlacement(world, FOOTPRINT, limits, parameters)
    result = placement.evaluate(robot, object_xy, next_xy)
    planner = GlobalPlanner(world, 0.5, 1.745, inflation, reverse)
    onward = BasePlacement(world, FOOTPRINT, limits, parameters).evaluate(robot, next_xy, None)
    goals = onward.candidates[onward.rejections != COLLISION]
    for pose, why, leg1, leg2, cost in zip(
        result.candidates,
        result.rejections,
        result.leg1,
        result.leg2,
        result.costs,
        strict=True,
    ):
        if why == COLLISION:
            assert math.isinf(cost)
            continue
        second = min((time_between(planner, pose, goal) for goal in goals), default=math.inf)
        assert leg2 == pytest.approx(second, abs=1e-9)
        first = time_between(planner, robot, pose)
        if why == UNREACHABLE:
            assert math.isinf(first) or (result.next_reachable and math.isinf(second))
        else:
            assert leg1 == pytest.approx(first, abs=1e-9)
            weighed = 1.05 * second if result.next_reachable else 0.0
            assert cost == pytest.approx(first + weighed, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_collisions_are_those_of_the_true_footprint(kind):
    world, robot, object_xy, _ = scene(kind, 7, 0.2, 0.0)
    blocked = blocked_by(world)
    limits = BaseLimits(0.5, 0.2, 1.745, 0.5, 2.0)
    parameters = PlacementParameters(inflation=0.2, footprint_margin=MARGIN)
    result = BasePlacement(world, FOOTPRINT, limits, parameters).evaluate(robot, object_xy, None)
    for pose, why in zip(result.candidates, result.rejections, strict=True):
        area = overlap(pose, blocked)
        if area == 0.0 or area > 1e-9:  # what barely touches may count as either
            assert (why == COLLISION) == (area > 0.0)
