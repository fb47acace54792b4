"""pink as a contestant: `python worker_pink.py PROBLEM`, in an environment of pink's own."""

from collections.abc import Sequence
from importlib.metadata import version

import coal
import numpy as np
import pink
import pinocchio as pin
import qpsolvers
from motm_bench import Array, Problem, capsule_frame, fastest, serve
from pink.barriers import SelfCollisionBarrier
from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit
from pink.tasks import DampingTask, FrameTask, PostureTask

SOLVERS = ("daqp", "quadprog", "proxqp", "osqp")


class Pink:
    """The problem as pink states it; see the documentation for what it leaves out."""

    def __init__(self, problem: Problem, solver: str) -> None:
        self.about = {"library": f"pin-pink {version('pin-pink')}", "solver": solver}
        self._solver, self._dt = solver, problem.dt
        model = pin.buildModelFromXML(problem.urdf)
        assert tuple(model.names)[1:] == problem.joints
        model.lowerPositionLimit, model.upperPositionLimit = problem.lower, problem.upper
        model.velocityLimit = problem.v_max
        geometry = _geometry(model, problem) if problem.rows else None
        self._configuration = pink.Configuration(
            model, model.createData(), problem.q[0], copy_data=False, collision_model=geometry
        )
        self._tool = FrameTask(
            problem.tool_link,
            position_cost=problem.linear_weight**0.5,
            orientation_cost=problem.angular_weight**0.5,
        )
        posture = PostureTask(
            cost=np.concatenate((np.zeros(3), np.sqrt(problem.posture_weights))),
            gain=problem.posture_gain * problem.dt,
        )
        posture.set_target(np.concatenate((np.zeros(3), problem.posture)))
        self._tasks = [self._tool, posture, DampingTask(cost=problem.damping**0.5)]
        self._acceleration = AccelerationLimit(model, problem.a_max)
        self._limits = [
            ConfigurationLimit(model, config_limit_gain=1.0),
            VelocityLimit(model),
            self._acceleration,
        ]
        self._barriers = (
            [
                SelfCollisionBarrier(
                    problem.rows, gain=problem.rate, safe_displacement_gain=0.0, d_min=problem.safe
                )
            ]
            if problem.rows
            else []
        )
        self._states = [
            (problem.q[k], problem.v_previous[k], pin.SE3(problem.T_world_target[k]))
            for k in range(len(problem))
        ]

    def step(self, k: int) -> Array:
        """One step of pink at state k."""
        q, v, target = self._states[k]
        self._configuration.update(q)
        self._tool.set_target(target)
        self._acceleration.set_last_integration(v, self._dt)
        return pink.solve_ik(
            self._configuration,
            self._tasks,
            self._dt,
            solver=self._solver,
            limits=self._limits,
            barriers=self._barriers,
            safety_break=False,
        )

    def velocities(self, k: int, answer: Array) -> Array:
        """Joint velocities: the answer as it is."""
        return answer


def _geometry(model: pin.Model, problem: Problem) -> pin.GeometryModel:
    """Capsules and boxes, and the pairs that keep apart."""
    geometry = pin.GeometryModel()
    for name, link, ends, radius in problem.capsules():
        T, length = capsule_frame(ends)
        _add(geometry, model, name, link, pin.SE3(T), coal.Capsule(radius, length))
    box = problem.base_box
    place = pin.SE3(np.eye(3), box[:3])
    _add(geometry, model, "base", problem.base_link, place, coal.Box(box[3:]))
    for i, box in enumerate(problem.boxes):
        place = pin.SE3(np.eye(3), box[:3])
        _add(geometry, model, f"box{i}", "universe", place, coal.Box(box[3:]))
    for first, second in problem.pairs():
        pair = geometry.getGeometryId(first), geometry.getGeometryId(second)
        geometry.addCollisionPair(pin.CollisionPair(*pair))
    return geometry


def _add(
    geometry: pin.GeometryModel,
    model: pin.Model,
    name: str,
    link: str,
    place: pin.SE3,
    shape: object,
) -> None:
    frame = model.getFrameId(link)
    joint = model.frames[frame].parentJoint
    placement = model.frames[frame].placement * place
    geometry.addGeometryObject(pin.GeometryObject(name, joint, frame, placement, shape))


def _build(problem: Problem, arguments: Sequence[str]) -> Pink:
    solvers = arguments or [name for name in SOLVERS if name in qpsolvers.available_solvers]
    return fastest(lambda solver: Pink(problem, solver), solvers, len(problem))


if __name__ == "__main__":
    serve(_build)
