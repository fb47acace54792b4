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
            self._held_ends = ends
            self._held_in_tool = _placed(ends, held.T_tool_held)
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

    def regrip(self, held: HeldObject | None) -> bool:
        """Take over where the held object is now; False if it is another one, or other rules.

        Args:
            held: what is held now.
        """
        mine = self.held
        if held is mine:
            return True
        if held is None or mine is None or not _same_kind(held, mine):
            return False
        self.held = held
        self._held_in_tool = _placed(self._held_ends, held.T_tool_held)
        return True

    def ends(self, configuration: Configuration) -> Array:
        """(k, 2, 3) ends of the segments in the world [m]."""
        segments = configuration.capsule_segments()
        if self.held is None:
            return segments
        return np.concatenate((segments, _placed(self._held_in_tool, configuration.T_world_tool)))


def count_inputs(model: RobotModel) -> int:
    """Number of inputs: the base's and the arm's."""
    return model.n_base + model.n_arm


def _placed(ends: Array, T: Array) -> Array:
    """Segments' ends (k, 2, 3), given in the frame of T (4, 4), in its parent."""
    return np.asarray(ends @ T[:3, :3].T + T[:3, 3])


def _same_kind(first: HeldObject, second: HeldObject) -> bool:
    """Whether two held objects differ at most in where the tool holds them."""
    return (
        first.name == second.name
        and first.contact_allowed == second.contact_allowed
        and np.array_equal(first.size, second.size)
    )
