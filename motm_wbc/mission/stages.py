"""What the arm is at, what it is told about the moment, and what it orders."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event
from motm_wbc.mission.arrival import Arrival
from motm_wbc.mission.cylinder import CylinderPoint


class Stage(enum.StrEnum):
    """Stages of a pick or a place."""

    LIFT = "lift"
    TRAVEL = "travel"
    REACH = "reach"
    DESCEND = "descend"
    CLOSE = "close"
    REOPEN = "reopen"
    RELEASE = "release"
    RETREAT = "retreat"
    LOST = "lost"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Moment:
    """All that a step's machine may look at.

    Attributes:
        time: [s].
        T_world_tool: (4, 4).
        tool_velocity: (3,) of the tool's origin in the world [m/s].
        T_world_object: (4, 4) of the step's object.
        gripper_width: [m].
        fingers_loaded: both fingers feel something.
        arrival: when the step's target comes into range; None if never on the present plan.
        start_before: time before the arrival at which the reach has to start [s].
        in_range: the target is in range now.
        tool_bearing: of the tool from the arm's base, in the world [rad].
        target_bearing: of the step's target, likewise [rad].
    """

    time: float
    T_world_tool: Array
    tool_velocity: Array
    T_world_object: Array
    gripper_width: float
    fingers_loaded: bool
    arrival: Arrival | None
    start_before: float
    in_range: bool
    tool_bearing: float
    target_bearing: float

    @property
    def tool_position(self) -> Array:
        """(3,) [m]."""
        return np.asarray(self.T_world_tool[:3, 3])


@dataclass(frozen=True, slots=True)
class ToolOrder:
    """Where the tool shall go in this control step.

    Attributes:
        point: (3,) world point, or None.
        cylinder: point that moves with the arm's base, or None; with neither, the arm only
            keeps its posture.
        yaw: of the tool in the world [rad]; None leaves it free.
        climb: largest vertical speed [m/s].
        gripper_width: [m].
        T_world_target: (4, 4) what it is all for, for reports; None if nothing is in sight.
        may_touch: the held object may touch its support.
    """

    point: Array | None
    cylinder: CylinderPoint | None
    yaw: float | None
    climb: float
    gripper_width: float
    T_world_target: Array | None
    may_touch: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """A step machine's answer.

    Attributes:
        order: for the arm.
        stage: where the machine stands now.
        events: what happened.
    """

    order: ToolOrder
    stage: Stage
    events: tuple[Event, ...] = ()


def rest_order(gripper_width: float) -> ToolOrder:
    """The arm keeps its posture, the gripper its width."""
    return ToolOrder(None, None, None, 0.0, gripper_width, None)


def is_due(now: Moment) -> bool:
    """Whether the reach has to start now to be there when the target comes into range."""
    if now.in_range:
        return True
    return now.arrival is not None and now.arrival.time <= now.start_before
