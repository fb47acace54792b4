"""The robot's capsules and the held object, as segments with radii."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import Configuration, Part, RobotModel
from motm_wbc.qp.held import box_segments
from motm_wbc.qp.tasks import HeldObject


class RobotSegments:
    """Segments of the robot's capsules, then those of the held object if there is one.

    Attributes:
        names: (k,) of the capsules; the held object's segments have its name.
        parts: (k,) what each belongs to.
        radius: (k,) [m].
        ball: (k,) radius of the ball about each segment's centre that holds it all [m].
        moved_by: (k, n_base + n_arm) 1.0 for each input that moves the segment.
        held: the held object.

    Args:
        model: the robot.
        held: the object in the gripper, or None.
    """

    def __init__(self, model: RobotModel, held: HeldObject | None) -> None:
        self.held = held
        self.names: tuple[str, ...] = model.capsules.names
        self.parts: tuple[Part, ...] = model.capsules.part
        self.radius = np.asarray(model.capsules.radius, dtype=float)
        self.moved_by = np.asarray(model.capsule_moved_by, dtype=float)
        local = model.capsule_ends
        if held is not None:
            ends, radius = box_segments(held.size)
            self._held_in_tool = ends @ held.T_tool_held[:3, :3].T + held.T_tool_held[:3, 3]
            self.names += (held.name,) * len(ends)
            self.parts += (Part.HELD,) * len(ends)
            self.radius = np.concatenate((self.radius, radius))
            self.moved_by = np.concatenate(
                (self.moved_by, np.ones((len(ends), count_inputs(model))))
            )
            local = np.concatenate((local, ends))
        reach = local[:, 1] - local[:, 0]
        self.ball = 0.5 * np.sqrt((reach * reach).sum(axis=1)) + self.radius

    def __len__(self) -> int:
        return len(self.names)

    def matches(self, held: HeldObject | None) -> bool:
        """Whether these segments are right for what is held now."""
        mine = self.held
        if held is mine:
            return True
        return (
            held is not None
            and mine is not None
            and held.name == mine.name
            and held.contact_allowed == mine.contact_allowed
            and np.array_equal(held.size, mine.size)
            and np.array_equal(held.T_tool_held, mine.T_tool_held)
        )

    def ends(self, configuration: Configuration) -> Array:
        """(k, 2, 3) ends of the segments in the world [m]."""
        segments = configuration.capsule_segments()
        if self.held is None:
            return segments
        T = configuration.T_world_tool
        held = self._held_in_tool @ T[:3, :3].T + T[:3, 3]
        return np.concatenate((segments, held))


def count_inputs(model: RobotModel) -> int:
    """Number of inputs: the base's and the arm's."""
    return model.n_base + model.n_arm
