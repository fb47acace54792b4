"""Lines that go with the robot: footprint, trail, the target's rings, the tool's target."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import GroundTruth, StepReport
from motm_wbc.recording import colours
from motm_wbc.recording.encoders import Arrows, arrows, planar_poses, strips
from motm_wbc.recording.solids import ring
from motm_wbc.recording.timeline import TimeLine
from motm_wbc.scene.scenario import Scenario

BASE = "/base"
TRAIL = f"{BASE}/trail"
TARGET = "/target"
TOOL_TARGET = "/tool_target"
_AXIS_LENGTH = 0.12  # [m]


class BaseLines:
    """Footprint and trail of the base."""

    def __init__(self, timeline: TimeLine, footprint: Array) -> None:
        """Send the outline, `footprint` (n, 2) [m]."""
        import rerun as rr

        self._last: Array | None = None
        # The trail's segments are in the world, so they are no children of the moving base.
        self._base = timeline.channel(f"{BASE}/pose", planar_poses)
        self._trail = timeline.channel(TRAIL, strips)
        outline = np.vstack([footprint, footprint[:1]])
        nose = np.array([[0.0, 0.0], [float(footprint[:, 0].max()), 0.0]])
        timeline.static(
            f"{BASE}/pose/footprint",
            rr.LineStrips3D(
                [_on_floor(outline, 0.03), _on_floor(nose, 0.03)],
                colors=[colours.FOOTPRINT],
                radii=[0.009],
            ),
        )
        timeline.static(TRAIL, rr.LineStrips3D.from_fields(colors=[colours.TRAIL], radii=[0.008]))

    def add(self, time: float, pose: Array) -> None:
        """Stamp the base's pose (3,) at `time` [s]."""
        position = pose[:2].copy()
        last = position if self._last is None else self._last
        self._last = position
        self._base.add(time, pose.copy())
        self._trail.add(time, [_on_floor(np.vstack([last, position]), 0.014).astype(np.float32)])


class Overlay:
    """Footprint and trail of the base; circles about the target; frame that the tool is after."""

    def __init__(
        self,
        timeline: TimeLine,
        scenario: Scenario,
        footprint: Array,
        ring_radius: float,
        reach_radius: float,
    ) -> None:
        """Send the shapes: `footprint` (n, 2) [m]; radii of candidates and of reach [m]."""
        import rerun as rr

        self._scenario = scenario
        self._base = BaseLines(timeline, footprint)
        self._target = timeline.channel(TARGET, planar_poses)
        self._tool_target = timeline.channel(TOOL_TARGET, arrows)
        circles = {"ring": (ring_radius, colours.CANDIDATE_RING, 0.004)}
        circles["reach"] = (reach_radius, colours.REACH_RING, 0.006)
        for name, (radius, colour, thickness) in circles.items():
            timeline.static(
                f"{TARGET}/{name}",
                rr.LineStrips3D([ring(radius, 0.008)], colors=[colour], radii=[thickness]),
            )
        timeline.static(
            TOOL_TARGET,
            rr.Arrows3D.from_fields(radii=[0.008]),
        )

    def add(self, time: float, truth: GroundTruth, report: StepReport) -> None:
        """Stamp every entity at `time` [s]."""
        self._base.add(time, truth.base_pose)
        self._target.add(time, self._target_pose(truth, report.step_index))
        self._tool_target.add(time, _axes(report.T_world_target))

    def _target_pose(self, truth: GroundTruth, step_index: int) -> Array:
        """Where the circles are drawn about: the object to pick, or the place to put it."""
        step = self._scenario.task[min(max(step_index, 0), len(self._scenario.task) - 1)]
        if step.at is not None:
            return np.array([*step.at, 0.0])
        x, y = truth.objects[step.object][:2, 3] if step.object in truth.objects else (0.0, 0.0)
        return np.array([x, y, 0.0])


def _on_floor(points: Array, height: float) -> Array:
    return np.column_stack([points, np.full(len(points), height)])


def _axes(pose: Array | None) -> Arrows:
    """A frame (4, 4) as three arrows."""
    count = 0 if pose is None else 3
    matrix = np.eye(4) if pose is None else pose
    return Arrows(
        origins=np.tile(matrix[:3, 3], (count, 1)),
        vectors=_AXIS_LENGTH * matrix[:3, :count].T,
        colours=np.array(colours.AXES[:count], dtype=np.uint32),
    )
