"""roboplan's OInK as a contestant: `python worker_roboplan.py PROBLEM`, in its environment."""

from collections.abc import Sequence
from importlib.metadata import version
from itertools import combinations
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin
from motm_bench import Array, Problem, capsule_frame, serve
from roboplan.core import Box, CartesianConfiguration, Scene, loadUrdfSceneDescriptionFromXml
from roboplan.optimal_ik import (
    AccelerationLimit,
    ConfigurationTask,
    ConfigurationTaskOptions,
    FrameTask,
    FrameTaskOptions,
    Oink,
    PositionLimit,
    SelfCollisionBarrier,
    SelfCollisionBarrierOptions,
    VelocityLimit,
)


class RoboPlan:
    """The problem as roboplan states it; see the documentation for what it leaves out."""

    def __init__(self, problem: Problem) -> None:
        self.about = {"library": f"roboplan {version('roboplan')}", "solver": "proxqp"}
        self._dt, self._damping = problem.dt, problem.damping
        description = loadUrdfSceneDescriptionFromXml(_with_shapes(problem))
        scene = Scene("bench", description)
        _add_boxes(scene, problem)
        self._scene = scene  # solver and tasks refer to it
        self._oink = oink = Oink(scene)
        assert oink.num_variables == len(problem.joints)
        assert tuple(scene.getJointNames()) == problem.joints
        start = CartesianConfiguration("world", problem.tool_link, problem.T_world_target[0])
        self._tool = FrameTask(
            oink,
            scene,
            start,
            FrameTaskOptions(
                position_cost=problem.linear_weight,
                orientation_cost=problem.angular_weight,
            ),
        )
        posture = ConfigurationTask(
            oink,
            np.concatenate((np.zeros(3), problem.posture)),
            np.concatenate((np.zeros(3), problem.posture_weights)),
            ConfigurationTaskOptions(task_gain=problem.posture_gain * problem.dt),
        )
        self._tasks = [self._tool, posture]
        self._acceleration = AccelerationLimit(oink, problem.dt, problem.a_max)
        self._limits = [
            PositionLimit(oink, 1.0),
            VelocityLimit(oink, problem.dt, problem.v_max),
            self._acceleration,
        ]
        self._barriers = []
        if problem.rows:
            options = SelfCollisionBarrierOptions(
                n_collision_pairs=problem.rows,
                gain=problem.rate,
                safe_displacement_gain=0.0,
                d_min=problem.safe,
                d_max=problem.influence,
            )
            self._barriers.append(SelfCollisionBarrier(oink, scene, problem.dt, options))
        self._q = problem.q.copy()
        self._v = problem.v_previous.copy()
        self._targets = [np.asfortranarray(T) for T in problem.T_world_target]
        self._step = np.zeros(oink.num_variables)

    def step(self, k: int) -> Array:
        """One step of OInK at state k."""
        self._tool.setTargetFrameTransform(self._targets[k])
        self._acceleration.setLastVelocity(self._v[k])
        self._oink.solveIk(
            self._q[k], self._tasks, self._limits, self._barriers, self._step, self._damping
        )
        return self._step

    def velocities(self, k: int, answer: Array) -> Array:
        """Joint velocities: the answer is a displacement of one step."""
        return answer / self._dt


def _with_shapes(problem: Problem) -> str:
    """The URDF with capsules and the base's box.

    Pinocchio takes a cylinder for a capsule where `collision_checking` says so.
    """
    robot = ET.fromstring(problem.urdf)
    links = {link.get("name"): link for link in robot.iterfind("link")}
    for name, link, ends, radius in problem.capsules():
        T, length = capsule_frame(ends)
        shape = _add_shape(links[link], name, T)
        ET.SubElement(shape, "cylinder", radius=repr(float(radius)), length=repr(length))
        checking = ET.SubElement(links[link], "collision_checking")
        ET.SubElement(checking, "capsule", name=name)
    size = " ".join(repr(float(value)) for value in problem.base_box[3:])
    shape = _add_shape(links[problem.base_link], "base", _at(problem.base_box[:3]))
    ET.SubElement(shape, "box", size=size)
    return ET.tostring(robot, encoding="unicode")


def _add_shape(link: ET.Element, name: str, T: Array) -> ET.Element:
    collision = ET.SubElement(link, "collision", name=name)
    angles = pin.rpy.matrixToRpy(T[:3, :3])
    words = [" ".join(repr(float(value)) for value in vector) for vector in (T[:3, 3], angles)]
    ET.SubElement(collision, "origin", xyz=words[0], rpy=words[1])
    return ET.SubElement(collision, "geometry")


def _at(position: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = position
    return T


def _add_boxes(scene: Scene, problem: Problem) -> None:
    """The scene's boxes, and no pairs but the problem's."""
    for i, box in enumerate(problem.boxes):
        scene.addBoxGeometry(f"box{i}", "world", Box(*box[3:]), _at(box[:3]), np.ones(4))
    body = dict(zip(problem.capsule_names, problem.capsule_links, strict=True))
    body["base"] = problem.base_link
    assert len(set(body.values())) == len(body)  # pairs are of bodies here
    bodies = [*body.values(), *(f"box{i}" for i in range(len(problem.boxes)))]
    scene.setCollisions(list(combinations(bodies, 2)), False)
    wanted = [(body.get(a, a), body.get(b, b)) for a, b in problem.pairs()]
    scene.setCollisions(wanted, True)


def _build(problem: Problem, arguments: Sequence[str]) -> RoboPlan:
    return RoboPlan(problem)


if __name__ == "__main__":
    serve(_build)
