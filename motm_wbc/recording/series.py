"""Curves over time: speeds, errors, distances, computing times."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.interfaces import GroundTruth, StepReport
from motm_wbc.recording import colours, encoders
from motm_wbc.recording.parameters import RecordingParameters
from motm_wbc.recording.timeline import Channel, TimeLine

ROOT = "/series"


@dataclass(frozen=True, slots=True)
class Plot:
    """One panel of curves.

    Attributes:
        key: last part of the entity's path.
        title: name with unit.
        names: one for each curve.
        colours: one for each curve, 0xRRGGBBAA.
        limits: name -> height of a horizontal line; infinite ones are left out.
        cell: panels with the same name here share a place in the layout.
    """

    key: str
    title: str
    names: Sequence[str] = ()
    colours: Sequence[int] = ()
    limits: Mapping[str, float] = field(default_factory=dict)
    cell: str = ""

    @property
    def path(self) -> str:
        """Root of the panel's entities."""
        return f"{ROOT}/{self.key}"


def plots(
    base_inputs: Sequence[str],
    base_limits: BaseLimits,
    arm_joints: Sequence[str],
    parameters: RecordingParameters,
) -> list[Plot]:
    """The panels, in the order in which they are shown.

    Args:
        base_inputs: m names, the first is along the heading, the last is the turn rate.
        base_limits: what these two may be.
        arm_joints: n names.
        parameters: budgets of computing time.
    """
    tints = (colours.MEASURED, colours.REFERENCE, colours.COMMAND)
    limits = {
        base_inputs[0]: (-base_limits.v_reverse, base_limits.v_max),
        base_inputs[-1]: (-base_limits.omega_max, base_limits.omega_max),
    }
    speeds = [
        Plot(
            name,
            f"Base {'turn rate' if name == base_inputs[-1] else 'speed'} {name} "
            f"[{'rad/s' if name == base_inputs[-1] else 'm/s'}]",
            ("measured", "reference", "command"),
            tints,
            dict(zip(("lower limit", "upper limit"), limits.get(name, ()), strict=False)),
        )
        for name in base_inputs
    ]
    cycle = [colours.SERIES[k % len(colours.SERIES)] for k in range(len(arm_joints))]
    base_ms, arm_ms = 1e3 * parameters.base_budget, 1e3 * parameters.arm_budget
    return [
        *speeds,
        Plot("tool_error", "Tool error [m]", ["tool error"], colours.SERIES[:1]),
        Plot("gripper", "Gripper width [m]", ["measured", "command"], tints[::2]),
        Plot(
            "joint_speed",
            "Joint speed [share of limit]",
            arm_joints,
            cycle,
            {"limit": 1.0},
            "joints",
        ),
        Plot(
            "joint_position",
            "Joint position [share of range]",
            arm_joints,
            cycle,
            {"lower limit": 0.0, "upper limit": 1.0},
            "joints",
        ),
        Plot("distance", "Smallest distance [m]"),
        Plot("base_time", "Base step [ms]", ["base step"], colours.SERIES[1:], {"budget": base_ms}),
        Plot("arm_time", "Arm step [ms]", ["arm step"], colours.SERIES[2:], {"budget": arm_ms}),
    ]


class SeriesLayer:
    """Collects one row of numbers a control step and cuts it into curves when it is sent."""

    def __init__(
        self,
        timeline: TimeLine,
        panels: Sequence[Plot],
        base_inputs: Sequence[str],
        q_lower: Array,
        q_upper: Array,
        v_limits: Array,
    ) -> None:
        """Send names and colours.

        Args:
            timeline: the recording's time line.
            panels: the panels of curves.
            base_inputs: m names.
            q_lower: (n,) lower limits of the arm joints [rad or m].
            q_upper: (n,) upper ones.
            v_limits: (n,) speed limits of the arm joints [rad/s or m/s].
        """
        self._timeline = timeline
        self._base_inputs = base_inputs
        # A joint without limits has no share of a range: its curve stays empty.
        bounded = np.isfinite(q_lower) & np.isfinite(q_upper)
        self._q_lower = np.where(bounded, q_lower, np.nan)
        self._q_range = np.where(bounded, q_upper, np.nan) - self._q_lower
        self._v_limits = v_limits
        self._channels = {
            panel.key: styled(timeline, f"{panel.path}/value", panel.names, panel.colours)
            for panel in panels
            if panel.names
        }
        self._limits = [
            (
                styled(
                    timeline, f"{panel.path}/{_slug(name)}", [name.split()[-1]], [colours.LIMIT]
                ),
                height,
            )
            for panel in panels
            for name, height in panel.limits.items()
            if math.isfinite(height)
        ]
        self._distances: dict[str, Channel[Array]] = {}
        self._distance_path = next(panel.path for panel in panels if panel.key == "distance")
        self._times: list[float] = []
        self._rows: list[list[float]] = []
        self._limits_begun = False
        timeline.before_send(self._cut)

    def add(self, time: float, truth: GroundTruth, report: StepReport) -> None:
        """Keep the numbers of one control step."""
        self._times.append(time)
        self._rows.append(
            [
                *truth.base_velocity.tolist(),
                *report.base_reference.tolist(),
                *report.command.base.tolist(),
                report.tool_error,
                truth.gripper_width,
                report.command.gripper_width,
                1e3 * report.compute_time,
                *truth.v.tolist(),
                *truth.q.tolist(),
            ]
        )
        if report.base is not None:
            self._channels["base_time"].add(time, np.array([1e3 * report.base.compute_time]))

    def add_distances(self, time: float, values: Mapping[str, float]) -> None:
        """Keep named distances [m]; a new name is a new curve."""
        for name, value in values.items():
            if name not in self._distances:
                colour = colours.SERIES[len(self._distances) % len(colours.SERIES)]
                path = f"{self._distance_path}/{_slug(name)}"
                self._distances[name] = styled(self._timeline, path, [name], [colour])
            self._distances[name].add(time, np.array([value]))

    def _cut(self) -> None:
        if not self._rows:
            return
        table, count = np.array(self._rows), len(self._base_inputs)
        for k, name in enumerate(self._base_inputs):
            self._channels[name].extend(self._times, table[:, k : 3 * count : count])
        rest = table[:, 3 * count :]
        self._channels["tool_error"].extend(self._times, rest[:, :1])
        self._channels["gripper"].extend(self._times, rest[:, 1:3])
        self._channels["arm_time"].extend(self._times, rest[:, 3:4])
        v, q = np.split(rest[:, 4:], 2, axis=1)
        self._channels["joint_speed"].extend(self._times, np.abs(v) / self._v_limits)
        self._channels["joint_position"].extend(self._times, (q - self._q_lower) / self._q_range)
        ends = self._times[-1:] if self._limits_begun else [self._times[0], self._times[-1]]
        for channel, height in self._limits:
            channel.extend(ends, np.full((len(ends), 1), height))
        self._limits_begun = True
        self._times, self._rows = [], []


def styled(
    timeline: TimeLine, path: str, names: Sequence[str], tints: Sequence[int]
) -> Channel[Array]:
    """A channel of curves with their names and colours."""
    import rerun as rr

    paint = np.array(tints[: len(names)], dtype=np.uint32)
    style = rr.SeriesLines(names=list(names), colors=paint, widths=np.full(len(names), 1.5))
    timeline.static(path, style)
    return timeline.channel(path, encoders.scalars)


def _slug(name: str) -> str:
    return "".join(letter if letter.isalnum() else "_" for letter in name)
