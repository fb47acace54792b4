"""A synthetic run: a robot made of boxes on an arc about the table, with made-up reports."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind, BaseLimits
from motm_wbc.interfaces import BaseReport, Command, Event, GroundTruth, MovingBody, StepReport
from motm_wbc.scene.files import parse
from motm_wbc.scene.scenario import Scenario, upright_pose

PERIOD = 1.0 / 120.0
BASE_EVERY = 6
ARM_JOINTS = ("shoulder", "elbow")
FINGER_JOINTS = ("left", "right")
BASE_JOINTS = ("base_x", "base_y", "base_yaw")
REASONS = ("", "in collision", "no path")

_CHAIN = (
    ("base_x", "prismatic", "world", "base_x_link", "0 0 0", "1 0 0", None),
    ("base_y", "prismatic", "base_x_link", "base_y_link", "0 0 0", "0 1 0", None),
    ("base_yaw", "continuous", "base_y_link", "base_link", "0 0 0", "0 0 1", "0.7 0.47 0.35"),
    ("shoulder", "revolute", "base_link", "upper", "0.2 0 0.6", "0 0 1", "0.1 0.1 0.5"),
    ("elbow", "revolute", "upper", "hand", "0 0 0.25", "0 1 0", "0.5 0.08 0.08"),
    ("left", "prismatic", "hand", "left_finger", "0.28 0.02 0", "0 1 0", "0.06 0.01 0.02"),
    ("right", "prismatic", "hand", "right_finger", "0.28 -0.02 0", "0 -1 0", "0.06 0.01 0.02"),
)


def box_robot_urdf() -> str:
    """A base on three joints, an arm of two, two fingers; every body a box."""
    bodies, joints = ['<link name="world"/>'], []
    for name, kind, parent, child, origin, axis, size in _CHAIN:
        visual = f'<visual><geometry><box size="{size}"/></geometry></visual>' if size else ""
        bodies.append(f'<link name="{child}">{visual}</link>')
        joints.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{origin}"/><axis xyz="{axis}"/>'
            '<limit lower="-5" upper="5" velocity="2" effort="10"/></joint>'
        )
    return f'<robot name="boxes">{"".join(bodies)}{"".join(joints)}</robot>'


SCENARIO = {
    "name": "synthetic",
    "description": "All shapes, one of them moving",
    "start": {"pose": [1.5, 0.0, math.pi / 2]},
    "supports": [
        {"name": "table", "shape": "cylinder", "radius": 0.2, "height": 0.6},
        {"name": "tray", "shape": "box", "size": [0.4, 0.4, 0.6], "position": [-1.5, 0.5]},
    ],
    "obstacles": [
        {
            "name": "corner",
            "shape": "prism",
            "outline": [[0, 0], [0.8, 0], [0.8, 0.2], [0.2, 0.2], [0.2, 0.8], [0, 0.8]],
            "height": 0.4,
            "position": [-1.8, -1.6],
        },
        {
            "name": "trolley",
            "shape": "box",
            "size": [0.4, 0.3, 0.5],
            "position": [1.5, -1.5],
            "velocity": [-0.1, 0.0, 0.0],
        },
    ],
    "objects": [{"name": "cube", "shape": "box", "size": [0.05, 0.05, 0.05], "on": "table"}],
    "task": [{"pick": "cube"}, {"place": "cube", "on": "tray", "at": [-1.5, 0.5]}],
    "boundary": [[-3, -3], [3, -3], [3, 3], [-3, 3]],
}


@dataclass(frozen=True)
class Run:
    """A made-up run.

    Attributes:
        scenario: the scene.
        robot: what the recorder is told of the robot.
        steps: truth and report of each control step.
    """

    scenario: Scenario
    robot: dict[str, Any]
    steps: list[tuple[GroundTruth, StepReport]]


def pose_at(time: float) -> Array:
    """On a circle of 1 m about the table, at 0.4 rad/s."""
    angle = 0.4 * time
    return np.array([math.cos(angle), math.sin(angle), angle + 0.5 * math.pi])


def candidates() -> Array:
    """(72, 3) tangential poses both ways about on a circle of 0.6 m."""
    angles = np.tile(np.radians(10.0 * np.arange(36)), 2)
    way = np.repeat([0.5 * math.pi, -0.5 * math.pi], 36)
    return np.column_stack([0.6 * np.cos(angles), 0.6 * np.sin(angles), angles + way])


def base_report(time: float) -> BaseReport:
    """Candidates' costs by distance; every seventh is rejected, and those that are far."""
    pose, poses = pose_at(time), candidates()
    costs = 2.0 * np.linalg.norm(poses[:, :2] - pose[:2], axis=1) + 0.3
    rejections = np.where(np.arange(72) % 7 == 0, 1, np.where(costs > 3.2, 2, 0))
    costs[rejections > 0] = np.inf
    selected = int(np.argmin(costs))
    ahead = np.array([se2.integrate_twist(pose, 0.4, 0.0, 0.4, 0.2 * k) for k in range(8)])
    return BaseReport(
        goal=poses[selected],
        candidates=poses,
        costs=costs,
        rejections=rejections.astype(float),
        reasons=REASONS,
        selected=selected,
        global_path=np.array([pose[:2], poses[selected, :2]]),
        local_plan=np.column_stack([0.2 * np.arange(8), ahead]),
        braking=ahead[:4],
        compute_time=0.003 + 0.002 * math.sin(9.0 * time) ** 2,
        expansions=200,
    )


def make_step(index: int) -> tuple[GroundTruth, StepReport]:
    """Truth and report of control step `index`."""
    time = index * PERIOD
    pose = pose_at(time)
    cube = upright_pose(np.array([0.0, 0.0, 0.625]), 0.0)
    wave = np.array([math.sin(time), math.cos(time)])
    truth = GroundTruth(
        time=time,
        base_pose=pose,
        base_velocity=np.array([0.4, 0.4]),
        q=0.5 * wave,
        v=np.array([0.5, -0.5]) * wave[::-1],
        gripper_width=0.08,
        objects={"cube": cube},
        moving={"trolley": MovingBody(np.array([1.5 - 0.1 * time, -1.5, 0.0]), np.zeros(3))},
        held=None,
        T_tool_held=None,
    )
    events = (Event(time, "attempt", f"attempt at {time:.2f} s", "warn"),) * (index % 100 == 50)
    report = StepReport(
        time=time,
        command=Command(np.array([0.41, 0.39]), np.array([0.1, 0.2]), 0.06),
        base_reference=np.array([0.42, 0.38]),
        T_world_target=cube if index % 200 > 20 else None,
        tool_error=0.5 * math.exp(-time) if index % 200 > 20 else math.nan,
        stage="reach" if index % 200 > 20 else "travel",
        rung="full",
        active=("elbow speed",) if index % 50 == 0 else (),
        step_index=0,
        compute_time=1e-4 * (1.0 + 0.2 * math.sin(7.0 * time)),
        events=events,
        base=base_report(time) if index % BASE_EVERY == 0 else None,
    )
    return truth, report


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Five seconds, and what the recorder is told of the robot."""
    urdf = tmp_path_factory.mktemp("robot") / "boxes.urdf"
    urdf.write_text(box_robot_urdf())
    scenario = parse(Scenario, SCENARIO, "synthetic")
    robot = {
        "urdf_path": urdf,
        "base_joints": BASE_JOINTS,
        "arm_joints": ARM_JOINTS,
        "finger_joints": FINGER_JOINTS,
        "base_kind": BaseKind.DIFFERENTIAL,
        "base_limits": BaseLimits(0.5, 0.2, 1.745, 0.5, 2.0),
        "footprint": polygons.rectangle(0.7, 0.47),
        "q_lower": np.array([-2.0, -2.0]),
        "q_upper": np.array([2.0, 2.0]),
        "v_limits": np.array([2.0, 2.0]),
        "ring_radius": 0.6,
        "reach_radius": 0.75,
    }
    return Run(scenario, robot, [make_step(index) for index in range(600)])


@pytest.fixture
def target(tmp_path: Path) -> Iterator[Path]:
    """A file to record to; nothing else may be left in its folder."""
    path = tmp_path / "run.rrd"
    yield path
    assert [entry.name for entry in tmp_path.iterdir() if entry != path] == []
