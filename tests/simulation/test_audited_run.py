"""Both plants under the audit: clean where nothing is wrong, and loud where something is."""

import numpy as np

from motm_wbc.audit import Audit
from motm_wbc.scene.solids import Obstacle

CUBE = np.array([0.0, 0.0, 0.625])
UP = np.array([0.0, 0.0, 0.1])


def pick_and_place(operator):
    point = operator.grasp_point()
    operator.reach(point + UP, 1.5)
    operator.reach(point, 0.8)
    operator.try_until_held()
    operator.reach(CUBE + UP)
    operator.reach(point + np.array([0.05, 0.03, 0.003]))
    operator.open(0.4)
    operator.reach(CUBE + np.array([0.05, 0.03, 0.1]))
    operator.base = (-0.4, 0.0)
    operator.wait(1.0)


def test_a_clean_pick_and_place_has_no_contact(operate, kind, model, beside_table):
    audit = Audit(model, beside_table)
    operator = operate(kind)
    operator.on_substep = audit.observe
    pick_and_place(operator)
    result = audit.result()
    assert result.episodes == ()
    assert abs(result.min_base_clearance_m - (0.75 - 0.34 - 0.2)) < 1e-3
    # The finger tips lie 9.5 mm below the tool's origin.
    tips = operator.plant.scenario.object("cube").grasp_height + 0.025 - 0.0095
    assert abs(result.min_arm_clearance_m - tips) < 4e-3
    assert audit.clearances().base > 0.55


def test_driving_into_the_table_is_seen(operate, kind, model, beside_table):
    audit = Audit(model, beside_table)
    operator = operate(kind)
    operator.on_substep = audit.observe
    operator.base = (0.3, 0.0)
    operator.wait(1.2)
    first = audit.result().episodes[0]
    assert (first.first, first.second) == ("base_link", "table")
    assert abs(first.start - 0.21 / 0.3) < 0.02
    assert audit.result().min_base_clearance_m < 1e-3


def test_an_arm_that_physics_stops_at_an_obstacle_is_seen(operate, kind, model, beside_table):
    post = Obstacle(name="post", shape="cylinder", radius=0.03, height=1.2, position=(-0.36, 0.22))
    scenario = beside_table.model_copy(update={"obstacles": (post,)})
    audit = Audit(model, scenario)
    operator = operate(kind, scenario)
    operator.on_substep = audit.observe
    arm = np.zeros(7)
    arm[0] = 0.6
    for _ in range(240):
        operator.step(arm)
    assert any(episode.second == "post" for episode in audit.result().episodes)


def test_a_held_object_that_hits_an_obstacle_is_seen(operate, kind, model, beside_table):
    post = Obstacle(
        name="post", shape="box", size=(0.02, 0.02, 0.737), position=(0.0, 0.27)
    )  # lower than the finger tips, higher than the cube's bottom
    scenario = beside_table.model_copy(update={"obstacles": (post,)})
    audit = Audit(model, scenario)
    operator = operate(kind, scenario)
    operator.on_substep = audit.observe
    point = operator.grasp_point()
    operator.reach(point + UP, 1.5)
    operator.reach(point, 0.8)
    operator.try_until_held()
    operator.reach([0.0, 0.0, 0.75])
    assert audit.result().collisions == 0
    operator.reach([0.0, 0.24, 0.75], 1.5)
    assert ("cube", "post") in {(e.first, e.second) for e in audit.result().episodes}
