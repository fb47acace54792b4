"""Several recorders as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Protocol, runtime_checkable

from motm_wbc.interfaces import Event, GroundTruth, Recorder, StepReport


@runtime_checkable
class ScalarRecorder(Recorder, Protocol):
    """A recorder that takes distances as well."""

    def scalars(self, time: float, values: Mapping[str, float]) -> None:
        """Record named distances [m] at `time` [s]."""


class Recorders:
    """Passes everything on to each of its recorders, in order."""

    def __init__(self, recorders: Sequence[Recorder]) -> None:
        """Take the recorders over: closing this closes them."""
        self._all = tuple(recorders)
        self._scalar = tuple(one for one in recorders if isinstance(one, ScalarRecorder))

    def step(self, truth: GroundTruth, report: StepReport) -> None:
        """Record one control step."""
        for one in self._all:
            one.step(truth, report)

    def event(self, event: Event) -> None:
        """Record something that happened outside a control step."""
        for one in self._all:
            one.event(event)

    def scalars(self, time: float, values: Mapping[str, float]) -> None:
        """Record named distances [m] at `time` [s], with those recorders that take them."""
        for one in self._scalar:
            one.scalars(time, values)

    def close(self) -> None:
        """Close all, the others also if one of them fails; then that error is raised."""
        with ExitStack() as stack:
            for one in reversed(self._all):
                stack.callback(one.close)
