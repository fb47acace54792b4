"""Files that are whole or not there: written under a temporary name, renamed when complete."""

from __future__ import annotations

import os
from pathlib import Path

from motm_wbc.errors import InputError


class AtomicFile:
    """A place to write to that becomes `path` in one move.

    The temporary file lies in the same folder, because only there a rename is one move. It
    is created at once, so that a folder that can't be written to is told of before a run.

    Attributes:
        path: where the file shall be in the end.
        temporary: where it is to be written; keeps the suffix of `path`.
    """

    def __init__(self, path: Path, suffix: str = "") -> None:
        """Claim the place.

        Args:
            path: the file to be.
            suffix: what its name must end in, if it matters to readers.

        Raises:
            InputError: wrong suffix, no such folder, no right to write, or `path` is
                something else than a file.
        """
        self.path = path
        if suffix and path.suffix != suffix:
            raise InputError(f"the name of this file must end in {suffix}", str(path))
        if path.exists() and not path.is_file():
            raise InputError("is no regular file and won't be overwritten", str(path))
        self.temporary = path.with_name(f".{path.stem}.{os.getpid()}-{id(self):x}{path.suffix}")
        try:
            self.temporary.touch(exist_ok=False)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"can't be written: {reason}", str(path)) from None

    def commit(self) -> None:
        """Give the finished file its name."""
        self.temporary.replace(self.path)

    def discard(self) -> None:
        """Leave no trace of an unfinished file."""
        self.temporary.unlink(missing_ok=True)
