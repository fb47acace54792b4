import re

import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.kinematics import load_description, load_robot
from motm_wbc.scene.finder import find_robot

FRANKIE = find_robot("frankie").read_text()


def broken(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("v_max = 0.5", "v_max = 50.0", r"base\.v_max: input should be less than or equal to 5"),
        ("height = 0.38", "height = 380", r"base\.height: .*less than or equal to 10 \(got 380\)"),
        ("omega_max = 1.745", "omega_max = 100", r"base\.omega_max: .*less than or equal to 10"),
        ("[0.15, 0.0, 0.38]", "[150, 0, 380]", r"arm\.mount_xyz: lengths are metres, at most 10"),
        ("bearing_limit = 2.618", "bearing_limit = 150", r"reach\.bearing_limit: .*3\.14"),
        ("v_reverse = 0.2", "v_revers = 0.2", r"base\.v_revers: .*did you mean 'v_reverse'"),
        ('joint = "panda_joint3"', 'joint = "panda_joint9"', r"preferences: unkno"),
        (
            'parent = "panda_hand"',
            'parent = "panda_hnd"',
            r"tool\.parent: unknown link 'panda_hnd';",
        ),
        (
            'link = "panda_link4"',
            'link = "link4"',
            r"capsules: link4: unknown link 'link4'; did you",
        ),
        ('link = "panda_leftfinger"', 'link = "left"', r"gripper\.fingers: unknown link 'left'"),
        (
            'joint = "panda_finger_joint2"',
            'joint = "panda_finger_joint3"',
            r"gripper\.fingers: unknown joint 'panda_finger_joint3'; did you mean",
        ),
        ("home = [0.0, -0.785", "home = [0.0, -45.0", r"arm\.home: panda_joint2 = -45 is outside"),
        ("value = 0.0\n", "value = 3.0\n", r"arm\.preferences: panda_joint3 = 3 is outside"),
        (
            "[0.8, 3.7525]",
            "[0.8, 4.0]",
            r"panda_joint6: \[0\.8, 4\] is not inside the URDF's range",
        ),
        ("[0.8, 3.7525]", "[0.8, 0.7]", r"limits: the range of 'panda_joint6' is empty"),
        ("15.0, 20.0, 20.0]", "15.0, 20.0]", r"arm: 'a_max' has 6 values for 7 joints"),
        ('"hand"', '"palm"', r"self_pairs: unknown capsule 'palm'"),
        ('name = "link1"', 'name = "link0"', r"capsules: 'link0' is named twice"),
        ("example-robot-data:", "ros:", r"arm\.urdf: unknown scheme 'ros'; legal: example-robot-d"),
        ("urdf/panda.urdf", "urdf/pando.urdf", r"arm\.urdf: no such file: .*pando\.urdf"),
        ("hold_radius = 0.72", "hold_radius = 0.8", r"'hold_radius' must not be larger"),
        ("width = 0.47\n", "", r"base: a base has either 'length' and 'width', or an 'outline'"),
        (
            "closing_axis = [0.0, 1.0",
            "closing_axis = [0.0, 2.0",
            r"closing_axis: an axis is a unit",
        ),
        ("approach_axis = [0.0, 0.0, 1.0", "approach_axis = [0.0, 1.0, 0.0", r"must be square to"),
        ('part = "hand"', 'part = "held"', r"capsules\[7\]: 'part' of a robot's capsule is"),
        ("value = 0.0\n", "", r"preferences\[0\]: a preference has a 'value', a 'lower' or"),
    ],
)
def test_a_wrong_file_gets_one_clear_line(tmp_path, old, new, message):
    path = tmp_path / "robot.toml"
    path.write_text(broken(FRANKIE, old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_joints_have_an_order(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(
        broken(FRANKIE, '"panda_joint1", "panda_joint2"', '"panda_joint2", "panda_joint1"')
    )
    with pytest.raises(InputError, match="from mount to tool is panda_joint1, panda_joint2,"):
        load_robot(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<robot name", "<robot nam<e", r"mini\.urdf: is not valid XML: "),
        (
            '<parent link="carriage"/>',
            '<parent link="carriag"/>',
            r"unknown link 'carriag'; did you",
        ),
        ('<link name="bracket"/>', '<link name="wrist"/>', "two links are named 'wrist'"),
        ('type="continuous"', 'type="floating"', r"joint 'a_turn' is floating; legal: revolute"),
        ('xyz="0.3 0 0"', 'xyz="0.3 zero 0"', r"a number that can't be read: could not convert"),
        ('<limit velocity="3" effort="100"/>', "", r"arm\.v_max: the URDF has no speed limit for"),
        ('<parent link="world"/>', '<parent link="wrist"/>', "'foot' hangs on a loop"),
        ('<child link="foot"/>', '<child link="wrist"/>', "2 links have no parent"),
        ('<sphere radius="0.06"/>', '<mesh filename="no.stl"/>', r"mesh not found: no\.stl"),
        (
            '<sphere radius="0.06"/>',
            '<mesh filename="package://p/no.stl"/>',
            "mesh not found: pack",
        ),
    ],
)
def test_a_wrong_urdf_gets_one_clear_line(mini_folder, old, new, message):
    path = mini_folder / "mini.urdf"
    path.write_text(broken(path.read_text(), old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(mini_folder)
    assert str(mini_folder) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("a_stiff = 0.6", "", r"'a_stiff' moves but is no arm joint and no finger; give it"),
        ("a_stiff = 0.6", "a_stiff = 0.6\na_roll = 0.0", r"'a_roll' has more than one role"),
        ('prefix = "a_"', 'prefix = ""', r"arm\.root: unknown link 'a_foot'"),
        ('parent = "a_wrist"', 'parent = "a_upper"', r"'a_roll' does not move the tool; lock it"),
        ("[arm.locked]", "[arm.limits]\na_turn = [0.0, 1.0]\n[arm.locked]", "no range to be narro"),
        ("[0.3, 0.0], ", "[0.1, 0.0], ", r"base: outline must be convex"),
        ("[0.3, 0.0], ", "[-0.3, 0.0], ", r"base: outline must be a simple polygon"),
    ],
)
def test_a_wrong_arm_gets_one_clear_line(mini_folder, old, new, message):
    path = mini_folder / "robot.toml"
    text = broken(path.read_text(), old, new)
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        load_robot(mini_folder)


def test_names_of_the_base_are_taken(mini_folder):
    path = mini_folder / "robot.toml"
    text = re.sub(r'"a_', '"', path.read_text()).replace("a_stiff", "stiff")
    path.write_text(text.replace('prefix = "', 'prefix = ""\n#').replace('root = "foot"\n', ""))
    with pytest.raises(InputError, match="'world' of the arm's URDF is a name that the base"):
        load_robot(mini_folder)


def test_limits_of_the_file_reach_the_model(frankie):
    assert frankie.q_lower[5] == 0.8
    assert frankie.q_upper[5] == 3.7525
    np.testing.assert_array_equal(frankie.a_max, [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
    np.testing.assert_allclose(frankie.v_max, [2.175] * 4 + [2.61] * 3)
    np.testing.assert_array_equal(frankie.posture.weight, [0, 0, 1, 0, 0, 0, 0])
    assert frankie.q_upper[3] == -0.6
    limits = frankie.base_limits
    assert (limits.v_max, limits.v_reverse, limits.omega_max) == (0.5, 0.2, 1.745)
    np.testing.assert_allclose(np.ptp(frankie.footprint, axis=0), [0.68, 0.47])


def test_speed_limits_can_be_given_in_the_file(mini_folder):
    path = mini_folder / "robot.toml"
    path.write_text(broken(path.read_text(), "home =", "v_max = [0.1, 1.0, 1.0, 1.0]\nhome ="))
    np.testing.assert_array_equal(load_robot(mini_folder).v_max, [0.1, 1.0, 1.0, 1.0])


def test_description_needs_no_urdf(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(broken(FRANKIE, "urdf/panda.urdf", "urdf/pando.urdf"))
    assert load_description(path).name == "frankie"
