"""The robot's capsules and the held object, as segments with radii."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, BoolArray, IntArray
from motm_wbc.geometry.jit import inlined
from motm_wbc.kinematics import Part, RobotModel
from motm_wbc.qp.held import box_segments
from motm_wbc.qp.tasks import HeldObject

_FREE_JOINTS = 2  # with fewer joints the arm can't pull a link back while the base goes on


class SegmentArrays(NamedTuple):
    """Segments with radii that move with joint frames, k of them; the last is the base.

    The base is a prism, solid 0 of the scene: its segment has no place and no size.

    Attributes:
        joint: (k,) joint frame that each moves with.
        local: (k, 2, 3) ends in that frame [m].
        radius: (k,) [m].
        moved_by: (k, n_inputs) 1.0 for each input that moves the segment.
        is_held: (k,) it belongs to the held object.
        on_base: (k,) it stands on the base: the arm can't pull it back.
    """

    joint: IntArray
    local: Array
    radius: Array
    moved_by: Array
    is_held: BoolArray
    on_base: BoolArray


@inlined
def place_segments(
    segments: SegmentArrays, rotations: Array, translations: Array, ends: Array
) -> None:
    """Write the ends (k, 2, 3) of all segments in the world [m].

    Args:
        segments: of the robot.
        rotations: (m, 3, 3) of the joint frames.
        translations: (m, 3) of the joint frames [m].
        ends: is written.
    """
    for k in range(len(segments.joint)):
        R, p = rotations[segments.joint[k]], translations[segments.joint[k]]
        for e in range(2):
            x, y, z = segments.local[k, e, 0], segments.local[k, e, 1], segments.local[k, e, 2]
            for i in range(3):
                ends[k, e, i] = p[i] + R[i, 0] * x + R[i, 1] * y + R[i, 2] * z


class RobotSegments:
    """Segments of the robot's capsules, of the held object if there is one, and the base.

    Attributes:
        names: (k,) of the capsules; the held object's segments have its name.
        parts: (k - 1,) what each belongs to; the base is none of them.
        held: the held object.
        finite: whether its size and its place are numbers.
        arrays: the segments.

    Args:
        model: the robot.
        held: the object in the gripper, or None.
    """

    def __init__(self, model: RobotModel, held: HeldObject | None) -> None:
        self.held = held
        self._size = np.array(np.nan if held is None else held.size, dtype=float)
        self._tool_joint, self._T_joint_tool = model.tool_frame
        self.finite = True
        self.names: tuple[str, ...] = model.capsules.names
        self.parts: tuple[Part, ...] = model.capsules.part
        joint, local = model.capsule_joint, model.capsule_ends
        radius, moved_by = model.capsules.radius, model.capsule_moved_by
        if held is not None:
            self._box, thickness = box_segments(held.size)
            self.names += (held.name,) * len(self._box)
            self.parts += (Part.HELD,) * len(self._box)
            joint = np.append(joint, np.full(len(self._box), self._tool_joint))
            local = np.concatenate((local, self._in_joint_frame(held)))
            radius = np.concatenate((radius, thickness))
            moved_by = np.concatenate((moved_by, np.ones((len(self._box), moved_by.shape[1]))))
        self.names += ("base",)
        base = np.append(np.ones(model.n_base), np.zeros(model.n_arm))
        moved_by = np.concatenate((moved_by, base[None]))
        self.arrays = SegmentArrays(
            joint=np.append(joint, 0).astype(np.int64),
            local=np.concatenate((local, np.zeros((1, 2, 3)))),
            radius=np.append(radius, 0.0),
            moved_by=np.array(moved_by, dtype=float),
            is_held=np.array([*(part is Part.HELD for part in self.parts), False]),
            on_base=moved_by[:, model.n_base :].sum(axis=1) < _FREE_JOINTS,
        )

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
        if not np.array_equal(held.size, self._size):
            return False
        self.held = held
        self.arrays.local[-1 - len(self._box) : -1] = self._in_joint_frame(held)
        return True

    def _in_joint_frame(self, held: HeldObject) -> Array:
        T = self._T_joint_tool @ held.T_tool_held
        ends = np.asarray(self._box @ T[:3, :3].T + T[:3, 3])
        self.finite = bool(np.isfinite(ends).all())
        return ends


def _same_kind(first: HeldObject, second: HeldObject) -> bool:
    """Whether two held objects differ at most in their size and where the tool holds them."""
    return first.name == second.name and first.contact_allowed == second.contact_allowed
