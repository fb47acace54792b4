"""Faults put into runs on purpose: each must be reported, and a clean run none."""

import math

import numpy as np
import pytest

from motm_wbc.audit import Audit, AuditParameters
from motm_wbc.scene.solids import Object, Obstacle, Support

TABLE_TOP = 0.6
CUBE = np.array([0.0, 0.0, 0.625])
BESIDE = np.array([-0.75, 0.0, 0.0])


def pairs(audit):
    return {(episode.first, episode.second) for episode in audit.result().episodes}


def test_a_clean_run_reports_none(model, scenario, make_world):
    """Drive to the table, fingers about the cube, lift, put down, retreat, drive away."""
    audit, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=np.array([-1.5, 0.0, 0.0]))
    world.drive(audit, BESIDE)
    world.swing(audit, world.reach(CUBE + np.array([0, 0, 0.1])))
    world.swing(audit, world.reach(CUBE))
    for width in np.linspace(0.08, 0.05, 50):
        audit.observe(world.at(gripper_width=float(width)))
    world.grasp("cube")
    world.swing(audit, world.reach(CUBE + np.array([0, 0, 0.1])))
    world.swing(audit, world.reach(CUBE + np.array([0.03, 0.03, 0.001])))
    for width in np.linspace(0.05, 0.08, 50):
        audit.observe(world.at(gripper_width=float(width), held=None, T_tool_held=None))
    world.swing(audit, model.home)
    world.drive(audit, [-1.5, 0.0, 0.0])
    result = audit.result()
    assert result.collisions == 0
    assert result.episodes == ()
    # From the base's front corner to the wall's near corner.
    assert result.min_base_clearance_m == pytest.approx(math.hypot(0.16, 0.015), abs=1e-5)
    # Finger tips lie 9.4 to 9.7 mm below the tool's origin, and that 25 mm above the table.
    assert 0.014 < result.min_arm_clearance_m < 0.017
    # The latest sample may be 50 ms old, at 0.75 m/s.
    last = math.hypot(0.91, 0.015)
    assert last - 0.038 < audit.clearances().base <= last + 1e-5


def test_a_table_moved_into_the_path(model, scenario, make_world):
    moved = tuple(
        support.model_copy(update={"position": (0.0, -0.8)}) if support.name == "table" else support
        for support in scenario.supports
    )
    cube = scenario.objects[0].model_copy(update={"position": (0.0, -0.8)})
    changed = scenario.model_copy(update={"supports": moved, "objects": (cube,)})
    audit, world = Audit(model, changed), make_world(changed)
    world.at(base_pose=np.array([-1.5, -1.0, 0.0]))
    world.drive(audit, [1.5, -1.0, 0.0])
    assert ("base_link", "table") in pairs(audit)
    as_planned, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=np.array([-1.5, -1.0, 0.0]))
    world.drive(as_planned, [1.5, -1.0, 0.0])
    assert as_planned.result().collisions == 0
    contact = audit.result().episodes[0]
    # The base's front, at 0.34 m, meets the table's edge, 0.2 m from its centre at y = 0.2.
    speed = 3.0 / 1.0
    reach = 0.2
    assert contact.start == pytest.approx((1.5 - 0.34 - reach) / speed, abs=0.02)
    assert contact.end - contact.start == pytest.approx(2 * (0.34 + reach) / speed, abs=0.02)
    assert audit.result().min_base_clearance_m == 0.0


def test_a_base_driven_over_the_tray(model, scenario, make_world):
    audit, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=np.array([-2.5, 2.0, 0.0]))
    world.drive(audit, [-1.6, 2.0, 0.0])
    assert audit.result().collisions == 0
    world.drive(audit, [-1.5, 2.0, 0.0])
    assert pairs(audit) == {("base_link", "tray")}
    assert audit.result().episodes[0].depth > 0.005


def test_an_arm_swept_through_the_wall(model, scenario, make_world):
    wall = scenario.obstacles[0].model_copy(update={"size": (0.5, 2.5, 1.2)})
    high = scenario.model_copy(update={"obstacles": (wall,)})
    beside = np.array([-0.6, 0.8, math.pi / 2])
    for scene, hit in ((scenario, False), (high, True)):
        audit, world = Audit(model, scene), make_world(scene)
        world.at(base_pose=beside)
        audit.observe(world.truth)
        assert audit.result().collisions == 0
        turned = np.array(model.home)
        turned[0] = -math.pi / 2
        world.swing(audit, turned)
        names = {pair for pair in pairs(audit) if pair[1] == "wall"}
        assert bool(names) is hit
        assert pairs(audit) == names
    assert {first for first, _ in names} == {"panda_link6", "panda_link7"}


def test_a_held_object_dragged_through_an_obstacle(model, scenario, make_world):
    """A thin post that only the held object can meet."""
    tool_height = 0.75
    post = Obstacle(name="post", shape="box", size=(0.02, 0.02, 0.737), position=(0.0, 0.30))
    changed = scenario.model_copy(update={"obstacles": (post,)})
    audit, world = Audit(model, changed), make_world(changed)
    world.at(base_pose=BESIDE)
    world.swing(audit, world.reach(CUBE + np.array([0, 0, 0.1])))
    world.swing(audit, world.reach(CUBE))
    world.grasp("cube")
    world.swing(audit, world.reach([0.0, 0.0, tool_height]))
    assert audit.result().collisions == 0
    world.drive(audit, BESIDE + np.array([0.0, 0.6, 0.0]))
    assert pairs(audit) == {("cube", "post")}
    assert audit.result().collisions == 1


def test_a_held_object_dragged_into_the_side_of_a_table(model, scenario, make_world):
    block = Support(name="block", shape="box", size=(0.2, 0.2, 0.75), position=(0.0, 0.45))
    changed = scenario.model_copy(update={"supports": (*scenario.supports, block), "obstacles": ()})
    audit, world = Audit(model, changed), make_world(changed)
    world.at(base_pose=BESIDE)
    world.swing(audit, world.reach(CUBE + np.array([0, 0, 0.1])))
    world.swing(audit, world.reach(CUBE))
    world.grasp("cube")
    world.swing(audit, world.reach([0.0, 0.0, 0.76]))  # its bottom is 15 mm below the block's top
    assert audit.result().collisions == 0
    world.drive(audit, BESIDE + np.array([0.0, 0.35, 0.0]))
    assert ("cube", "block") in pairs(audit)


def test_a_hand_pressed_onto_the_object(model, scenario, make_world):
    """Fingers may touch what can be picked; the hand's body may not."""
    tall = Object(name="tall", shape="box", size=(0.04, 0.04, 0.1), on="table")
    changed = scenario.model_copy(update={"objects": (tall,), "task": (), "obstacles": ()})
    audit, world = Audit(model, changed), make_world(changed)
    world.at(base_pose=BESIDE)
    world.swing(audit, world.reach([0.0, 0.0, 0.85]))
    world.swing(audit, world.reach([0.0, 0.0, 0.7]))
    assert audit.result().collisions == 0
    world.swing(audit, world.reach([0.0, 0.0, 0.63]))
    assert ("panda_hand", "tall") in pairs(audit)


def test_fingers_pushed_into_the_table(model, scenario, make_world):
    audit, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=BESIDE)
    world.swing(audit, world.reach(CUBE + np.array([0, 0.14, 0.1])))
    world.swing(audit, world.reach([0.0, 0.14, TABLE_TOP + 0.012]))
    assert audit.result().collisions == 0
    world.swing(audit, world.reach([0.0, 0.14, TABLE_TOP + 0.005]))
    assert pairs(audit) == {("panda_leftfinger", "table"), ("panda_rightfinger", "table")}


def test_an_arm_folded_into_its_own_base(model, scenario, make_world):
    audit, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=np.array([5.0, 5.0, 0.0]))
    world.swing(audit, [0.0, 0.5, 0.0, -2.9, 0.0, 2.4, 0.785])
    assert any(second == "base_link" or first == "base_link" for first, second in pairs(audit))


def test_a_hand_driven_into_the_floor(model, scenario, make_world):
    audit, world = Audit(model, scenario), make_world(scenario)
    world.at(base_pose=np.array([5.0, 5.0, 0.0]))
    world.swing(audit, world.reach([5.65, 5.0, 0.02]))
    assert audit.result().collisions == 0
    world.swing(audit, world.reach([5.65, 5.0, 0.005]))
    assert any(second == "floor" for _, second in pairs(audit))


def test_a_moving_obstacle_that_drives_into_the_robot(model, scenario, make_world):
    from motm_wbc.interfaces import MovingBody

    cart = Obstacle(
        name="cart", shape="box", size=(0.4, 0.4, 0.5), position=(7.0, 5.0),
        velocity=(-1.0, 0.0, 0.0),
    )  # fmt: skip
    changed = scenario.model_copy(update={"obstacles": (cart,)})
    audit, world = Audit(model, changed), make_world(changed)
    world.at(base_pose=np.array([5.0, 5.0, 0.0]))
    for _ in range(480):
        pose = np.array([7.0 - world.truth.time, 5.0, 0.0])
        audit.observe(world.at(moving={"cart": MovingBody(pose, np.array([-1.0, 0.0, 0.0]))}))
    assert ("base_link", "cart") in pairs(audit)
    assert audit.result().episodes[0].start == pytest.approx(2.0 - 0.34 - 0.2, abs=0.01)


def test_contact_that_comes_and_goes_is_counted_by_episodes(model, scenario, make_world):
    audit = Audit(model, scenario, AuditParameters(episode_gap=0.1))
    world = make_world(scenario)
    free, over = np.array([-2.5, 2.0, 0.0]), np.array([-1.5, 2.0, 0.0])
    for pose in (free, over, free, over):  # one physics step apart: one episode
        audit.observe(world.at(base_pose=pose))
    assert audit.result().collisions == 1
    for _ in range(30):
        audit.observe(world.at(base_pose=free))
    audit.observe(world.at(base_pose=over))
    assert audit.result().collisions == 2
