from motm_wbc.kinematics import summarise


def test_card_states_every_limit(frankie):
    rows = dict(summarise(frankie))
    assert rows["robot"] == "frankie: Panda arm on a differential-drive box base"
    assert rows["base limits"] == "0.5 m/s ahead, 0.2 m/s back, 1.745 rad/s, 0.5 m/s^2, 2 rad/s^2"
    assert rows["footprint"] == "0.68 x 0.47 m, 4 corners, 0.38 m high"
    assert rows["panda_joint6"] == "[0.8, 3.7525] rad or m, 2.61 /s, 20 /s^2, home 1.571"
    assert "0.75 m" in rows["reach"] and "+-150 deg" in rows["reach"]
    assert all(joint in rows for joint in frankie.arm_joints)


def test_card_of_a_robot_with_continuous_joints(mini):
    rows = dict(summarise(mini))
    assert rows["base"] == "omnidirectional, inputs v_x, v_y, omega"
    assert rows["a_turn"].startswith("continuous")
    assert rows["robot"] == "mini"
