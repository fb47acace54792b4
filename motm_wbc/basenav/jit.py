"""The one decorator of compiled kernels, and where their machine code is kept.

Numba's cache notices a change in the file of a kernel, but not in the kernels of other
files that it calls: old code would run. So the cache folder is named by a hash over the
source of every kernel file of this room. It lies in the user's cache, or in the folder
named by the environment variable `MOTM_CACHE`.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs

_MARK = b"basenav.jit import"
_VARIABLE = "MOTM_CACHE"

Function = TypeVar("Function", bound=Callable[..., Any])


def sources_digest(folder: Path) -> str:
    """Hash over all kernel files of `folder`: those that import this module."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        content = path.read_bytes()
        if _MARK in content:
            digest.update(path.name.encode() + b"\0" + content + b"\0")
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels of exactly these sources."""
    root = os.environ.get(_VARIABLE) or platformdirs.user_cache_dir("motm_wbc")
    return Path(root) / "basenav" / sources_digest(Path(__file__).parent)


def is_compiled() -> bool:
    """Whether an earlier run left compiled kernels; the first run takes a while."""
    return any(_FOLDER.rglob("*.nbc"))


_FOLDER = cache_folder()


def kernel(function: Function) -> Function:
    """Compile `function` on its first call and keep the machine code for later runs.

    Divisions follow IEEE 754 (no exceptions); floating-point operations are not reordered,
    so that equal inputs give equal outputs to the bit. The setting of numba's cache folder
    is put back after use: kernels of other packages are left alone.
    """
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_FOLDER)
    try:
        compiled: Function = numba.njit(cache=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled
