"""Closed loops in the cases that make a reactive controller shake, creep or bump."""

import numpy as np
import pytest
import shapely

from motm_wbc.geometry import polygons
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import ToolTask


def reversals(velocities, least=0.003):
    """Most changes of direction of a joint, of swings that are larger than `least` [rad/s]."""
    counts = []
    for v in velocities.T:
        turns, extreme, rising = 0, v[0], True
        for value in v:
            if rising and value < extreme - least:
                turns, rising, extreme = turns + 1, False, value
            elif not rising and value > extreme + least:
                turns, rising, extreme = turns + 1, True, value
            extreme = max(extreme, value) if rising else min(extreme, value)
        counts.append(turns)
    return max(counts)


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
@pytest.mark.parametrize("away", [(0.6, 0.0, 0.3), (0.4, 0.8, -0.3), (-0.2, -0.6, 0.4)])
def test_the_arm_comes_to_rest_at_a_target_out_of_reach(frankie, closed_loop, away, solver):
    T = frankie.configuration(np.zeros(3), frankie.home).T_world_tool.copy()
    T[:3, 3] += away
    run = closed_loop(tool=ToolTask(T_world_target=T), steps=960, solver=solver)
    end = frankie.configuration(run.base[-1], run.q[-1]).T_world_tool[:3, 3]
    assert np.linalg.norm(end - T[:3, 3]) > 0.05  # it really is out of reach
    assert run.rungs == {"full": 960}
    assert reversals(run.arm[-240:]) <= 2
    assert np.abs(run.arm[-60:]).max() < 0.05


def test_a_fast_tool_keeps_its_distance_to_a_table(frankie, closed_loop, box):
    """Points move on curves: what a step adds to them must not add up at the safe distance."""
    table = box("table", 0.6, 0.0, (0.5, 1.6, 0.45), role=SolidRole.SUPPORT)

    def sweep(here):
        x, y = here.T_world_tool[:2, 3] - [0.15, 0.0]
        return ToolTask(np.array([-0.9 * y, 0.9 * x, -0.3, 0, 0, 0.9]))  # round the mount, and down

    q = frankie.home.copy()
    q[0] = -1.2
    run = closed_loop(tool=sweep, bodies=[table], steps=260, q=q)
    near = [r.clearance for r in run.results if "table" in r.clearance_pair]
    assert min(near) < 0.02  # it gets there
    assert min(near) >= 0.005 - 1e-3
    assert np.abs(run.arm).max() > 1.0


@pytest.mark.parametrize("side", [0.0, 0.4])
def test_without_navigation_the_base_keeps_off_what_stands_about(frankie, closed_loop, box, side):
    block = box("block", 1.2, side, (0.3, 0.5, 0.25))  # lower than the arm, not than the base

    def ahead(here):
        T = here.T_world_tool.copy()
        T[:3, 3] = [2.0, 0.0, 0.6]
        return ToolTask(T_world_target=T)

    run = closed_loop(tool=ahead, bodies=[block], steps=1800, follow=False)
    solid = shapely.Polygon(polygons.place(block.outlines[0], block.pose))
    gaps = [
        solid.distance(shapely.Polygon(polygons.place(frankie.footprint, pose)))
        for pose in run.base
    ]
    assert max(pose[0] for pose in run.base) > 0.3  # it tried
    assert 0.04 < min(gaps) < 0.2
