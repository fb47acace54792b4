"""mink as a contestant: `python worker_mink.py PROBLEM`, in an environment of mink's own."""

from collections.abc import Sequence
from importlib.metadata import version
from xml.etree import ElementTree as ET

import mink
import mujoco
import numpy as np
import qpsolvers
from motm_bench import Array, Problem, capsule_frame, fastest, serve

SOLVERS = ("daqp", "quadprog", "proxqp", "osqp")


class Mink:
    """The problem as mink states it; see the documentation for what it leaves out."""

    def __init__(self, problem: Problem, solver: str) -> None:
        self.about = {"library": f"mink {version('mink')}", "solver": solver}
        self._solver, self._dt = solver, problem.dt
        model = _model(problem)
        assert tuple(model.joint(i).name for i in range(model.njnt)) == problem.joints
        model.jnt_range[:] = np.stack((problem.lower, problem.upper), axis=1)
        self._configuration = mink.Configuration(model)
        self._tool = mink.FrameTask(
            problem.tool_link,
            "body",
            position_cost=problem.linear_weight**0.5,
            orientation_cost=problem.angular_weight**0.5,
        )
        posture = mink.PostureTask(
            model,
            cost=np.concatenate((np.zeros(3), np.sqrt(problem.posture_weights))),
            gain=problem.posture_gain * problem.dt,
        )
        posture.set_target(np.concatenate((np.zeros(3), problem.posture)))
        self._tasks = [self._tool, posture, mink.DampingTask(model, problem.damping**0.5)]
        speeds = dict(zip(problem.joints, problem.v_max, strict=True))
        self._limits = [
            mink.ConfigurationLimit(model, gain=1.0),
            mink.VelocityLimit(model, speeds),
        ]
        if problem.rows:
            self._limits.append(
                mink.CollisionAvoidanceLimit(
                    model,
                    [([first], [second]) for first, second in problem.pairs()],
                    # mink bounds a displacement by gain * distance / dt
                    gain=problem.rate * problem.dt**2,
                    minimum_distance_from_collisions=problem.safe,
                    collision_detection_distance=problem.influence,
                )
            )
        self._states = [
            (problem.q[k], mink.SE3.from_matrix(problem.T_world_target[k]))
            for k in range(len(problem))
        ]

    def step(self, k: int) -> Array:
        """One step of mink at state k."""
        q, target = self._states[k]
        self._configuration.update(q)
        self._tool.set_target(target)
        return mink.solve_ik(
            self._configuration, self._tasks, self._dt, self._solver, limits=self._limits
        )

    def velocities(self, k: int, answer: Array) -> Array:
        """Joint velocities: the answer as it is."""
        return answer


def _model(problem: Problem) -> mujoco.MjModel:
    """The URDF with capsules and boxes."""
    robot = ET.fromstring(problem.urdf)
    options = ET.SubElement(robot, "mujoco")
    ET.SubElement(options, "compiler", fusestatic="false", balanceinertia="true")
    spec = mujoco.MjSpec.from_string(ET.tostring(robot, encoding="unicode"))
    for name, link, ends, radius in problem.capsules():
        T, length = capsule_frame(ends)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, T[:3, :3].ravel())
        spec.body(link).add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, 0.5 * length, 0.0],
            pos=T[:3, 3],
            quat=quaternion,
        )
    _add_box(spec.body(problem.base_link), "base", problem.base_box)
    for i, box in enumerate(problem.boxes):
        _add_box(spec.worldbody, f"box{i}", box)
    return spec.compile()


def _add_box(body: mujoco.MjsBody, name: str, box: Array) -> None:
    body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=box[:3], size=0.5 * box[3:])


def _build(problem: Problem, arguments: Sequence[str]) -> Mink:
    solvers = arguments or [name for name in SOLVERS if name in qpsolvers.available_solvers]
    return fastest(lambda solver: Mink(problem, solver), solvers, len(problem))


if __name__ == "__main__":
    serve(_build)
