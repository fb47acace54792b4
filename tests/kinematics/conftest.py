"""A small robot of many kinds of joints, beside the shipped one."""

from pathlib import Path

import pytest

from motm_wbc.kinematics import RobotModel, load_robot
from motm_wbc.scene.finder import robot_names

MINI_URDF = """<?xml version="1.0"?>
<robot name="mini">
  <link name="world"/>
  <link name="foot">
    <collision>
      <origin xyz="0 0 0.05"/><geometry><cylinder radius="0.05" length="0.1"/></geometry>
    </collision>
  </link>
  <link name="carriage"/>
  <link name="shoulder">
    <collision><geometry><sphere radius="0.06"/></geometry></collision>
  </link>
  <link name="upper">
    <collision>
      <origin xyz="0.15 0 0" rpy="0 1.57 0"/><geometry><box size="0.06 0.06 0.3"/></geometry>
    </collision>
  </link>
  <link name="bracket"/>
  <link name="wrist">
    <inertial>
      <mass value="0.3"/>
      <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><geometry><box size="0.1 0.04 0.04"/></geometry></collision>
  </link>
  <joint name="floor" type="fixed"><parent link="world"/><child link="foot"/></joint>
  <joint name="lift" type="prismatic">
    <origin xyz="0 0 0.1"/><parent link="foot"/><child link="carriage"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.4" velocity="0.2" effort="100"/>
  </joint>
  <joint name="turn" type="continuous">
    <origin xyz="0.02 0 0.1"/><parent link="carriage"/><child link="shoulder"/><axis xyz="0 0 1"/>
    <limit velocity="2" effort="100"/>
  </joint>
  <joint name="bend" type="revolute">
    <origin xyz="0.05 0 0" rpy="1.5707963267948966 0.2 0"/>
    <parent link="shoulder"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="2" effort="100"/>
  </joint>
  <joint name="stiff" type="revolute">
    <origin xyz="0.3 0 0" rpy="0 0.1 0"/>
    <parent link="upper"/><child link="bracket"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="2" effort="100"/><mimic joint="bend"/>
  </joint>
  <joint name="roll" type="continuous">
    <origin xyz="0.05 0.01 0"/><parent link="bracket"/><child link="wrist"/><axis xyz="1 0 0"/>
    <limit velocity="3" effort="100"/>
  </joint>
</robot>
"""

MINI_HEAD = """
self_pairs = [["foot", "wrist"]]
base_pairs = ["wrist"]
"""

MINI_TABLES = """
root = "a_foot"
prefix = "a_"
mount_xyz = [0.1, 0.02, 0.3]
mount_rpy = [0.0, 0.1, 0.7]
joints = ["a_lift", "a_turn", "a_bend", "a_roll"]
a_max = [1.0, 5.0, 5.0, 5.0]
home = [0.2, 0.0, 0.5, 0.0]
[arm.locked]
a_stiff = 0.6
[tool]
parent = "a_wrist"
xyz = [0.1, 0.0, 0.02]
rpy = [0.0, 1.5, 0.3]
[[capsules]]
name = "foot"
link = "a_foot"
a = [0.0, 0.0, 0.02]
b = [0.0, 0.0, 0.08]
radius = 0.08
part = "arm"
[[capsules]]
name = "wrist"
link = "a_wrist"
a = [-0.04, 0.0, 0.0]
b = [0.04, 0.0, 0.0]
radius = 0.04
part = "hand"
"""


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def mini_folder(write_robot, tmp_path: Path) -> Path:
    """A folder with the small robot's two files, to be spoilt."""
    write_robot(tmp_path, "mini", MINI_URDF, MINI_HEAD, MINI_TABLES)
    return tmp_path


@pytest.fixture(scope="session")
def frankie(_own_cache) -> RobotModel:
    return load_robot("frankie")


@pytest.fixture(scope="session")
def mini(_own_cache, write_robot, tmp_path_factory: pytest.TempPathFactory) -> RobotModel:
    folder = tmp_path_factory.mktemp("mini")
    write_robot(folder, "mini", MINI_URDF, MINI_HEAD, MINI_TABLES)
    return load_robot(folder)


@pytest.fixture(scope="session", params=[*robot_names(), "mini"])
def robot(request: pytest.FixtureRequest, _own_cache) -> RobotModel:
    """Each shipped robot, and the small one."""
    if request.param == "mini":
        return request.getfixturevalue("mini")
    return load_robot(request.param)
