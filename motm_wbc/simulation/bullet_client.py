"""One physics client of one's own, and an import that keeps standard output clean."""

from __future__ import annotations

import ctypes
import functools
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def quiet() -> Iterator[None]:
    """Send what C code prints nowhere: pybullet prints a line when it is imported.

    Standard output is a result's place (JSON) and standard error an error's, so nothing else
    may stand there; pybullet's own errors are raised as exceptions all the same.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    libc = ctypes.CDLL(None)
    saved = [os.dup(1), os.dup(2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        libc.fflush(None)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        libc.fflush(None)
        for number, copy in enumerate(saved, start=1):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)


class BulletClient:
    """pybullet's functions, bound to a simulation that no other client shares."""

    def __init__(self) -> None:
        with quiet():
            import pybullet

            self._id: int = pybullet.connect(pybullet.DIRECT)
        self._module = pybullet

    def __getattr__(self, name: str) -> Any:
        """A function of pybullet bound to this client, or a constant; kept for the next use."""
        value = getattr(self._module, name)
        if callable(value):
            value = functools.partial(value, physicsClientId=self._id)
        setattr(self, name, value)
        return value

    def close(self) -> None:
        """End the simulation; a second call does nothing."""
        if self._id >= 0:
            self._module.disconnect(self._id)
            self._id = -1
