"""A robot beside a table, and someone who drives its tool by hand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from motm_wbc.interfaces import Command
from motm_wbc.kinematics.inverse import solve_ik
from motm_wbc.kinematics.loading import load_robot
from motm_wbc.kinematics.rotations import inverse_pose
from motm_wbc.scene.scenario import load_scenario
from motm_wbc.simulation import available_plants, make_plant


@pytest.fixture(scope="session")
def model():
    return load_robot("frankie")


@pytest.fixture(scope="session")
def beside_table():
    """The scenario `line`, the robot at the table with the cube in reach."""
    line = load_scenario("line")
    return line.model_copy(
        update={"start": line.start.model_copy(update={"pose": (-0.75, 0.0, 0.0)})}
    )


@pytest.fixture(params=["kinematic", "bullet"])
def kind(request):
    """Every plant; bullet only where pybullet can be imported."""
    if request.param == "bullet" and "bullet" not in available_plants():
        pytest.importorskip("pybullet")
    return request.param


def above(point, yaw=0.0):
    """(4, 4) tool pose that points down at a point."""
    c, s = np.cos(yaw), np.sin(yaw)
    T = np.eye(4)
    T[:3, :3] = [[c, s, 0], [s, -c, 0], [0, 0, -1]]
    T[:3, 3] = point
    return T


@dataclass
class Operator:
    """Moves the tool of a plant through poses, and its fingers."""

    plant: object
    width: float = 0.08
    base: tuple = (0.0, 0.0)
    on_substep: object = None
    posture: np.ndarray = None
    truths: list = field(default_factory=list)

    def __post_init__(self):
        self.posture = np.array(self.plant.model.home)

    def step(self, arm):
        self.plant.step(Command(np.array(self.base), arm, self.width), self.on_substep)
        self.truths.append(self.plant.truth())

    def wait(self, seconds):
        for _ in range(round(seconds / self.plant.control_period)):
            self.step(np.zeros(self.plant.model.n_arm))

    def reach(self, point, seconds=1.0, yaw=0.0):
        """Bring the tool to a point, pointing down, on a straight line of joint angles."""
        T_base_world = inverse_pose(self._configuration().T_world_base)
        found = solve_ik(self.plant.model, T_base_world @ above(point, yaw), self.posture)
        assert found.converged
        self.posture = found.q
        steps = round(seconds / self.plant.control_period)
        for k in range(steps):
            left = max((steps - k) * self.plant.control_period, 0.05)
            self.step((found.q - self.plant.truth().q) / left)
        self.step(np.zeros(self.plant.model.n_arm))

    def _configuration(self):
        truth = self.plant.truth()
        return self.plant.model.configuration(truth.base_pose, truth.q, truth.gripper_width)

    def tool(self):
        return self._configuration().T_world_tool[:3, 3]

    def grasp_point(self):
        """Where the tool has to be to grasp the cube."""
        cube = self.plant.scenario.object("cube")
        pose = self.plant.truth().objects["cube"]
        return pose[:3, 3] + cube.grasp_height * pose[:3, 2]

    def close(self, seconds=0.4):
        self.width = 0.0
        self.wait(seconds)
        return self.plant.sense()[0].fingers_loaded

    def open(self, seconds=0.25):
        self.width = 0.08
        self.wait(seconds)

    def try_until_held(self, tries=10):
        """Close and reopen until something is held; the number of tries."""
        for count in range(1, tries + 1):
            if self.close():
                return count
            self.open()
        raise AssertionError("nothing was held")


@pytest.fixture
def operate(model, beside_table):
    """Makes plants with an operator, and closes them."""
    plants = []

    def make(kind, scenario=beside_table, robot=model, **options):
        plant = make_plant(kind, scenario, robot, **options)
        plants.append(plant)
        return Operator(plant)

    yield make
    for plant in plants:
        plant.close()
