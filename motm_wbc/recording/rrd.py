"""A run as a recording for the rerun viewer."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind, BaseLimits
from motm_wbc.interfaces import Event, GroundTruth, StepReport
from motm_wbc.recording import camera, encoders, layout
from motm_wbc.recording.atomic import AtomicFile
from motm_wbc.recording.legend import legend
from motm_wbc.recording.overlay import Overlay
from motm_wbc.recording.parameters import RecordingParameters
from motm_wbc.recording.plans import PlanLayer
from motm_wbc.recording.robot import RobotLayer, hidden, read_urdf
from motm_wbc.recording.series import SeriesLayer, plots
from motm_wbc.recording.solids import SceneLayer
from motm_wbc.recording.states import StatesLayer
from motm_wbc.recording.timeline import TimeLine
from motm_wbc.scene.scenario import Scenario

LEVELS = {"info": "INFO", "warn": "WARN", "error": "ERROR"}
_ROUNDING = 1e-6  # [s], so that k * dt counts as having reached a multiple of the period


class RrdRecorder:
    """Records scene, decisions, curves and events of a run, with the views to see them in.

    The file appears under its name when the recorder is closed, whole and valid; what was
    recorded until then is in it, also if the run has ended by an error.
    """

    def __init__(
        self,
        path: Path,
        *,
        scenario: Scenario,
        urdf_path: Path,
        base_joints: Sequence[str],
        arm_joints: Sequence[str],
        finger_joints: Sequence[str],
        base_kind: BaseKind,
        base_limits: BaseLimits,
        footprint: Array,
        q_lower: Array,
        q_upper: Array,
        v_limits: Array,
        ring_radius: float,
        reach_radius: float,
        title: str = "",
        parameters: RecordingParameters | None = None,
    ) -> None:
        """Open the file and send what doesn't change.

        Args:
            path: file to be written, `.rrd`.
            scenario: the scene and its task.
            urdf_path: description of the robot, fixed in the world at its root.
            base_joints: names of its joints for x, y and heading of the base.
            arm_joints: names of its n arm joints.
            finger_joints: names of its fingers' joints.
            base_kind: tells the names of the base's inputs.
            base_limits: drawn beside the base's speeds.
            footprint: (k, 2) outline of the base in its frame [m].
            q_lower: (n,) lower position limits of the arm [rad or m].
            q_upper: (n,) upper ones.
            v_limits: (n,) speed limits of the arm [rad/s or m/s].
            ring_radius: of the circle of candidates about a target [m].
            reach_radius: distance from which the arm reaches its target [m].
            title: name of the recording.
            parameters: rates and budgets.

        Raises:
            InputError: the file can't be written, or the URDF can't be read.
            UnknownName: the URDF lacks one of the joints.
        """
        import rerun as rr

        chosen = parameters or RecordingParameters()
        panels = plots(base_kind.inputs, base_limits, arm_joints, chosen)
        tree = read_urdf(urdf_path)
        margin = max(reach_radius, ring_radius + float(np.hypot(*footprint.T).max()))
        views = layout.blueprint(camera.landmarks(scenario, margin), panels, hidden(tree))
        self._frame_period = chosen.frame_period
        self._last_frame = -np.inf
        self._file: AtomicFile | None = AtomicFile(path, ".rrd")
        # Without an id of its own, every recording of a process would be the same to a viewer.
        self._stream: Any = rr.RecordingStream(
            f"motm_wbc {scenario.name}", recording_id=uuid.uuid4()
        )
        try:
            self._stream.save(self._file.temporary, views)
            self._stream.send_recording_name(title or scenario.name)
            timeline = TimeLine(self._stream, chosen.batch)
            timeline.static("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
            text = legend(title or scenario.name, scenario)
            timeline.static(layout.LEGEND, rr.TextDocument(text, media_type="text/markdown"))
            self._robot = RobotLayer(
                timeline, self._stream, tree, base_joints, arm_joints, finger_joints
            )
            self._scene = SceneLayer(timeline, scenario)
            self._overlay = Overlay(timeline, scenario, footprint, ring_radius, reach_radius)
            self._plan = PlanLayer(timeline, footprint, chosen.plan_lifetime)
            self._series = SeriesLayer(
                timeline, panels, base_kind.inputs, q_lower, q_upper, v_limits
            )
            self._states = StatesLayer(timeline, scenario)
            self._log = timeline.channel(layout.LOG, encoders.texts)
            self._timeline = timeline
        except BaseException:
            self._stream.disconnect()
            self._file.discard()
            raise

    def step(self, truth: GroundTruth, report: StepReport) -> None:
        """Record one control step.

        Args:
            truth: state of the plant at the instant `report.time`.
            report: what was decided at that instant; its time is the stamp of all.
        """
        time = report.time
        self._series.add(time, truth, report)
        self._states.add(time, report)
        for event in report.events:
            self.event(event)
        due = time - self._last_frame >= self._frame_period - _ROUNDING
        if due or report.base is not None:
            self._last_frame = time
            self._robot.add(time, truth.base_pose, truth.q, truth.gripper_width)
            self._scene.add(time, truth.objects, truth.moving)
            self._overlay.add(time, truth, report)
            self._plan.add(time, report.base)
        self._timeline.passed(time)

    def event(self, event: Event) -> None:
        """Add a line to the log."""
        level = LEVELS.get(event.level, "INFO")
        text = f"{event.time:6.2f} s  {event.kind}: {event.text}"
        self._log.add(event.time, (text, level))

    def scalars(self, time: float, values: Mapping[str, float]) -> None:
        """Add points to the curves of smallest distances.

        Args:
            time: [s].
            values: distances [m] by name, for example `base` and `arm`.
        """
        self._series.add_distances(time, values)

    def close(self) -> None:
        """Write what is left and give the file its name. A second call does nothing."""
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            self._timeline.send()
            self._stream.flush()
        finally:
            self._stream.disconnect()
            file.commit()

    def __enter__(self) -> RrdRecorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
