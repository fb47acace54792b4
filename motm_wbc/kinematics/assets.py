"""Where robot files find URDFs and meshes."""

from __future__ import annotations

import sys
from importlib import metadata
from pathlib import Path, PurePosixPath

from motm_wbc.errors import InputError

_SCHEME = "example-robot-data"


def find_urdf(reference: str, folder: Path, where: str) -> Path:
    """The file that a robot file's `arm.urdf` means.

    Args:
        reference: a path relative to `folder`, an absolute path, or
            `example-robot-data:<path in its folder robots>`.
        folder: the robot file's folder.
        where: file and key for the message.

    Raises:
        InputError: unknown scheme, or no such file.
    """
    scheme, separator, rest = reference.partition(":")
    if not separator:
        path = folder / reference
    elif scheme == _SCHEME:
        path = example_robot_data(where) / "robots" / rest
    else:
        raise InputError(f"unknown scheme {scheme!r}; legal: {_SCHEME}, or a plain path", where)
    if not path.is_file():
        raise InputError(f"no such file: {path}", where)
    return path.resolve()


def example_robot_data(where: str = "") -> Path:
    """The data folder of example-robot-data, found without importing its loaders.

    The loaders are a package of their own since version 6, the data's place in the
    installation is not.

    Raises:
        InputError: it is not installed.
    """
    for folder in (_from_distribution(), Path(sys.prefix) / "share" / _SCHEME):
        if folder is not None and (folder / "robots").is_dir():
            return folder
    raise InputError(f"the package {_SCHEME} is not installed (pip install {_SCHEME})", where)


def _from_distribution() -> Path | None:
    try:
        distribution = metadata.distribution(_SCHEME)
    except metadata.PackageNotFoundError:
        return None
    for file in distribution.files or ():
        parts = PurePosixPath(file).parts
        if "share" in parts and _SCHEME in parts[parts.index("share") + 1 :][:1]:
            end = parts.index("share") + 2
            return Path(str(distribution.locate_file(PurePosixPath(*parts[:end]))))
    return None


def find_mesh(filename: str, urdf: Path) -> Path:
    """The absolute path of a mesh that a URDF names.

    `package://NAME/rest` is looked for beside each folder that holds the URDF, as ROS
    workspaces are laid out; other names are relative to the URDF.

    Raises:
        InputError: no such file.
    """
    if filename.startswith("package://"):
        package, _, rest = filename.removeprefix("package://").partition("/")
        candidates = [
            candidate
            for ancestor in urdf.parents
            for candidate in (
                [ancestor / rest] if ancestor.name == package else [ancestor / package / rest]
            )
        ]
    else:
        candidates = [urdf.parent / filename.removeprefix("file://")]
    for candidate in candidates:
        if candidate.is_file():
            return candidate.resolve()
    raise InputError(f"mesh not found: {filename}", str(urdf))
