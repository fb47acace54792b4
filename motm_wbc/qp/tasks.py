"""What the controller is asked to do in one step, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from motm_wbc.geometry.arrays import Array


def _all_axes() -> Array:
    return np.ones(6)


@dataclass(frozen=True, slots=True, eq=False)
class ToolTask:
    """A twist that the tool shall have.

    Attributes:
        twist: (6,) linear [m/s], then angular [rad/s], at the tool's origin in world axes.
        weights: (6,) how much each axis of the task frame counts: 1 in full, 0 free.
        R_world_task: (3, 3) axes that `weights` is given in; the world's by default.
        position_error: distance that is left to the tool's goal [m], 1-norm. Holistic's
            weights depend on it; None: as far as the servo gain makes it of the twist.
    """

    twist: Array
    weights: Array = field(default_factory=_all_axes)
    R_world_task: Array = field(default_factory=lambda: np.eye(3))
    position_error: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class BaseTask:
    """What the base shall do.

    Attributes:
        reference: (n_base,) base inputs that navigation asks for [m/s, rad/s].
        follow: True: navigation leads, and one factor in [0, 1] scales its inputs, so that
            the base stays on the arc that was checked. False: the base's inputs are free
            (Haviland et al., "A Holistic Approach to Reactive Mobile Manipulation", 2022),
            `reference` is left out of account.
    """

    reference: Array
    follow: bool = True


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
