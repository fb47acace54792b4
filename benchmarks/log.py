"""Outcomes in a file of JSON lines: whole scenes are appended, so a run can be taken up again."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import ClassVar, Protocol, TypeVar


class Record(Protocol):
    """A flat dataclass of what came of one try; its sequences are tuples."""

    __dataclass_fields__: ClassVar[dict[str, object]]

    @property
    def scene(self) -> int:
        """Number of the scene that it belongs to."""


AnyRecord = TypeVar("AnyRecord", bound=Record)


def append(path: Path, outcomes: Sequence[Record]) -> None:
    """Add lines by one write, so that readers see all of them or none."""
    text = "".join(json.dumps(asdict(outcome)) + "\n" for outcome in outcomes)
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(file, text.encode())
        os.fsync(file)
    finally:
        os.close(file)


def read(path: Path, kind: type[AnyRecord]) -> list[AnyRecord]:
    """All outcomes; of a scene that was cut off by a crash, what is whole is taken away, too.

    A line that is cut off can only be the last one. It is removed from the file, with all
    lines of its scene, so that the scene is run anew.

    Args:
        path: of the file.
        kind: of the outcomes.
    """
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    cut_off = bool(lines) and not lines[-1].endswith("\n")
    outcomes = [_outcome(line, kind) for line in (lines[:-1] if cut_off else lines)]
    if cut_off:
        last = outcomes[-1].scene if outcomes else -1
        outcomes = [outcome for outcome in outcomes if outcome.scene != last]
        path.unlink()
        append(path, outcomes)
    return outcomes


def _outcome(line: str, kind: type[AnyRecord]) -> AnyRecord:
    values = json.loads(line).items()
    return kind(**{name: tuple(v) if isinstance(v, list) else v for name, v in values})
