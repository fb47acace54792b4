"""A drive of a base as a recording for the rerun viewer: map, plans, way and curves."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.interfaces import BaseReport, Event
from motm_wbc.recording import camera, colours, encoders, layout, overlay
from motm_wbc.recording.atomic import AtomicFile
from motm_wbc.recording.parameters import RecordingParameters
from motm_wbc.recording.plans import PlanLayer
from motm_wbc.recording.rrd import LEVELS
from motm_wbc.recording.series import Plot, styled
from motm_wbc.recording.solids import ROOT, flat_shaded, prism_mesh
from motm_wbc.recording.timeline import Channel, TimeLine

_HEIGHT = 0.25  # [m] that what stands on the map is drawn with
_INPUTS = "v", "omega"


@dataclass(frozen=True, slots=True)
class Prism:
    """Something on the map, drawn upright.

    Attributes:
        outline: (n, 2) counter-clockwise [m].
        holes: (n, 2) clockwise each [m].
    """

    outline: Array
    holes: Sequence[Array] = ()


class DriveRecorder:
    """Records a drive, with the views to see it in.

    The file appears under its name when the recorder is closed, whole and valid.
    """

    def __init__(
        self,
        path: Path,
        *,
        still: Sequence[Prism],
        moving: Sequence[Prism],
        boundary: Array | None,
        footprint: Array,
        limits: BaseLimits,
        start: Array,
        goal: Array,
        title: str,
        parameters: RecordingParameters | None = None,
    ) -> None:
        """Open the file and send what doesn't change.

        Args:
            path: file to be written, `.rrd`.
            still: what stands.
            moving: what moves, where it is at time 0.
            boundary: (n, 2) of the floor [m], or None.
            footprint: (k, 2) outline of the base in its frame [m].
            limits: drawn beside the speeds.
            start: (3,) pose.
            goal: (3,) pose.
            title: name of the recording.
            parameters: rates and budgets.

        Raises:
            InputError: the file can't be written.
        """
        import rerun as rr

        chosen = parameters or RecordingParameters()
        panels = _plots(limits, chosen)
        self._file: AtomicFile | None = AtomicFile(path, ".rrd")
        # Without an id of its own, every recording of a process would be the same to a viewer.
        self._stream: Any = rr.RecordingStream("motm_wbc nav", recording_id=uuid.uuid4())
        try:
            margin = 2.0 * float(np.hypot(*footprint.T).max())
            points = _landmarks(still, boundary, (start, goal), margin)
            self._stream.save(self._file.temporary, _blueprint(points, panels))
            self._stream.send_recording_name(title)
            timeline = TimeLine(self._stream, chosen.batch)
            timeline.static("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
            _send_map(timeline, still, boundary)
            self._moving = [_send_moving(timeline, k, one) for k, one in enumerate(moving)]
            self._base = overlay.BaseLines(timeline, footprint)
            self._plan = PlanLayer(timeline, footprint, chosen.plan_lifetime)
            self._curves = {
                panel.key: styled(timeline, f"{panel.path}/value", panel.names, panel.colours)
                for panel in panels
            }
            self._limits = _send_limits(timeline, panels)
            self._log: Channel[tuple[str, str]] = timeline.channel(layout.LOG, encoders.texts)
            self._timeline = timeline
        except BaseException:
            self._stream.disconnect()
            self._file.discard()
            raise

    def step(
        self,
        time: float,
        state: Array,
        shifts: Array,
        report: BaseReport,
        curves: Mapping[str, float],
    ) -> None:
        """Record a base step.

        Args:
            time: [s].
            state: (5,) x, y, heading, v, omega.
            shifts: (m, 2) by which each moving thing has moved [m].
            report: what was decided.
            curves: `clearance` [m], `compute_time` [s], by name.
        """
        self._base.add(time, state[:3])
        for channel, shift in zip(self._moving, shifts, strict=True):
            channel.add(time, np.array([*shift, 0.0]))
        self._plan.add(time, report)
        values = {
            "v": state[3],
            "omega": state[4],
            "distance": curves["clearance"],
            "base_time": 1e3 * curves["compute_time"],
        }
        for key, value in values.items():
            self._curves[key].add(time, np.array([value]))
        for channel, height in self._limits:
            channel.add(time, np.array([height]))
        self._timeline.passed(time)

    def event(self, event: Event) -> None:
        """Add a line to the log."""
        text = f"{event.time:6.2f} s  {event.kind}: {event.text}"
        self._log.add(event.time, (text, LEVELS.get(event.level, "INFO")))

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

    def __enter__(self) -> DriveRecorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _plots(limits: BaseLimits, parameters: RecordingParameters) -> list[Plot]:
    tints = colours.SERIES
    budget = {"budget": 1e3 * parameters.base_budget}
    speed = {"lower limit": -limits.v_reverse, "upper limit": limits.v_max}
    turning = {"lower limit": -limits.omega_max, "upper limit": limits.omega_max}
    return [
        Plot("v", "Speed v [m/s]", ["v"], tints[:1], speed),
        Plot("omega", "Turn rate omega [rad/s]", ["omega"], tints[1:2], turning),
        Plot("distance", "Least distance so far [m]", ["least distance"], tints[2:3]),
        Plot("base_time", "Base step [ms]", ["base step"], tints[3:4], budget),
    ]


def _blueprint(points: Array, panels: Sequence[Plot]) -> Any:
    import rerun.blueprint as rrb

    rows, shares = layout.plot_rows(panels)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                layout.spatial("Plan", camera.overhead(points, 1.4), []),
                layout.event_log(),
                row_shares=[5, 1],
            ),
            rrb.Vertical(*rows, row_shares=shares),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        layout.time_panel(),
    )


def _landmarks(
    still: Sequence[Prism], boundary: Array | None, ends: Sequence[Array], margin: float
) -> Array:
    """(n, 3) what the picture must hold [m]."""
    outlines = [polygons.disc(margin) + pose[:2] for pose in ends]
    outlines += [prism.outline for prism in still]
    flat = np.vstack(outlines if boundary is None else [*outlines, boundary])
    return np.column_stack([flat, np.zeros(len(flat))])


def _send_map(timeline: TimeLine, still: Sequence[Prism], boundary: Array | None) -> None:
    """All that stands as one mesh, however much it is; the boundary as a line."""
    import rerun as rr

    if still:
        timeline.static(f"{ROOT}/still", _mesh(still, colours.OTHER_SUPPORT))
    if boundary is not None:
        corners = np.vstack([boundary, boundary[:1]])
        line = np.column_stack([corners, np.full(len(corners), 0.01)])
        timeline.static(
            f"{ROOT}/boundary", rr.LineStrips3D([line], colors=[colours.OBSTACLE], radii=[0.015])
        )


def _send_moving(timeline: TimeLine, index: int, prism: Prism) -> Channel[Array]:
    path = f"{ROOT}/moving/{index}"
    timeline.static(path, _mesh([prism], colours.OBSTACLE))
    return timeline.channel(path, encoders.planar_poses)


def _mesh(prisms: Sequence[Prism], colour: int) -> Any:
    parts = [prism_mesh(one.outline, 0.0, _HEIGHT, one.holes)[0] for one in prisms]
    return flat_shaded(np.concatenate(parts), colour)


def _send_limits(timeline: TimeLine, panels: Sequence[Plot]) -> list[tuple[Channel[Array], float]]:
    return [
        (
            styled(
                timeline,
                f"{panel.path}/{name.replace(' ', '_')}",
                [name.split()[-1]],
                [colours.LIMIT],
            ),
            height,
        )
        for panel in panels
        for name, height in panel.limits.items()
    ]
