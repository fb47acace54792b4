"""Rows of one entity as the columns that rerun takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from motm_wbc.geometry.arrays import Array
from motm_wbc.recording.colours import Colours

Points: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Arrows:
    """Arrows of one instant.

    Attributes:
        origins: (n, 3) [m].
        vectors: (n, 3) [m].
        colours: (n,).
    """

    origins: Array
    vectors: Array
    colours: Colours


def poses(rows: Sequence[Array]) -> Any:
    """Poses (4, 4) of an entity in its parent's frame."""
    import rerun as rr

    matrices = np.array(rows)
    return rr.Transform3D.columns(
        translation=matrices[:, :3, 3],
        quaternion=Rotation.from_matrix(matrices[:, :3, :3]).as_quat(),
    )


def planar_poses(rows: Sequence[Array]) -> Any:
    """Poses (3,), (x [m], y [m], heading [rad]), of an entity in its parent's frame."""
    import rerun as rr

    planar = np.array(rows)
    half = 0.5 * planar[:, 2]
    zero = np.zeros(len(planar))
    return rr.Transform3D.columns(
        translation=np.column_stack([planar[:, :2], zero]),
        quaternion=np.column_stack([zero, zero, np.sin(half), np.cos(half)]),
    )


def strips(rows: Sequence[Sequence[Points]]) -> Any:
    """Sets of polylines (k, 3) [m]; an empty set takes the last one off the scene."""
    import rerun as rr

    flat = [strip for row in rows for strip in row]
    return rr.LineStrips3D.columns(strips=flat).partition([len(row) for row in rows])


def arrows(rows: Sequence[Arrows]) -> Any:
    """Sets of arrows; an empty set takes the last one off the scene."""
    return arrow_columns(
        np.concatenate([row.origins for row in rows]),
        np.concatenate([row.vectors for row in rows]),
        np.concatenate([row.colours for row in rows]),
        [],
        [len(row.origins) for row in rows],
    )


def arrow_columns(
    origins: Array, vectors: Array, tints: Colours, labels: Sequence[str], counts: Sequence[int]
) -> Any:
    """Arrows of several instants.

    Args:
        origins: (n, 3) [m].
        vectors: (n, 3) [m].
        tints: (n,) colours.
        labels: n texts, or none.
        counts: how many of the n belong to each instant.
    """
    import rerun as rr

    named = {"labels": labels} if labels else {}
    columns = rr.Arrows3D.columns(
        origins=origins.astype(np.float32),
        vectors=vectors.astype(np.float32),
        colors=tints,
        **named,
    )
    return columns.partition(counts)


def scalars(rows: Sequence[Array]) -> Any:
    """Values (n,) of n series."""
    import rerun as rr

    return rr.Scalars.columns(scalars=np.array(rows))


def texts(rows: Sequence[tuple[str, str]]) -> Any:
    """Lines of the log: text and level."""
    import rerun as rr

    return rr.TextLog.columns(text=[text for text, _ in rows], level=[level for _, level in rows])


def states(rows: Sequence[str]) -> Any:
    """Names of the states that are entered."""
    import rerun as rr

    return rr.StateChange.columns(state=list(rows))
