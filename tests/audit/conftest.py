"""A robot, and states of the world made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.interfaces import GroundTruth
from motm_wbc.kinematics.inverse import solve_ik
from motm_wbc.kinematics.loading import load_robot
from motm_wbc.kinematics.rotations import inverse_pose
from motm_wbc.scene.scenario import load_scenario


@pytest.fixture(scope="session")
def model():
    return load_robot("frankie")


@pytest.fixture(scope="session")
def scenario():
    return load_scenario("obstructed_turn")


class World:
    """States of a scenario's world, one after the other."""

    def __init__(self, model, scenario):
        self.model = model
        self.truth = GroundTruth(
            time=0.0,
            base_pose=scenario.start_pose,
            base_velocity=np.zeros(model.n_base),
            q=np.array(model.home),
            v=np.zeros(model.n_arm),
            gripper_width=0.08,
            objects={o.name: scenario.T_world_object(o.name) for o in scenario.objects},
            moving={},
            held=None,
            T_tool_held=None,
        )

    def at(self, **changes):
        """The next state, a physics step later."""
        self.truth = replace(self.truth, time=self.truth.time + 1.0 / 240.0, **changes)
        return self.truth

    def drive(self, audit, goal, steps=240):
        """Move the base in a straight line to a pose, arm and object with it."""
        start = self.truth.base_pose
        for k in range(1, steps + 1):
            self.carry(audit, base_pose=start + (np.asarray(goal) - start) * k / steps)

    def swing(self, audit, q, steps=240):
        """Move the arm on a straight line of joint angles."""
        start = self.truth.q
        for k in range(1, steps + 1):
            self.carry(audit, q=start + (np.asarray(q) - start) * k / steps)

    def carry(self, audit, **changes):
        """One step in which a held object moves with the tool."""
        truth = self.at(**changes)
        if truth.held is not None:
            T_world_object = self.tool() @ truth.T_tool_held
            truth = replace(truth, objects={**truth.objects, truth.held: T_world_object})
            self.truth = truth
        audit.observe(truth)

    def tool(self):
        truth = self.truth
        return self.model.configuration(truth.base_pose, truth.q).T_world_tool

    def grasp(self, name):
        """Hold an object where it is."""
        pose = self.truth.objects[name]
        T_tool_held = inverse_pose(self.tool()) @ pose
        self.at(held=name, T_tool_held=T_tool_held, gripper_width=0.05)

    def reach(self, point):
        """Joint positions with the tool at a point, pointing down."""
        T = np.diag([1.0, -1.0, -1.0, 1.0])
        T[:3, 3] = point
        at = self.model.configuration(self.truth.base_pose, self.truth.q)
        found = solve_ik(self.model, inverse_pose(at.T_world_base) @ T, self.truth.q)
        assert found.converged
        return found.q


@pytest.fixture
def make_world(model):
    return lambda scenario: World(model, scenario)
