"""An omnidirectional base, a lift, joints without end: nothing here may lean on the Panda."""

import numpy as np
import pytest

from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import NavigatedBase, ToolTask, WholeBodyController

URDF = """<?xml version="1.0"?>
<robot name="crane">
  <link name="foot"><collision><geometry><sphere radius="0.08"/></geometry></collision></link>
  <link name="carriage"/>
  <link name="upper"/>
  <link name="wrist"><collision><geometry><sphere radius="0.04"/></geometry></collision></link>
  <joint name="lift" type="prismatic"><parent link="foot"/><child link="carriage"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.4" velocity="0.2" effort="9"/></joint>
  <joint name="turn" type="continuous"><parent link="carriage"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit velocity="2" effort="9"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="wrist"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit velocity="2" effort="9"/></joint>
</robot>
"""
HEAD = """
self_pairs = [["foot", "wrist"]]
base_pairs = ["wrist"]
"""
TABLES = """
mount_xyz = [0.1, 0.0, 0.3]
joints = ["lift", "turn", "elbow"]
a_max = [1.0, 5.0, 5.0]
home = [0.2, 0.3, -0.6]
[tool]
parent = "wrist"
xyz = [0.3, 0.0, 0.0]
[[capsules]]
name = "foot"
link = "foot"
a = [0.0, 0.0, 0.0]
b = [0.0, 0.0, 0.1]
radius = 0.08
part = "arm"
[[capsules]]
name = "wrist"
link = "wrist"
a = [0.0, 0.0, 0.0]
b = [0.3, 0.0, 0.0]
radius = 0.04
part = "hand"
"""


@pytest.fixture(scope="module")
def crane(write_robot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("crane")
    write_robot(folder, "crane", URDF, HEAD, TABLES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTM_CACHE", str(folder))
        return load_robot(folder)


def task(*velocity, weights=(1, 1, 1, 0, 0, 0)):
    return ToolTask(
        np.array([*velocity, 0, 0, 0], dtype=float), weights=np.array(weights, dtype=float)
    )


def test_without_navigation_an_omnidirectional_base_goes_sideways(crane, closed_loop):
    run = closed_loop(model=crane, tool=task(0, 0.4, 0), follow=False, steps=600)
    assert run.inputs[:, 1].max() > 0.1 and run.base[-1][1] > 0.3
    end = run.results[-1]
    assert np.linalg.norm(end.slack[:3]) < 0.05
    assert (np.abs(run.inputs[:, :2]) <= 0.6).all()


def test_navigation_leads_and_its_sideways_input_stays_zero(crane, closed_loop):
    run = closed_loop(model=crane, tool=task(0, 0, 0.05), drive=[0.4, 0.0, 0.3], steps=240)
    np.testing.assert_allclose(run.inputs[-1], [0.4, 0.0, 0.3], atol=1e-9)
    assert (run.inputs[:, 1] == 0.0).all()
    assert run.rungs == {"full": 240}


def test_the_lift_stops_at_its_end_and_endless_joints_go_on(crane, closed_loop):
    run = closed_loop(model=crane, tool=task(0, 0, 0.5), steps=480)
    assert run.q[-1][0] == pytest.approx(0.4, abs=1e-6)
    spin = ToolTask(np.array([0, 0, 0, 0, 0, 2.0]), weights=np.array([0, 0, 0, 0, 0, 1.0]))
    run = closed_loop(model=crane, tool=spin, steps=1200)
    assert run.q[-1][1] + run.q[-1][2] > 4 * np.pi


def test_the_tool_stops_over_a_table(crane, closed_loop, box):
    table = box("table", 0.7, 0.0, (0.5, 0.9, 0.58), role=SolidRole.SUPPORT)
    run = closed_loop(model=crane, tool=task(0, 0, -0.15), bodies=[table], steps=600)
    # the support's distance, from the capsule's lower side
    assert run.clearance[-1] == pytest.approx(0.005, abs=1e-3)
    assert run.results[-1].clearance_pair == "wrist - table"


def test_the_summary_names_sideways_motion_and_endless_joints(crane):
    text = WholeBodyController(crane, 0.01).limits_summary()
    assert "v_y" in text and "speed -0.6 .. 0.6 m/s" in text
    assert "turn" in text and "continuous" in text


def test_wrong_sizes_for_this_robot_brake(crane):
    controller = WholeBodyController(crane, 0.01)
    result = controller.step(
        base_pose=np.zeros(3),
        q=crane.home,
        previous=(np.zeros(3), np.zeros(3)),
        base=NavigatedBase(np.zeros(2)),
    )
    assert result.rung == "brake"
    assert result.reason == "base reference has the shape (2,), needs (3,)"
