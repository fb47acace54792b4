"""The robot: its meshes sent once, its joints' transforms in columns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from motm_wbc.errors import InputError, UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.recording.timeline import Channel, TimeLine

ROOT = "/robot"
_JOINTS = f"{ROOT}/joints"


def read_urdf(path: Path) -> Any:
    """The robot's description as rerun's tree.

    Raises:
        InputError: it can't be read.
    """
    from rerun.urdf import UrdfTree

    # The prefix goes without its slash, else rerun takes the slash for a part of the name.
    prefix, links = ROOT.removeprefix("/"), f"{ROOT}/links"
    try:
        return UrdfTree.from_file_path(path, prefix, static_transform_entity_path=links)
    except Exception as error:
        raise InputError(f"can't be read as a URDF: {error}", str(path)) from None


def hidden(tree: Any) -> list[str]:
    """Roots of what is in the recording but not shown at first: the collision shapes."""
    return [f"{ROOT}/{tree.name}/collision_geometries"]


class RobotLayer:
    """A robot described by a URDF whose root is fixed in the world."""

    def __init__(
        self,
        timeline: TimeLine,
        stream: Any,
        tree: Any,
        base_joints: Sequence[str],
        arm_joints: Sequence[str],
        finger_joints: Sequence[str],
    ) -> None:
        """Send the meshes.

        Args:
            timeline: the recording's time line.
            stream: the recording stream.
            tree: the robot's description; mesh files by path, not by `package://`.
            base_joints: names of the three joints x [m], y [m], heading [rad], from the root.
            arm_joints: n names.
            finger_joints: the gripper's width is shared out evenly among these.

        Raises:
            UnknownName: the description has no such joint.
        """
        import rerun as rr

        names = (*base_joints, *arm_joints, *finger_joints)
        joints = {joint.name: joint for joint in tree.joints()}
        for name in names:
            if name not in joints:
                raise UnknownName("joint", name, joints, f"URDF of {tree.name}")
        tree.log_urdf_to_recording(stream)
        # The tree has named frames of its own; this hangs its root into the scene.
        timeline.static(
            f"{ROOT}/root",
            rr.Transform3D(parent_frame="tf#/", child_frame=tree.root_link().name),
        )
        self._fingers = len(finger_joints)
        self._channels = [_joint_channel(timeline, joints[name]) for name in names]

    def add(self, time: float, base_pose: Array, q: Array, gripper_width: float) -> None:
        """The joints' positions at `time` [s]: base (3,), arm (n,), and the gripper's [m]."""
        finger = gripper_width / max(self._fingers, 1)
        values = (*base_pose.tolist(), *q.tolist(), *[finger] * self._fingers)
        for channel, value in zip(self._channels, values, strict=True):
            channel.add(time, value)


def _joint_channel(timeline: TimeLine, joint: Any) -> Channel[float]:
    def encode(values: Sequence[float]) -> Any:
        # A picture of what was so, hence no clamping to the joint's limits.
        return joint.compute_transform_columns(values, clamp=False)

    return timeline.channel(f"{_JOINTS}/{joint.name}", encode)
