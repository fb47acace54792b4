"""The one decorator of compiled kernels, and where their machine code is kept.

Numba's cache notices a change in the file of a kernel, but not in the kernels and constants of
other files that it uses: old code would run. So the cache folder of a file is named by a hash
over it and all files of this package that it imports, directly or not. It lies in the user's
cache, or in the folder named by the environment variable `MOTM_CACHE`.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import platformdirs

_VARIABLE = "MOTM_CACHE"
_IMPORT = re.compile(
    r"^from\s+(motm_wbc[\w.]*)\s+import\s+(\([^)]*\)|[^\n]*)|^import\s+(motm_wbc[\w.]*)", re.M
)
_NAME = re.compile(r"\w+")

Function = TypeVar("Function", bound=Callable[..., Any])


def sources_digest(path: Path, root: Path) -> str:
    """Hash over a file and all that it imports of the package whose parent folder is `root`."""
    digest = hashlib.sha256()
    for source in sorted(_sources(path, root)):
        digest.update(str(source.relative_to(root)).encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def cache_root() -> Path:
    """Folder of all compiled kernels; one for passing files where that can't be written."""
    root = Path(os.environ.get(_VARIABLE) or platformdirs.user_cache_dir("motm_wbc")) / "kernels"
    with contextlib.suppress(OSError):
        root.mkdir(parents=True, exist_ok=True)
    if os.access(root, os.W_OK):
        return root
    # numba would fall back to a cache beside the sources, which does not follow what they use
    return Path(tempfile.gettempdir()) / f"motm_wbc-{os.getuid()}" / "kernels"


def kernel(function: Function) -> Function:
    """Compile `function` on its first call and keep the machine code for later runs.

    Divisions follow IEEE 754 (no exceptions); floating-point operations are not reordered,
    so that equal inputs give equal outputs to the bit. The setting of numba's cache folder
    is put back after use: kernels of other packages are left alone.
    """
    return _compiled(function, False)


def inlined(function: Function) -> Function:
    """A kernel whose code goes into each of its callers.

    For small ones that are called often: handing over a tuple of arrays takes longer than
    their arithmetic.
    """
    return _compiled(function, True)


def lean(function: Function) -> Function:
    """A kernel that allocates no array and returns none: it only borrows those of its arguments.

    References are not counted then. Counting takes longer than the arithmetic where many arrays
    are handed from one small kernel to the next: each time it is an atomic operation.
    """
    return _compiled(function, False, counts=False)


def strict(*arguments: Any) -> Callable[[Function], Function]:
    """A kernel for arguments of these numba types only: anything else is a TypeError.

    The others compile anew for each new type of argument. For what comes from outside that
    would be a stop of a second in a control loop, because somebody gave integers.
    """
    return lambda function: _compiled(function, False, [arguments])


def _compiled(
    function: Function, inline: bool, signatures: Any = None, counts: bool = True
) -> Function:
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_folder(function.__module__))
    try:
        decorate = numba.njit(
            signatures, cache=True, error_model="numpy", forceinline=inline, _nrt=counts
        )
        compiled: Function = decorate(function)
    finally:
        numba.config.CACHE_DIR = before
    return compiled


@functools.cache
def _folder(module: str) -> Path:
    """Cache folder of the kernels in a module, of exactly these sources."""
    spec = importlib.util.find_spec(module)
    if spec is None or spec.origin is None:
        return cache_root() / module
    root = Path(__file__).parents[2]
    return cache_root() / f"{module}-{sources_digest(Path(spec.origin), root)}"


def _sources(path: Path, root: Path) -> set[Path]:
    """The file, and all files under `root` that it imports, directly or not."""
    found: set[Path] = set()
    waiting = [path]
    while waiting:
        source = waiting.pop()
        if source not in found:
            found.add(source)
            waiting += _imported(source, root)
    return found


@functools.cache
def _imported(path: Path, root: Path) -> tuple[Path, ...]:
    """Files under `root` that a file's import statements name."""
    files: list[Path] = []
    for package, names, plain in _IMPORT.findall(path.read_text(encoding="utf-8")):
        folder = root.joinpath(*(package or plain).split("."))
        submodules = [folder / f"{name}.py" for name in _NAME.findall(names)]
        candidates = (folder.with_suffix(".py"), folder / "__init__.py", *submodules)
        files += [candidate for candidate in candidates if candidate.is_file()]
    return tuple(files)
