"""The benchmark of the local planner measures what it says."""

from __future__ import annotations

import numpy as np

from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.visibility import line_of_sight
from motm_wbc.experiments.bench.basenav_staa import children_per_s, random_tasks, random_world


def test_tasks_are_out_of_sight_and_within_their_distance() -> None:
    rng = np.random.default_rng(0)
    world = random_world(20, rng)
    assert len(world.solids) == 20
    planner = GlobalPlanner(world, 0.5, 1.745, 0.3, 0.2)
    for task in random_tasks(planner, 4, rng):
        assert 3.0 <= np.hypot(*(task.goal - task.start)[:2]) <= 6.0
        assert not line_of_sight(planner.inflated.walls, *task.start[:2], *task.goal[:2])
        assert planner.route(task.start, task.goal) is not None


def test_the_rate_is_a_number_of_children_a_second() -> None:
    assert 1e4 < children_per_s(20, 1) < 1e8
