"""What every plant has to do, whatever is inside."""

import hashlib
import math
import subprocess
import sys

import numpy as np
import pytest

from motm_wbc.geometry import se2
from motm_wbc.interfaces import Command, Plant
from motm_wbc.scene.scenario import GraspFailure, Sensing
from motm_wbc.simulation import make_plant

CUBE = np.array([0.0, 0.0, 0.625])
UP = np.array([0.0, 0.0, 0.1])


def grasp(operator, offset=(0.0, 0.0, 0.0)):
    point = operator.grasp_point()
    operator.reach(point + UP, 1.5)
    operator.reach(point + offset, 0.8)


def test_it_is_a_plant(operate, kind):
    plant: Plant = operate(kind).plant
    robot, world = plant.sense()
    truth = plant.truth()
    assert plant.control_period == 1.0 / 120.0
    assert robot.time == world.time == truth.time == 0.0
    np.testing.assert_allclose(truth.base_pose, [-0.75, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(truth.q, plant.model.home, atol=1e-9)
    np.testing.assert_allclose(truth.objects["cube"][:3, 3], CUBE, atol=1e-9)
    assert truth.gripper_width == pytest.approx(0.08, abs=1e-9)
    assert truth.held is None
    assert truth.T_tool_held is None
    assert not robot.fingers_loaded


def test_moves_as_commanded(operate, kind):
    plant = operate(kind).plant
    tolerance = {"kinematic": 1e-8, "bullet": 1e-3}[kind]
    pose, q = plant.truth().base_pose, plant.truth().q
    for k in range(360):
        t = k / 120.0
        v, omega = -min(0.5, 0.5 * t), 0.6 * math.sin(t)
        arm = 0.3 * np.sin(t * np.arange(1.0, 8.0))
        plant.step(Command(np.array([v, omega]), arm, 0.08))
        pose = se2.integrate_twist(pose, v, 0.0, omega, 1.0 / 120.0)
        q = q + arm / 120.0
        truth = plant.truth()
        assert np.hypot(*(truth.base_pose - pose)[:2]) < tolerance
        assert abs(truth.base_pose[2] - pose[2]) < tolerance
        assert np.abs(truth.q - q).max() < 2.0 * tolerance
        np.testing.assert_allclose(truth.base_velocity, [v, omega], atol=5.0 * tolerance)
    assert np.hypot(*(pose[:2] - [-0.75, 0.0])) > 0.5


def test_a_differential_base_never_slides_sideways(operate, kind):
    plant = operate(kind).plant
    before = plant.truth().base_pose
    for _ in range(240):
        plant.step(Command(np.array([-0.4, 1.0]), np.zeros(7), 0.08))
        after = plant.truth().base_pose
        middle = 0.5 * (before[2] + after[2])
        dx, dy = after[:2] - before[:2]
        assert abs(-math.sin(middle) * dx + math.cos(middle) * dy) < 2e-6
        assert math.cos(middle) * dx + math.sin(middle) * dy < 0.0
        before = after


def test_sees_each_physics_step(operate, kind):
    operator = operate(kind)
    times = []
    operator.on_substep = lambda truth: times.append(truth.time)
    operator.wait(0.5)
    assert len(times) == 120
    np.testing.assert_allclose(times, (np.arange(120) + 1) / 240.0, atol=1e-12)
    assert operator.plant.time == times[-1]


def test_fingers_take_their_time(operate, kind):
    operator = operate(kind)
    operator.close(0.4)
    assert operator.plant.truth().gripper_width == pytest.approx(0.04, abs=1e-3)
    operator.close(0.5)
    assert operator.plant.truth().gripper_width == pytest.approx(0.0, abs=1e-3)
    operator.open(0.2)
    assert operator.plant.truth().gripper_width == pytest.approx(0.04, abs=2e-3)
    operator.open(0.3)
    assert operator.plant.truth().gripper_width == pytest.approx(0.08, abs=1e-3)
    assert operator.plant.attempts == ()  # the cube was far away


def test_grasps_lifts_and_carries(operate, kind):
    operator = operate(kind)
    grasp(operator, (0.003, 0.004, 0.0))
    start = operator.plant.time
    assert operator.close()
    assert operator.plant.grasp_time["cube"] - start >= 0.29
    assert operator.plant.truth().gripper_width == pytest.approx(0.05, abs=1e-3)
    assert operator.plant.attempts[0].held
    T_tool_held = operator.plant.truth().T_tool_held
    operator.reach(CUBE + UP)
    truth = operator.plant.truth()
    assert truth.held == "cube"
    np.testing.assert_allclose(operator.grasp_point(), operator.tool(), atol=6e-3)
    np.testing.assert_allclose(truth.T_tool_held, T_tool_held, atol=0.015)
    assert truth.objects["cube"][2, 3] > 0.705
    assert not operator.plant.releases


def test_released_object_comes_to_rest(operate, kind):
    operator = operate(kind)
    point = operator.grasp_point()
    grasp(operator)
    assert operator.close()
    operator.reach(CUBE + UP)
    operator.reach(point + np.array([0.06, 0.05, 0.003]))
    carried = operator.plant.truth().objects["cube"][:3, 3]
    operator.open(0.4)
    operator.reach(CUBE + np.array([0.06, 0.05, 0.1]))
    operator.wait(1.0)
    truth = operator.plant.truth()
    assert truth.held is None
    assert [release.object for release in operator.plant.releases] == ["cube"]
    np.testing.assert_allclose(truth.objects["cube"][:2, 3], carried[:2], atol=1e-3)
    np.testing.assert_allclose(truth.objects["cube"][2, 3], 0.625, atol=1e-3)
    assert truth.objects["cube"][2, 2] > 0.9999
    before = truth.objects["cube"]
    operator.wait(0.5)
    np.testing.assert_allclose(operator.plant.truth().objects["cube"], before, atol=1e-4)


def test_a_dropped_object_falls_to_the_floor(operate, kind):
    operator = operate(kind)
    grasp(operator)
    assert operator.close()
    operator.reach(CUBE + UP)
    operator.base = (-0.4, 0.0)
    operator.wait(1.5)
    operator.base = (0.0, 0.0)
    operator.open(0.3)
    operator.wait(1.5)
    assert operator.plant.truth().objects["cube"][2, 3] == pytest.approx(0.025, abs=5e-3)


def test_object_stays_put(operate, kind):
    operator = operate(kind)
    operator.wait(3.0)
    np.testing.assert_allclose(operator.plant.truth().objects["cube"][:3, 3], CUBE, atol=1e-4)
    assert operator.plant.events == ()


@pytest.mark.parametrize("delay", [0.0, 0.6, 1.3, 2.0])
def test_attempts_fail_until_the_delay_has_passed(operate, kind, delay):
    operator = operate(kind, failure=GraspFailure(delay=delay))
    grasp(operator)
    tries = operator.try_until_held()
    # An attempt and the reopening take 0.65 s = 78 control steps.
    assert tries == math.ceil(delay / 0.65 - 1e-9) + 1
    attempts = operator.plant.attempts
    assert [a.failed_by_injection for a in attempts] == [True] * (tries - 1) + [False]
    assert [a.held for a in attempts] == [False] * (tries - 1) + [True]
    np.testing.assert_allclose(np.diff([a.time for a in attempts]), 0.65, atol=1e-9)


def test_a_failed_attempt_closes_on_nothing(operate, kind):
    operator = operate(kind, failure=GraspFailure(delay=60.0))
    grasp(operator)
    assert not operator.close(0.6)
    assert operator.plant.truth().gripper_width == pytest.approx(0.06, abs=1e-3)
    np.testing.assert_allclose(operator.plant.truth().objects["cube"][:3, 3], CUBE, atol=5e-4)
    operator.reach(CUBE + UP)
    assert operator.plant.truth().objects["cube"][2, 3] == pytest.approx(0.625, abs=1e-3)


def test_nothing_but_the_end_of_the_delay_tells_it(operate, kind):
    """Runs with different delays are the same, to the bit, until the shorter one has passed."""
    runs = []
    for delay in (1.0, 10.0):
        operator = operate(kind, failure=GraspFailure(delay=delay))
        grasp(operator)
        for _ in range(4):
            operator.close()
            operator.open()
        runs.append(operator)
    first = runs[0].plant.attempts[0].time
    same = [t for t in runs[0].truths if t.time < first + 1.0]
    assert len(same) > 360
    for one, other in zip(same, runs[1].truths, strict=False):
        assert flat(one) == flat(other)
    assert runs[0].plant.attempts[2].held
    assert not runs[1].plant.attempts[2].held


def test_closing_outside_the_radius_is_no_attempt_and_holds_nothing(operate, kind):
    operator = operate(kind)
    grasp(operator, (0.013, 0.0, 0.0))
    assert not operator.close(0.6)
    assert operator.plant.attempts == ()


def test_random_failures_depend_on_the_seed_alone(operate, kind):
    def outcome(seed):
        operator = operate(kind, failure=GraspFailure(probability=0.5), seed=seed)
        grasp(operator)
        return operator.try_until_held(30)

    first = outcome(1)
    assert outcome(1) == first
    assert first != outcome(2)


def test_a_finger_that_hits_the_object_is_noticed(operate, kind):
    operator = operate(kind)
    beside = CUBE + np.array([-0.08, 0.0, 0.0])
    operator.reach(beside + UP, 1.5)
    operator.reach(beside, 0.8)
    assert operator.plant.events == ()
    operator.reach(CUBE + np.array([0.0, 0.028, 0.0]), 1.0)
    assert "finger_hit" in [event.kind for event in operator.plant.events]
    moved = operator.plant.truth().objects["cube"][:2, 3] - CUBE[:2]
    assert np.linalg.norm(moved) > 2e-3


def test_late_samples_are_late_as_a_whole(operate, kind, beside_table):
    scenario = beside_table.model_copy(update={"sensing": Sensing(delay=0.05)})
    operator = operate(kind, scenario)
    operator.base = (-0.3, 0.2)
    seen = []
    for _ in range(60):
        operator.step(np.full(7, 0.1))
        seen.append(operator.plant.sense())
    robot, world = seen[-1]
    truth = operator.truths[-1 - 6]
    assert robot.time == world.time == truth.time
    assert robot.base_pose.tobytes() == truth.base_pose.tobytes()
    assert robot.q.tobytes() == truth.q.tobytes()
    assert world.objects["cube"].tobytes() == truth.objects["cube"].tobytes()
    assert [robot.time for robot, _ in seen[:6]] == [0.0] * 6


def test_noise_is_off_in_the_nominal_run_and_seeded_else(operate, kind, beside_table):
    noise = Sensing(object_position_noise=0.003, base_position_noise=0.002)
    scenario = beside_table.model_copy(update={"sensing": noise})

    def samples(seed):
        operator = operate(kind, scenario, seed=seed)
        seen = []
        for _ in range(200):
            operator.step(np.zeros(7))
            seen.append(operator.plant.sense()[1].objects["cube"][:3, 3] - CUBE)
        return np.array(seen)

    assert np.abs(samples(0)).max() < 1e-4
    one = samples(1)
    assert one.std(axis=0) == pytest.approx(0.003, rel=0.25)
    assert one.tobytes() == samples(1).tobytes()
    assert one.tobytes() != samples(2).tobytes()


def test_moving_solids_move(operate, kind, beside_table):
    from motm_wbc.scene.solids import Obstacle

    walker = Obstacle(
        name="walker", shape="cylinder", radius=0.2, height=1.5, position=(3.0, 3.0),
        velocity=(-0.5, 0.0, 0.1),
    )  # fmt: skip
    operator = operate(kind, beside_table.model_copy(update={"obstacles": (walker,)}))
    operator.wait(1.0)
    body = operator.plant.truth().moving["walker"]
    np.testing.assert_allclose(body.pose, [2.5, 3.0, 0.1], atol=1e-9)
    assert operator.plant.sense()[1].moving["walker"].pose[0] == pytest.approx(2.5)


def test_a_gripper_without_moving_fingers_grasps_all_the_same(kind, model, beside_table, operate):
    """Some robots' files have no finger joints; their gripper is a width and no more."""
    from motm_wbc.kinematics.loading import build_model
    from motm_wbc.scene.finder import find_robot

    data = model.description
    locked = {finger.joint: 0.04 for finger in data.gripper.fingers}
    stiff = data.model_copy(
        update={
            "arm": data.arm.model_copy(update={"locked": locked}),
            "gripper": data.gripper.model_copy(update={"fingers": ()}),
        }
    )
    robot = build_model(stiff, find_robot("frankie").parent, "stiff")
    operator = operate(kind, robot=robot, failure=GraspFailure(delay=0.5))
    grasp(operator)
    assert operator.try_until_held() == 2
    operator.reach(CUBE + UP)
    assert operator.plant.truth().objects["cube"][2, 3] > 0.705
    assert operator.plant.truth().gripper_width == pytest.approx(0.05, abs=1e-4)
    operator.open(0.3)
    operator.wait(1.0)
    assert operator.plant.truth().objects["cube"][2, 3] == pytest.approx(0.625, abs=2e-3)


def flat(truth):
    """The whole state as bytes."""
    arrays = [truth.base_pose, truth.base_velocity, truth.q, truth.v, *truth.objects.values()]
    return (truth.time, truth.gripper_width, *(array.tobytes() for array in arrays))


def digest(kind, scenario, model):
    plant = make_plant(kind, scenario, model, seed=3)
    state = hashlib.sha256()
    for k in range(240):
        command = Command(np.array([-0.3, 0.4]), 0.2 * np.sin(np.arange(7.0) + k / 60), 0.03)
        plant.step(command)
        state.update(repr(flat(plant.truth())).encode())
    plant.close()
    return state.hexdigest()


def test_two_plants_at_once_give_the_same_run(kind, beside_table, model):
    assert digest(kind, beside_table, model) == digest(kind, beside_table, model)


def test_two_processes_give_the_same_run(kind, beside_table, model):
    code = (
        "import importlib.util as u\n"
        f"spec = u.spec_from_file_location('conformance', {__file__!r})\n"
        "module = u.module_from_spec(spec); spec.loader.exec_module(module)\n"
        "from motm_wbc.kinematics.loading import load_robot\n"
        "from motm_wbc.scene.scenario import Scenario\n"
        f"scenario = Scenario.model_validate_json({beside_table.model_dump_json()!r})\n"
        f"print(module.digest({kind!r}, scenario, load_robot('frankie')))\n"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == digest(kind, beside_table, model)
    assert other.stderr == ""
