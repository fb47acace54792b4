"""A run in memory, as a table with one row a control step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event, GroundTruth, StepReport
from motm_wbc.recording.atomic import AtomicFile
from motm_wbc.recording.trace_columns import Sample, arrow_field, columns

_EVENT_WORDS = ("kind", "text", "level")


class TraceRecorder:
    """Keeps state, references, commands and timings of each control step.

    Attributes:
        events: all that happened, in order.
    """

    def __init__(
        self,
        arm_joints: Sequence[str],
        base_inputs: Sequence[str],
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Begin an empty trace.

        Args:
            arm_joints: n names.
            base_inputs: names of the base's inputs, for example `v`, `omega`.
            metadata: texts to be stored with the table, for example the configuration.
        """
        self.events: list[Event] = []
        self._columns = columns(arm_joints, base_inputs)
        self._metadata = dict(metadata or {})
        self._rows: list[list[Any]] = []
        self._times: list[float] = []
        self._objects: dict[str, list[Array]] = {}
        self._moving: dict[str, list[Array]] = {}
        self._distances: dict[str, dict[float, float]] = {}
        self._goal: Array | None = None

    def __len__(self) -> int:
        return len(self._rows)

    def step(self, truth: GroundTruth, report: StepReport) -> None:
        """Keep one control step; `truth` is the state at `report.time`."""
        self.events.extend(report.events)
        if report.base is not None:
            self._goal = None if report.base.goal is None else report.base.goal.copy()
        sample = Sample(truth, report, self._goal)
        self._rows.append([column.value(sample) for column in self._columns])
        self._times.append(report.time)
        for name, pose in truth.objects.items():
            self._objects.setdefault(name, []).append(pose.copy())
        for name, body in truth.moving.items():
            self._moving.setdefault(name, []).append(body.pose.copy())

    def event(self, event: Event) -> None:
        """Keep something that happened outside a control step."""
        self.events.append(event)

    def scalars(self, time: float, values: Mapping[str, float]) -> None:
        """Keep named distances [m]; they go to the row that has the same time [s]."""
        for name, value in values.items():
            self._distances.setdefault(name, {})[time] = value

    def close(self) -> None:
        """Nothing is left to write."""

    def table(self) -> Any:
        """The trace as a `pyarrow.Table`; each field's metadata has its unit and meaning.

        Poses of objects are `object_<name>_x` ... `_qw`, of moving solids `moving_<name>_x`,
        `_y`, `_heading`; distances are `distance_<name>`, null where none was given.
        """
        import pyarrow as pa

        transposed = list(zip(*self._rows, strict=True)) or [()] * len(self._columns)
        fields = [column.field() for column in self._columns]
        data: list[Any] = [
            pa.array(values, field.type) for values, field in zip(transposed, fields, strict=True)
        ]
        for name, unit, meaning, extra in self._more_columns():
            fields.append(arrow_field(name, unit, meaning))
            data.append(pa.array(extra, pa.float64()))
        return pa.table(data, schema=pa.schema(fields, metadata=self._metadata))

    def events_table(self) -> Any:
        """The events as a `pyarrow.Table` with time [s], kind, text and level."""
        import pyarrow as pa

        fields = [arrow_field("time", "s", "simulated time")]
        fields += [arrow_field(word, "", f"{word} of the event", "word") for word in _EVENT_WORDS]
        data = [[getattr(event, field.name) for event in self.events] for field in fields]
        arrays = [pa.array(values, f.type) for values, f in zip(data, fields, strict=True)]
        return pa.table(arrays, schema=pa.schema(fields))

    def write_parquet(self, path: Path) -> None:
        """Write the table to a file that is whole or not there.

        Raises:
            InputError: the file can't be written.
        """
        import pyarrow.parquet as pq

        file = AtomicFile(path)
        try:
            pq.write_table(self.table(), file.temporary, compression="zstd")
        except BaseException:
            file.discard()
            raise
        file.commit()

    def _more_columns(self) -> list[tuple[str, str, str, Any]]:
        """Name, unit, meaning and values of what is known by name only in the run."""
        result: list[tuple[str, str, str, Any]] = []
        for name, poses in self._objects.items():
            matrices = np.array(poses)
            turned = Rotation.from_matrix(matrices[:, :3, :3]).as_quat(canonical=True)
            parts = zip("xyz", matrices[:, :3, 3].T, strict=True)
            result += [(f"object_{name}_{k}", "m", "true position", part) for k, part in parts]
            quaternion = zip(("qx", "qy", "qz", "qw"), turned.T, strict=True)
            result += [(f"object_{name}_{k}", "", "true rotation", p) for k, p in quaternion]
        for name, places in self._moving.items():
            keys = (("x", "m"), ("y", "m"), ("heading", "rad"))
            for (key, unit), part in zip(keys, np.array(places).T, strict=True):
                result.append((f"moving_{name}_{key}", unit, "true pose", part))
        for name, known in self._distances.items():
            values = [known.get(time) for time in self._times]
            result.append((f"distance_{name}", "m", "smallest distance", values))
        return result
