"""What all simulated plants share: time, the gripper's logic, sensing, what moves by itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Command, Event, GroundTruth, MovingBody, RobotState, WorldState
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.scene.scenario import GraspFailure, Scenario
from motm_wbc.simulation.bodies import ObjectShape
from motm_wbc.simulation.grasp import Attempt, FailureModel, Fingers, Gripper, Release
from motm_wbc.simulation.hits import HitWatch
from motm_wbc.simulation.parameters import PhysicsParameters
from motm_wbc.simulation.sensing import Sensors


@dataclass(frozen=True, slots=True)
class PlantSetup:
    """All that a plant is made from.

    Attributes:
        scenario: the world.
        model: the robot.
        control_period: time between commands [s].
        seed: of noise and of random grasp failures, >= 0; 0 is the nominal run.
        parameters: numbers of the physics.
        failure: which grasp attempts fail.

    Raises:
        InputError: the control period or the seed is not legal.
    """

    scenario: Scenario
    model: RobotModel
    control_period: float
    seed: int
    parameters: PhysicsParameters
    failure: GraspFailure

    def __post_init__(self) -> None:
        if not 1e-4 <= self.control_period <= 1.0:
            raise InputError(f"{self.control_period} s; legal: 0.0001 to 1 s", "control_period")
        if self.seed < 0:
            raise InputError(f"{self.seed}; legal: whole numbers from 0 on", "seed")


class SimulatedPlant(ABC):
    """A robot and its world in simulation.

    Randomness comes from two streams of one seed, for noise and for grasp failures, so that
    neither shifts the other; seed 0 is the nominal run, without noise.

    Attributes:
        scenario: the world as it was at the start.
        model: the robot.

    Args:
        setup: what it is made from.
    """

    def __init__(self, setup: PlantSetup) -> None:
        scenario, model, parameters = setup.scenario, setup.model, setup.parameters
        self.scenario = scenario
        self.model = model
        self._parameters = parameters
        self._control_period = setup.control_period
        self._substeps = max(1, round(setup.control_period * parameters.physics_rate))
        self._dt = setup.control_period / self._substeps
        self._count = 0
        self._events: list[Event] = []
        self._hits = HitWatch()
        self._shapes = {thing.name: ObjectShape.of(thing) for thing in scenario.objects}
        self._moving = {o.name: o for o in scenario.obstacles if any(o.velocity)}
        noise, chance = np.random.SeedSequence(setup.seed).spawn(2)
        self._gripper = Gripper(
            self._shapes,
            Fingers(model.description.gripper, parameters.close_speed_scale),
            FailureModel(setup.failure, setup.control_period, np.random.default_rng(chance)),
            parameters,
        )
        generator = np.random.default_rng(noise) if setup.seed else None
        self._sensors = Sensors(scenario.sensing, setup.control_period, generator)
        self._closing_axis = np.array(model.description.tool.closing_axis)

    @property
    def control_period(self) -> float:
        """Time between commands [s]."""
        return self._control_period

    @property
    def physics_period(self) -> float:
        """Time between physics steps [s]."""
        return self._dt

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._count * self._dt

    @property
    def attempts(self) -> tuple[Attempt, ...]:
        """Grasp attempts so far, in order."""
        return tuple(self._gripper.attempts)

    @property
    def releases(self) -> tuple[Release, ...]:
        """Objects let go so far, in order."""
        return tuple(self._gripper.releases)

    @property
    def grasp_time(self) -> Mapping[str, float]:
        """Object -> time at which its last grasp took hold [s]."""
        return dict(self._gripper.grasp_time)

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened in the physics, in order: hits by a finger, grasps, releases."""
        return tuple(self._events)

    def sense(self) -> tuple[RobotState, WorldState]:
        """The newest sample of the sensors."""
        return self._sensors.newest()

    def truth(self) -> GroundTruth:
        """What is so, for those who judge a run."""
        return GroundTruth(
            time=self.time,
            base_pose=self._base_pose(),
            base_velocity=self._base_velocity(),
            q=self._arm_position(),
            v=self._arm_velocity(),
            gripper_width=self._gripper_width(),
            objects=self._object_poses(),
            moving=self._moving_bodies(),
            held=self._gripper.held,
            T_tool_held=self._T_tool_held(),
        )

    def step(
        self, command: Command, on_substep: Callable[[GroundTruth], None] | None = None
    ) -> None:
        """Carry out `command` for one control period; `on_substep` sees each physics step."""
        self._command_gripper(command.gripper_width)
        for _ in range(self._substeps):
            self._gripper.fingers.advance(self._gripper_width(), self._dt)
            if self._gripper.must_release():
                name = self._gripper.release(self.time)
                self._let_go(name)
                self._report("released", f"{name} was let go")
            self._count += 1
            self._advance(command)
            if on_substep is not None:
                on_substep(self.truth())
        self._sample_sensors()

    @abstractmethod
    def close(self) -> None:
        """Free what the plant holds."""

    def _sample_sensors(self) -> None:
        self._sensors.observe(self.truth(), self._fingers_loaded())

    def _command_gripper(self, width: float) -> None:
        begins = self._gripper.fingers.command(width, self._gripper_width())
        if begins and self._gripper.held is None:
            T_world_tool = self._T_world_tool()
            axis = T_world_tool[:3, :3] @ self._closing_axis
            step = self._count // self._substeps
            self._gripper.begin_closing(step, self.time, T_world_tool, axis, self._object_poses())

    def _take(self, name: str, width: float) -> None:
        """Both fingers touch an object that an attempt is made on: it is held from now on."""
        self._gripper.take(name, width, self.time)
        self._report("grasped", f"{name} is in the gripper")

    def _pushed(self, name: str, distance: float) -> None:
        """A finger has moved an unheld object by so much [m] in this physics step."""
        if not self._gripper.fingers.closing and self._hits.push(name, distance, self.time):
            self._report("finger_hit", f"a finger pushes {name}", "warn")

    def _report(self, kind: str, text: str, level: str = "info") -> None:
        self._events.append(Event(self.time, kind, text, level))

    def _moving_bodies(self) -> Mapping[str, MovingBody]:
        bodies = {}
        for name, obstacle in self._moving.items():
            velocity = np.array(obstacle.velocity)
            pose = obstacle.pose + self.time * velocity
            bodies[name] = MovingBody(se2.compose(pose, np.zeros(3)), velocity)
        return bodies

    @abstractmethod
    def _advance(self, command: Command) -> None:
        """Carry out `command` for one physics step; `time` is already that of its end."""

    @abstractmethod
    def _let_go(self, name: str) -> None:
        """The fingers have opened: set the held object free."""

    @abstractmethod
    def _base_pose(self) -> Array:
        """(3,)."""

    @abstractmethod
    def _base_velocity(self) -> Array:
        """Base inputs."""

    @abstractmethod
    def _arm_position(self) -> Array:
        """(n,)."""

    @abstractmethod
    def _arm_velocity(self) -> Array:
        """(n,)."""

    @abstractmethod
    def _gripper_width(self) -> float:
        """[m]."""

    @abstractmethod
    def _fingers_loaded(self) -> bool:
        """Both fingers feel something between them."""

    @abstractmethod
    def _T_world_tool(self) -> Array:
        """(4, 4)."""

    @abstractmethod
    def _object_poses(self) -> Mapping[str, Array]:
        """Name -> (4, 4)."""

    @abstractmethod
    def _T_tool_held(self) -> Array | None:
        """(4, 4) pose of the held object in the tool frame, or None."""
