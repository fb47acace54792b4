"""The one owner of a recording's time line.

A viewer's time cursor shows of every entity the newest row that is not later than the cursor.
An entity that is stamped on another clock, or not at all, would seem frozen or be there
always; so every row of a recording passes through one `TimeLine`, which stamps it with
simulated time. Rows wait in lists and are sent in columns: logging them one by one would cost
more than the control step that they tell of.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

import numpy as np

NAME = "sim"

Row = TypeVar("Row")
Encode = Callable[[Sequence[Row]], Any]


class Channel(Generic[Row]):
    """The rows of one entity that have not been sent yet."""

    def __init__(self, path: str, encode: Encode[Row]) -> None:
        self.path = path
        self._encode = encode
        self._times: list[float] = []
        self._rows: list[Row] = []

    def add(self, time: float, row: Row) -> None:
        """Keep a row for the instant `time` [s]."""
        self._times.append(time)
        self._rows.append(row)

    def extend(self, times: Sequence[float], rows: Sequence[Row] | Any) -> None:
        """Keep a row for each of the instants `times` [s]."""
        self._times.extend(times)
        self._rows.extend(rows)

    def send(self, stream: Any) -> None:
        """Send what waits to the recording stream."""
        import rerun as rr

        if self._rows:
            # Rounded to whole nanoseconds, so that an instant is the same on every entity.
            nanoseconds = np.rint(1e9 * np.array(self._times)).astype("timedelta64[ns]")
            stamps = rr.TimeColumn(NAME, duration=nanoseconds)
            stream.send_columns(self.path, [stamps], self._encode(self._rows))
            self._times.clear()
            self._rows.clear()


class TimeLine:
    """Collects rows of all entities and sends them batch by batch."""

    def __init__(self, stream: Any, batch: float) -> None:
        """Rows are sent when `batch` [s] of simulated time have passed since the last time."""
        self._stream = stream
        self._batch = batch
        self._channels: list[Channel[Any]] = []
        self._before_send: list[Callable[[], None]] = []
        self._sent: float | None = None

    def channel(self, path: str, encode: Encode[Row]) -> Channel[Row]:
        """A new entity, whose rows `encode` turns into columns."""
        channel = Channel(path, encode)
        self._channels.append(channel)
        return channel

    def before_send(self, callback: Callable[[], None]) -> None:
        """Have `callback` fill its channels before they are sent."""
        self._before_send.append(callback)

    def static(self, path: str, *archetypes: Any) -> None:
        """What holds at all times."""
        self._stream.log(path, *archetypes, static=True)

    def passed(self, time: float) -> None:
        """Tell that simulated time has come to `time` [s]."""
        if self._sent is None:
            self._sent = time
        elif time - self._sent >= self._batch:
            self.send()
            self._sent = time

    def send(self) -> None:
        """Send everything that waits."""
        for callback in self._before_send:
            callback()
        for channel in self._channels:
            channel.send(self._stream)
