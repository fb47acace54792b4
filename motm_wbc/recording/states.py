"""Which step of the task, stage and rung the run is at, as bands over time."""

from __future__ import annotations

import numpy as np

from motm_wbc.interfaces import StepReport
from motm_wbc.recording import colours
from motm_wbc.recording.encoders import states
from motm_wbc.recording.timeline import TimeLine
from motm_wbc.scene.scenario import Scenario

ROOT = "/states"
_LANES = ("task", "stage", "rung")


class StatesLayer:
    """Sends a state when it is entered."""

    def __init__(self, timeline: TimeLine, scenario: Scenario) -> None:
        """Name the task's steps as the scenario has them."""
        self._steps = [
            f"{'pick' if step.pick else 'place'} {step.object}" for step in scenario.task
        ]
        self._timeline = timeline
        self._channels = {name: timeline.channel(_path(name), states) for name in _LANES}
        self._known: dict[str, list[str]] = {name: [] for name in _LANES}
        self._now: dict[str, str] = {}
        self._coloured = 0
        timeline.before_send(self._colour)

    def add(self, time: float, report: StepReport) -> None:
        """Note what has changed at `time` [s]."""
        index = report.step_index
        step = self._steps[index] if 0 <= index < len(self._steps) else "done"
        for name, state in zip(_LANES, (step, report.stage, report.rung), strict=True):
            if self._now.get(name) != state:
                self._now[name] = state
                self._channels[name].add(time, state)
                if state not in self._known[name]:
                    self._known[name].append(state)

    def _colour(self) -> None:
        """Give each state of a lane a colour of its own; the viewer's may coincide."""
        import rerun as rr

        count = sum(len(known) for known in self._known.values())
        if count == self._coloured:
            return
        self._coloured = count
        for name, known in self._known.items():
            tints = [colours.STATES[k % len(colours.STATES)] for k in range(len(known))]
            style = rr.StateConfiguration(values=known, colors=np.array(tints, dtype=np.uint32))
            self._timeline.static(_path(name), style)


def _path(lane: str) -> str:
    return f"{ROOT}/{lane}"
