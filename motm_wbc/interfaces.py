"""What passes between the rooms, as plain data, and the protocols that they meet through.

Units are SI and radians. Poses of the base are (x, y, heading); poses of bodies are 4 x 4
homogeneous matrices, named by frames: `T_world_tool` maps tool coordinates to world ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from motm_wbc.geometry.arrays import Array, IntArray


@dataclass(frozen=True, slots=True)
class RobotState:
    """The robot at one instant, as its own sensors tell it.

    Attributes:
        time: instant of the measurement [s].
        base_pose: (3,) x [m], y [m], heading [rad] in the world.
        base_velocity: base inputs, (v, omega) or (v_x, v_y, omega) [m/s, rad/s].
        q: (n,) arm joint positions [rad or m].
        v: (n,) arm joint velocities.
        gripper_width: distance between the fingers [m].
        fingers_loaded: both fingers feel something between them.
    """

    time: float
    base_pose: Array
    base_velocity: Array
    q: Array
    v: Array
    gripper_width: float
    fingers_loaded: bool


@dataclass(frozen=True, slots=True)
class MovingBody:
    """A solid of the scene that does not rest: its pose and constant velocity.

    Attributes:
        pose: (3,) x [m], y [m], heading [rad].
        velocity: (3,) in world axes [m/s, m/s, rad/s].
    """

    pose: Array
    velocity: Array


@dataclass(frozen=True, slots=True)
class WorldState:
    """The world at one instant, as sensing tells it.

    Attributes:
        time: instant of the measurement [s].
        objects: name of each object -> T_world_object, (4, 4).
        moving: name of each moving solid -> its pose and velocity.
    """

    time: float
    objects: Mapping[str, Array]
    moving: Mapping[str, MovingBody] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Command:
    """What the robot shall do in the next control step.

    Attributes:
        base: base inputs, (v, omega) or (v_x, v_y, omega) [m/s, rad/s].
        arm: (n,) joint velocities [rad/s or m/s].
        gripper_width: width that the fingers shall move to [m].
    """

    base: Array
    arm: Array
    gripper_width: float


@dataclass(frozen=True, slots=True)
class Event:
    """Something that a reader of the run wants to know of.

    Attributes:
        time: [s].
        kind: short name, for example `attempt`, `grasped`, `goal`, `fallback`.
        text: one line.
        level: `info`, `warn` or `error`.
    """

    time: float
    kind: str
    text: str
    level: str = "info"


@dataclass(frozen=True, slots=True)
class BaseReport:
    """What the base's method decided at one base step, for the recorder and the trace.

    Attributes:
        goal: (3,) pose that the base is driven to, or None if it stands.
        candidates: (m, 3) candidate poses.
        costs: (m,) their costs [s]; infinite where rejected.
        rejections: (m,) 0 where a candidate is legal, else index into `reasons`.
        reasons: names of the reasons for rejection; `reasons[0]` is "".
        selected: index of the chosen candidate, -1 for none.
        global_path: (k, 2) points [m].
        local_plan: (j, 4) time from now [s], x, y, heading.
        braking: (b, 3) the checked braking arc of the command.
        compute_time: wall time of the base step [s].
        expansions: nodes that the local search expanded.
        clock_guard_fired: the search was ended by the clock.
        emergency: nothing but braking was possible.
    """

    goal: Array | None
    candidates: Array
    costs: Array
    rejections: IntArray
    reasons: Sequence[str]
    selected: int
    global_path: Array
    local_plan: Array
    braking: Array
    compute_time: float = 0.0
    expansions: int = 0
    clock_guard_fired: bool = False
    emergency: bool = False


@dataclass(frozen=True, slots=True)
class StepReport:
    """One control step, seen from inside.

    Attributes:
        time: [s].
        command: what was sent to the plant.
        base_reference: base inputs that navigation asked for.
        T_world_target: (4, 4) tool pose that the arm is after, or None.
        tool_error: distance from tool to target [m], NaN without a target.
        stage: name of what the mission is at, for example `reach`, `close`.
        rung: which rung of the controller's ladder answered; `full` in normal operation.
        active: names of the limits that held the command back.
        step_index: index of the task step at work.
        compute_time: wall time of the arm step [s].
        events: what happened in this step.
        base: the base step's report where this control step had one.
    """

    time: float
    command: Command
    base_reference: Array
    T_world_target: Array | None
    tool_error: float
    stage: str
    rung: str
    active: Sequence[str]
    step_index: int
    compute_time: float
    events: Sequence[Event] = ()
    base: BaseReport | None = None


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """The plant's true state, for the audit, the metrics and the recorder; never for control.

    Attributes:
        time: [s].
        base_pose: (3,).
        base_velocity: base inputs.
        q: (n,) arm joint positions.
        v: (n,) arm joint velocities.
        gripper_width: [m].
        objects: name -> T_world_object, (4, 4).
        moving: name of each moving solid -> its pose and velocity.
        held: name of the object in the gripper, or None.
        T_tool_held: (4, 4) pose of the held object in the tool frame, or None.
    """

    time: float
    base_pose: Array
    base_velocity: Array
    q: Array
    v: Array
    gripper_width: float
    objects: Mapping[str, Array]
    moving: Mapping[str, MovingBody]
    held: str | None
    T_tool_held: Array | None


class Plant(Protocol):
    """A robot and its world: simulated, or real.

    `sense` returns what the sensors tell, with their noise and delay; `truth` what is.
    Only a simulated plant knows the failure model of grasps.
    """

    @property
    def control_period(self) -> float:
        """Time between commands [s]."""

    def sense(self) -> tuple[RobotState, WorldState]:
        """The newest sample of the sensors."""

    def truth(self) -> GroundTruth:
        """What is so, for those who judge a run."""

    def step(
        self, command: Command, on_substep: Callable[[GroundTruth], None] | None = None
    ) -> None:
        """Carry out `command` for one control period; `on_substep` sees each physics step."""

    def close(self) -> None:
        """Free what the plant holds."""


class Recorder(Protocol):
    """Sees every state, decision and timing of a run; changes nothing."""

    def step(self, truth: GroundTruth, report: StepReport) -> None:
        """Record one control step."""

    def event(self, event: Event) -> None:
        """Record something that happened outside a control step."""

    def close(self) -> None:
        """Write what is left."""
