import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.errors import UnknownName
from motm_wbc.geometry import se2
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import (
    FreeBase,
    HeldObject,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    shapes_from_scene,
)
from motm_wbc.scene.scenario import load_scenario

DT = 1.0 / 120.0
REST = np.zeros(2), np.zeros(7)


def jitter(values):
    """Largest number of turning points of any column in the last second."""
    steps = np.diff(values[-120:], axis=0)
    steps = np.where(np.abs(steps) < 1e-3, 0.0, steps)
    return int((np.diff(np.sign(steps), axis=0) != 0).sum(axis=0).max())


@pytest.fixture
def controller(frankie):
    return WholeBodyController(frankie, DT)


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
def test_the_tool_follows_its_twist_while_the_base_drives(frankie, solver):
    controller = WholeBodyController(frankie, DT, solver=solver)
    last, q, pose = (np.array([0.3, 0.1]), np.zeros(7)), frankie.home, np.zeros(3)
    reference = np.array([0.3, 0.1])
    tool = ToolTask(np.array([0.1, 0.05, -0.05, 0.0, 0.0, 0.0]))
    for _ in range(60):
        result = controller.step(
            base_pose=pose, q=q, previous=last, tools=[tool], base=NavigatedBase(reference)
        )
        last = result.base, result.arm
        before = frankie.configuration(pose, q).T_world_tool[:3, 3]
        q, pose = q + result.arm * DT, se2.integrate_twist(pose, *[0.3, 0.0, 0.1], DT)
    moved = (frankie.configuration(pose, q).T_world_tool[:3, 3] - before) / DT
    np.testing.assert_allclose(moved, [0.1, 0.05, -0.05], atol=3e-3)
    np.testing.assert_allclose(result.slack, 0.0, atol=3e-3)
    assert result.rung == "full" and result.scale == 1.0 and result.active == ()
    assert np.array_equal(result.base, reference)


def test_the_first_step_from_rest_is_within_acceleration(controller, frankie):
    result = controller.step(
        base_pose=np.zeros(3),
        q=frankie.home,
        previous=REST,
        tools=[ToolTask(np.array([1.0, -1.0, 0.5, 0.0, 0.0, 2.0]))],
        base=NavigatedBase(np.array([0.5, 1.0])),
    )
    assert result.rung == "full"
    assert np.abs(result.arm / (frankie.a_max * DT)).max() == pytest.approx(1.0)
    np.testing.assert_allclose(result.base, [1, 2] * np.array(result.base[0]), rtol=1e-9)
    assert result.base[0] == pytest.approx(0.5 * DT, rel=1e-5)
    assert "panda_joint1 acceleration" in result.active
    assert "base v acceleration" in result.active


def test_free_axes_are_free(frankie):
    controller = WholeBodyController(frankie, DT)
    yaw = np.array([0, 0, 0, 0, 0, 1.5])
    results = {}
    for weight in (1.0, 0.0):
        controller.reset()
        results[weight] = controller.step(
            base_pose=np.zeros(3),
            q=frankie.home,
            previous=(np.zeros(2), np.zeros(7)),
            tools=[ToolTask(yaw, weights=np.array([1, 1, 1, 1, 1, weight]))],
            base=NavigatedBase(np.zeros(2)),
        )
    J = frankie.configuration(np.zeros(3), frankie.home).J_tool[:, 2:]
    assert (J @ results[1.0].arm)[5] > 0.1
    assert abs((J @ results[0.0].arm)[5]) < 1e-2
    # a free axis of the task's own frame: x of a frame turned by 90 degrees is y
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    result = controller.step(
        base_pose=np.zeros(3),
        q=frankie.home,
        previous=REST,
        tools=[
            ToolTask(
                np.array([0.02, 0.02, 0, 0, 0, 0]),
                weights=np.array([0, 1, 1, 1, 1, 1]),
                R_world_task=R,
            )
        ],
        base=NavigatedBase(np.zeros(2)),
    )
    v = J @ result.arm
    assert v[0] == pytest.approx(0.02, abs=1e-3) and abs(v[1]) < 5e-3


def test_it_stops_on_a_table_at_the_safe_distance(closed_loop, box, twist):
    table = box("table", 0.6, 0.0, (0.5, 0.5, 0.3), role=SolidRole.SUPPORT)
    run = closed_loop(tool=twist(0, 0, -0.3, 0, 0, 0), bodies=[table])
    assert run.clearance.min() >= 0.005 - 0.001
    assert run.clearance[-1] == pytest.approx(0.005, abs=1e-4)
    assert run.rungs == {"full": 600}
    assert jitter(run.arm) <= 2
    assert any(name.endswith("- table") for name in run.results[-1].active)


def test_it_reaches_for_a_wall_and_stops(closed_loop, box, twist):
    wall = box("wall", 1.1, 0.0, (0.1, 3.0, 1.5))
    run = closed_loop(tool=twist(0.4, 0, 0, 0, 0, 0), bodies=[wall], steps=900)
    assert run.clearance.min() >= 0.02 - 0.001
    assert run.rungs == {"full": 900} and jitter(run.arm) <= 2


@pytest.mark.parametrize("arm", ["free", "holding"])
def test_the_base_stops_before_its_arm_hits_a_wall(closed_loop, box, twist, arm):
    wall = box("wall", 2.2, 0.0, (0.1, 3.0, 1.5))
    tool = None if arm == "free" else twist(0, 0, 0, 0, 0, 0)
    run = closed_loop(tool=tool, drive=[0.4, 0.0], bodies=[wall], steps=900)
    assert run.clearance.min() >= 0.02 - 0.001
    assert run.inputs[-1] == pytest.approx([0.0, 0.0], abs=1e-3)
    assert run.base[-1][0] > 1.0
    assert run.rungs == {"full": 900}
    assert jitter(run.inputs) <= 2


def test_a_body_that_comes_nearer_is_avoided(closed_loop, box):
    def bodies(t):
        x = 1.6 - 0.25 * min(t, 4.0)
        velocity = (-0.25 if t < 4.0 else 0.0, 0.0, 0.0)
        return [box("cart", x, 0.05, (0.2, 0.2, 1.2), velocity=velocity)]

    still = closed_loop(bodies=[box("cart", 0.6, 0.05, (0.2, 0.2, 1.2))], steps=1)
    assert still.clearance[0] < -0.01  # it comes to where the hand was
    run = closed_loop(bodies=bodies, steps=720)
    assert run.clearance.min() >= 0.02 - 0.001
    assert run.rungs == {"full": 720}
    assert jitter(run.arm) <= 2


def test_it_comes_out_of_a_penetration_at_bounded_speed(closed_loop, box, frankie):
    hand = frankie.configuration(np.zeros(3), frankie.home).T_world_tool[:3, 3]
    block = box("block", hand[0] + 0.1, hand[1], (0.2, 0.3, hand[2] + 0.2))
    run = closed_loop(bodies=[block], steps=600)
    assert run.clearance[0] < -0.03
    assert run.clearance[-1] >= 0.02 - 1e-3
    assert (np.diff(run.clearance) >= -1e-4).all()
    inside = run.clearance[:-1] < 0.02
    assert np.diff(run.clearance)[inside].max() / DT <= 0.4  # corners turn: not exactly 0.2
    assert jitter(run.arm) <= 2


def test_it_folds_no_arm_into_itself_or_the_base(closed_loop, twist):
    run = closed_loop(tool=twist(-0.4, 0, -0.2, 0, 0, 0), steps=600)
    assert run.clearance.min() >= 0.01 - 0.001
    assert run.rungs["full"] >= 598


def test_pushed_against_joint_limits_it_stays_inside(closed_loop, twist, frankie):
    for direction in ((0, 0, 0, 0, 1.5, 0), (0, 0, 0, 1.5, 0, 0)):
        run = closed_loop(tool=twist(*direction), steps=400)
        assert run.rungs["full"] >= 398
        q = np.array(run.q)
        assert np.minimum(frankie.q_upper - q, q - frankie.q_lower).min() < 1e-3


@pytest.mark.parametrize("seed", range(12))
def test_any_tasks_keep_all_limits(closed_loop, box, seed):
    """`closed_loop` checks positions, speeds and accelerations at every step."""
    rng = np.random.default_rng(seed)
    twists = rng.normal(size=(5, 6)) * [0.5, 0.5, 0.5, 1, 1, 1]
    tasks = iter([ToolTask(twists[k // 20]) for k in range(100)])
    run = closed_loop(
        tool=lambda configuration: next(tasks),
        drive=rng.uniform(-1, 1, 2),
        bodies=[box("b", *rng.uniform(-1, 1, 2), (0.3, 0.3, rng.uniform(0.2, 1.0)))],
        q=frankie_posture(rng),
        dt=float(rng.choice([1 / 60, 1 / 120, 1 / 500])),
        steps=100,
    )
    assert len(run.results) == 100


def frankie_posture(rng):
    return np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785]) + rng.uniform(-0.5, 0.5, 7)


def test_scaling_keeps_the_base_on_its_arc(closed_loop, box, twist):
    """Driving an arc at a wall: turn over speed never changes while the factor falls."""
    wall = box("wall", 1.9, 0.0, (0.1, 4.0, 1.5))
    run = closed_loop(tool=twist(0, 0, 0, 0, 0, 0), drive=[0.4, 0.1], bodies=[wall], steps=700)
    slowed = run.scale < 0.9
    assert slowed.sum() > 20
    arcs = [r.base[0] * q[1] - r.base[1] * q[0] for r, q in references(run)]
    np.testing.assert_allclose(arcs, 0.0, atol=1e-12)


def references(run):
    """Each result with the reference that it was given, worked out as `closed_loop` does."""
    change = np.array([0.5, 2.0]) * DT
    last = np.zeros(2)
    for result in run.results:
        yield result, last + np.clip(np.array([0.4, 0.1]) - last, -change, change)
        last = result.base


def test_an_impossible_reference_makes_the_base_brake_on_its_arc(controller, frankie):
    last = np.array([0.4, 0.2]), np.zeros(7)
    result = controller.step(
        base_pose=np.zeros(3),
        q=frankie.home,
        previous=last,
        base=NavigatedBase(np.array([-0.2, 0.5])),
    )
    assert result.rung == "full" and result.scale == 0.0
    assert "base v acceleration" in result.active
    assert result.base[0] == pytest.approx(0.4 - 0.5 * DT)
    assert result.base[1] / result.base[0] == pytest.approx(0.5)


def test_without_navigation_the_base_helps_the_tool_and_never_slips(frankie, closed_loop, box):
    goal = np.array([2.0, 0.8, 0.6])

    def tool(configuration):
        error = goal - configuration.T_world_tool[:3, 3]
        velocity = 1.5 * error * min(1.0, 0.3 / (np.linalg.norm(error) + 1e-9))
        return ToolTask(np.concatenate([velocity, np.zeros(3)]))

    run = closed_loop(tool=tool, follow=False, steps=1200)
    end = frankie.configuration(run.base[-1], run.q[-1]).T_world_tool[:3, 3]
    assert np.linalg.norm(end - goal) < 0.01
    assert np.linalg.norm(run.base[-1][:2]) > 0.5
    for before, after in zip(run.base[:-1], run.base[1:], strict=True):
        chord = after[:2] - before[:2]
        heading = 0.5 * (before[2] + after[2])
        assert abs(chord @ [-np.sin(heading), np.cos(heading)]) < 1e-12
    assert all(result.scale == 1.0 for result in run.results)


UNUSABLE = [
    ("base_pose", np.array([np.nan, 0, 0]), "base_pose is not finite"),
    ("q", np.full(7, np.inf), "q is not finite"),
    ("q", np.zeros(6), r"q has the shape (6,), needs (7,)"),
    ("previous", (np.zeros(2), np.full(7, np.nan)), "previous joint velocities is not finite"),
    ("previous", (np.full(2, np.nan), np.full(7, 0.1)), "previous base inputs is not finite"),
    ("tools", [ToolTask(np.full(6, np.nan))], "tool twist is not finite"),
    ("tools", [ToolTask(T_world_target=np.full((4, 4), np.inf))], "T_world_target is not finite"),
    ("tools", [ToolTask(np.zeros(3))], "tool twist has the shape (3,), needs (6,)"),
    ("tools", [ToolTask(frame="panda_link9")], "UnknownName: .*panda_link9"),
    ("locked", ["panda_joint9"], "UnknownName: .*panda_joint9"),
    (
        "extra",
        [LinearTask(np.ones((1, 9)), np.full(1, np.nan), np.ones(1))],
        "target of an extra task is not finite",
    ),
    ("base", FreeBase(heading=np.nan), "heading is not finite"),
    ("base", "forward", "an argument is of a wrong kind: base is a str"),
    ("bodies", [None], "AttributeError"),
    (
        "held",
        HeldObject("cube", np.full(3, np.nan), np.eye(4)),
        "size of the held object is not finite",
    ),
    ("age", 0.2, "the state is 0.2 s old, at most 0.1 s is legal"),
    ("age", None, "the state is None s old"),
    ("q", [[1.0], 2.0], "an argument is of a wrong kind"),
    ("previous", ([[0.0], 1.0], np.zeros(7)), "an argument is of a wrong kind"),
    ("tools", [ToolTask([[1.0], 2.0])], "an argument is of a wrong kind"),
    ("tools", [ToolTask(weights=-np.ones(6))], "tool weights must not be negative"),
    ("posture", PostureTask(np.zeros(7), -np.ones(7)), "posture weights must not be negative"),
    (
        "posture",
        PostureTask(np.zeros(7), np.ones(7), lower=["a"] * 7),
        "an argument is of a wrong kind",
    ),
    (
        "extra",
        [LinearTask(np.ones((1, 9)), np.ones(1), -np.ones(1))],
        "weights of an extra task must not be negative",
    ),
    (
        "extra",
        [LinearTask(np.full((1, 9), 1e200), np.ones(1), np.ones(1))],
        "a task's numbers are too large",
    ),
    ("age", np.nan, "the state is nan s old, at most 0.1 s is legal"),
    ("base", NavigatedBase(np.array([0.1, np.inf])), "base reference is not finite"),
    ("posture", PostureTask(np.full(7, np.nan), np.ones(7)), "posture target is not finite"),
    (
        "posture",
        PostureTask(np.zeros(7), np.ones(7), lower=np.full(7, np.nan)),
        "a preferred bound of the posture is not a number for each joint",
    ),
    ("gripper_width", np.nan, "gripper width is not finite"),
]


@pytest.mark.parametrize(("key", "value", "reason"), UNUSABLE)
def test_unusable_input_brakes_with_a_reason(controller, frankie, key, value, reason):
    last = np.array([0.3, -0.2]), np.array([0.5, -0.5, 1.0, 0, 0, 0.01, 2.0])
    inputs = {
        "base_pose": np.zeros(3),
        "q": frankie.home,
        "previous": last,
        "base": NavigatedBase(np.array([0.3, -0.2])),
        key: value,
    }
    result = controller.step(**inputs)
    assert result.rung == "brake" and (result.reason == reason or re.search(reason, result.reason))
    assert np.isfinite(result.base).all() and np.isfinite(result.arm).all()
    assert np.abs(result.arm).max() <= 2.0 and np.abs(result.base).max() <= 0.3
    if key != "previous":
        np.testing.assert_allclose(
            result.arm, np.sign(last[1]) * np.maximum(np.abs(last[1]) - frankie.a_max * DT, 0)
        )
        assert result.base[0] == pytest.approx(0.3 - 0.5 * DT)
    # and goes on as if nothing had been
    inputs[key] = {
        "base_pose": np.zeros(3), "q": frankie.home, "previous": last, "tools": (),
        "base": NavigatedBase(np.array([0.3, -0.2])), "posture": None, "gripper_width": None,
        "locked": (), "extra": (), "bodies": (), "held": None, "age": 0.0,
    }[key]  # fmt: skip
    assert controller.step(**inputs).rung == "full"


def test_a_body_without_a_place_brakes(controller, frankie, box):
    body = box("ghost", np.nan, 0.0, (1, 1, 1))
    result = controller.step(
        base_pose=np.zeros(3), q=frankie.home, previous=REST,
        base=NavigatedBase(np.zeros(2)), bodies=[body],
    )  # fmt: skip
    assert result.rung == "brake" and "a body has a place that is not finite" in result.reason


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_there_is_a_command_from_any_state_even_far_outside_of_its_limits(frankie, seed):
    rng = np.random.default_rng(seed)
    controller = WholeBodyController(frankie, DT)
    span = frankie.q_upper - frankie.q_lower
    q = frankie.q_lower + rng.uniform(-0.1, 1.1, 7) * span
    last = rng.uniform(-1, 1, 2) * [0.5, 1.7], rng.uniform(-1, 1, 7) * frankie.v_max
    result = controller.step(
        base_pose=rng.normal(size=3),
        q=q,
        previous=last,
        tools=[ToolTask(rng.normal(size=6))],
        base=[FreeBase(), NavigatedBase(rng.uniform(-1, 1, 2))][rng.integers(2)],
        bodies=shapes_from_scene(load_scenario("obstructed_turn")),
    )
    assert np.isfinite(result.arm).all() and np.isfinite(result.base).all()
    assert (np.abs(result.arm) <= frankie.v_max + 1e-12).all()
    following = q + result.arm * DT
    for side, limit in ((1.0, frankie.q_upper), (-1.0, frankie.q_lower)):
        assert (side * (following - limit) <= np.maximum(side * (q - limit), 0.0)).all()
    assert abs(result.base[0]) <= 0.5 + 1e-12 and abs(result.base[1]) <= 1.745 + 1e-12


def test_osqp_and_daqp_command_the_same(frankie):
    bodies = shapes_from_scene(load_scenario("obstructed_turn"))
    first, second = (WholeBodyController(frankie, DT, solver=name) for name in ("osqp", "daqp"))
    rng = np.random.default_rng(3)
    worst = []
    for _ in range(150):
        state = {
            "base_pose": np.array([-0.7, -0.2, 0.1]) + rng.normal(size=3) * 0.1,
            "q": frankie.home + rng.uniform(-0.4, 0.4, 7),
            "previous": (np.array([0.2, 0.0]), rng.uniform(-0.3, 0.3, 7)),
            "tools": [ToolTask(rng.normal(size=6) * 0.2)],
            "base": NavigatedBase(np.array([0.2, 0.01])),
            "bodies": bodies,
        }
        one, two = first.step(**state), second.step(**state)
        assert one.rung == two.rung
        H_gap = frankie.configuration(state["base_pose"], state["q"]).J_tool[:, 2:] @ (
            one.arm - two.arm
        )
        worst.append(max(np.abs(H_gap).max(), np.abs(one.base - two.base).max()))
    assert max(worst) <= 1e-4


def test_the_same_input_gives_the_same_command_to_the_bit(frankie, closed_loop, box, twist):
    table = box("table", 0.6, 0.0, (0.5, 0.5, 0.3), role=SolidRole.SUPPORT)
    runs = [closed_loop(tool=twist(0, 0, -0.3, 0, 0, 0), bodies=[table], steps=150) for _ in "ab"]
    assert np.array_equal(runs[0].arm, runs[1].arm)


def test_the_summary_names_every_degree_of_freedom_and_pair_class(controller, frankie):
    text = controller.limits_summary()
    for name in (*frankie.arm_joints, "v ", "omega", "arm_scene", "hand_support"):
        assert name in text
    assert "-0.2 .. 0.5 m/s, acceleration 0.5" in text
    assert "position -2.8973 .. 2.8973, speed +-2.175, acceleration 15" in text
    assert "0.862 m/s are allowed" in text  # NEO's 1 m/s, lowered to 7.5/2.175 * 0.25


def test_an_unknown_solver_is_refused(frankie):
    with pytest.raises(UnknownName, match="osqp"):
        WholeBodyController(frankie, DT, solver="cplex")


def test_a_joint_too_fast_for_its_range_passes_its_acceleration_limit_and_says_so(frankie):
    q, speeds = frankie.home.copy(), np.zeros(7)
    q[6], speeds[6] = frankie.q_upper[6] - 0.01, 1.0
    result = WholeBodyController(frankie, DT).step(
        base_pose=np.zeros(3),
        q=q,
        previous=(np.zeros(2), speeds),
        base=NavigatedBase(np.zeros(2)),
    )
    assert result.rung == "no_acceleration"
    assert "position of panda_joint7 against acceleration of panda_joint7" in result.reason
    assert q[6] + result.arm[6] * DT <= frankie.q_upper[6]


def test_a_locked_joint_comes_to_rest_and_stays(frankie):
    controller, q = WholeBodyController(frankie, DT), frankie.home.copy()
    last = np.zeros(2), np.full(7, 0.3)
    for k in range(60):
        result = controller.step(
            base_pose=np.zeros(3),
            q=q,
            previous=last,
            base=FreeBase(),
            tools=[ToolTask(np.array([0.1, 0.1, 0, 0, 0, 0]))],
            locked=["panda_joint4", "base omega"],
        )
        assert result.rung == "full"
        assert abs(result.arm[3] - last[1][3]) <= 12.5 * DT + 1e-12
        q, last = q + result.arm * DT, (result.base, result.arm)
        if k > 10:
            assert result.arm[3] == 0.0 and result.base[1] == 0.0
            assert "panda_joint4 locked" in result.active
    assert np.abs(result.arm).max() > 0.02


def test_a_second_frame_can_have_a_task_of_its_own(frankie):
    """The forearm is held at its height while the tool goes sideways."""
    controller = WholeBodyController(frankie, DT)
    pose, q, last = np.zeros(3), frankie.home.copy(), (np.zeros(2), np.zeros(7))
    start = frankie.configuration(pose, q).link_pose("panda_link5")[2, 3]
    heights = {}
    for held in (False, True):
        q = frankie.home.copy()
        up = np.array([0, 0, 20.0, 0, 0, 0])
        elbow = ToolTask(frame="panda_link5", weights=up, T_world_target=None)
        for _ in range(120):
            tool = ToolTask(np.array([0.1, 0.15, 0.1, 0, 0, 0]))
            result = controller.step(
                base_pose=pose,
                q=q,
                previous=last,
                base=NavigatedBase(np.zeros(2)),
                tools=[elbow, tool] if held else [tool],
            )
            q, last = q + result.arm * DT, (result.base, result.arm)
        heights[held] = frankie.configuration(pose, q).link_pose("panda_link5")[2, 3]
    assert abs(heights[True] - start) < 0.3 * abs(heights[False] - start)
