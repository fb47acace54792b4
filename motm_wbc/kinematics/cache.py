"""The folder for files that are made at run time."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

import platformdirs

from motm_wbc.errors import InputError

_VARIABLE = "MOTM_CACHE"


def cache_folder() -> Path:
    """The user's cache folder of this package; the variable MOTM_CACHE overrides it."""
    override = os.environ.get(_VARIABLE)
    return Path(override) if override else platformdirs.user_cache_path("motm_wbc")


def store(text: str, stem: str, suffix: str) -> Path:
    """Write `text` into the cache under a name that carries the hash of its content.

    The same text always has the same path, another text another one: readers that keep
    files by path (pybullet does) never see an old content. The file appears whole or not
    at all, also when several processes write it at once.

    Args:
        text: the content.
        stem: first part of the file's name.
        suffix: last part, with its dot.

    Raises:
        InputError: the cache folder can't be written.
    """
    data = text.encode()
    folder = cache_folder()
    path = (folder / f"{stem}-{hashlib.sha256(data).hexdigest()[:16]}{suffix}").absolute()
    try:
        if not (path.is_file() and path.read_bytes() == data):
            folder.mkdir(parents=True, exist_ok=True)
            _write_atomically(data, path)
    except OSError as error:
        raise InputError(
            f"the cache folder can't be written: {error.strerror} (set {_VARIABLE} to another)",
            str(folder),
        ) from None
    return path


def _write_atomically(data: bytes, path: Path) -> None:
    handle, name = tempfile.mkstemp(prefix=path.stem, suffix=".part", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
