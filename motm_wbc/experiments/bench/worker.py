"""A contestant's process, from the harness's side."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from motm_wbc.errors import MotmError
from motm_wbc.experiments.bench import shared
from motm_wbc.geometry.arrays import Array

_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
_LAST_LINES = 3  # of what a worker said before it ended


class WorkerError(MotmError):
    """A contestant ended before it had answered."""


class Worker:
    """A contestant's process; `with` ends it.

    Attributes:
        about: what it says it is: library, solver.

    Args:
        name: of the contestant, for messages.
        command: starts it.
        foreign: it is another library's; of ours it sees only the module that is meant for it.

    Raises:
        WorkerError: it ended before it was ready.
    """

    about: Mapping[str, Any]

    def __init__(self, name: str, command: Sequence[str], *, foreign: bool) -> None:
        self._name = name
        # open as long as the process runs: a pipe that nobody reads would fill up
        self._said = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            text=True,
            env=_environment(foreign=foreign),
        )
        self.about = self._read()

    def __enter__(self) -> Worker:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._said.close()

    def round(self) -> dict[str, Any]:
        """One step for each state: `wall` and `cpu` [ns] of each, and how many `failed`.

        Raises:
            WorkerError: it ended.
        """
        return dict(self._ask("round"))

    def answers(self) -> Array:
        """(n, nv) joint velocities for each state [m/s, rad/s]; not a number where it failed.

        Raises:
            WorkerError: it ended.
        """
        return np.array(self._ask("answers"), dtype=float)

    def _ask(self, word: str) -> Any:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(word + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._ended() from None
        return self._read()

    def _read(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise self._ended()
        return json.loads(line)

    def _ended(self) -> WorkerError:
        self._process.wait()
        self._said.seek(0)
        lines = [line.strip() for line in self._said.read().splitlines() if line.strip()]
        self.close()
        return WorkerError(f"{self._name} ended early: {'; '.join(lines[-_LAST_LINES:])}")


def _environment(*, foreign: bool) -> dict[str, str]:
    """Of a worker: one thread."""
    environment = {**os.environ, **_ONE_THREAD}
    if foreign:
        environment["PYTHONPATH"] = str(Path(shared.__file__).parent)
    return environment
