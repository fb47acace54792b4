"""What the controller is asked to do in one step, as plain data.

Costs are squared speeds: a task of weight w adds 1/2 w (what it wants - what it gets)^2, so a
weight of one makes a deviation of 1 m/s (or 1 rad/s) cost one half.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import TypeAlias

import numpy as np

from motm_wbc.geometry.arrays import Array

_AT_REST = np.zeros(6)
_ALL_AXES = np.ones(6)
_WORLD_AXES = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class ToolTask:
    """Motion of a frame of the robot: a twist, or a pose that moves.

    The frame's mean twist over the control step is asked to be

        twist + dt/2 acceleration + gain (T_world_target - T_world_frame)

    where the last term, which counts only if there is a target, is the pose error: a
    distance [m] and a rotation vector [rad].

    Attributes:
        twist: (6,) linear [m/s], then angular [rad/s], at the frame's origin in world axes;
            of the target, if there is one.
        T_world_target: (4, 4) where the frame shall be now, or None.
        acceleration: (6,) of the target [m/s^2, rad/s^2].
        gain: speed per error [1/s].
        weights: (6,) how much each axis of the task's own axes counts: 1 in full, 0 free.
            They multiply `linear_weight` and `angular_weight` of the parameters.
        R_world_task: (3, 3) axes that `weights` is given in; the world's by default.
        position_error: distance that is left to the tool's goal [m], 1-norm. Holistic's
            weights depend on it; None: the target's distance or, without one, as far as the
            servo gain makes it of the twist.
        frame: name of the link; None: the tool.
    """

    twist: Array = field(default_factory=lambda: _AT_REST)
    _: KW_ONLY
    T_world_target: Array | None = None
    acceleration: Array = field(default_factory=lambda: _AT_REST)
    gain: float = 5.0
    weights: Array = field(default_factory=lambda: _ALL_AXES)
    R_world_task: Array = field(default_factory=lambda: _WORLD_AXES)
    position_error: float | None = None
    frame: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class NavigatedBase:
    """Navigation leads the base, and the arm compensates.

    One factor in [0, 1] scales the inputs that navigation asks for, so that the base stays
    on the arc that was checked.

    Attributes:
        reference: (n_base,) base inputs that navigation asks for [m/s, rad/s].
    """

    reference: Array


@dataclass(frozen=True, slots=True, eq=False)
class FreeBase:
    """The base's inputs are free, as the arm's joints are; nobody navigates.

    With nothing given this is Holistic (Haviland et al., "A Holistic Approach to Reactive
    Mobile Manipulation", 2022): the farther the goal, the more the base moves; it turns
    toward the tool.

    Attributes:
        inputs: (n_base,) base inputs that are preferred [m/s, rad/s], or None.
        input_weights: (n_base,) weight of each; ones by default.
        heading: heading that is preferred [rad], or None.
        heading_weight: its weight.
        heading_gain: turn rate per heading error [1/s].
    """

    inputs: Array | None = None
    input_weights: Array | None = None
    heading: float | None = None
    heading_weight: float = 1.0
    heading_gain: float = 1.5


BaseTask: TypeAlias = NavigatedBase | FreeBase


@dataclass(frozen=True, slots=True, eq=False)
class PostureTask:
    """Where the arm's redundancy shall lead.

    Attributes:
        target: (n_arm,) preferred positions [rad or m].
        weights: (n_arm,) weight of each, zero for no preference.
        lower: (n_arm,) positions to stay above where that is possible; -inf for none.
        upper: (n_arm,) positions to stay below where that is possible; inf for none.
    """

    target: Array
    weights: Array
    lower: Array | None = None
    upper: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class LinearTask:
    """A task of one's own: J x = target in the least squares, x the inputs.

    Attributes:
        J: (m, n_base + n_arm) columns are the base's inputs in the base frame, then the
            arm's joints, as in `Configuration.J_tool`.
        target: (m,) wanted values of J x.
        weights: (m,) weight of each row.
    """

    J: Array
    target: Array
    weights: Array


@dataclass(frozen=True, slots=True, eq=False)
class HeldObject:
    """A box in the gripper, part of the hand as long as it is held.

    Attributes:
        name: of the object.
        size: (3,) extents of the box [m].
        T_tool_held: (4, 4) pose of the box's centre in the tool frame.
        contact_allowed: it may touch supports: from the grasp until it is lifted, and at
            the drop.
    """

    name: str
    size: Array
    T_tool_held: Array
    contact_allowed: bool = False
