"""A held box as segments, so that it meets the world as the robot's capsules do."""

from __future__ import annotations

import itertools

import numpy as np

from motm_wbc.geometry.arrays import Array


def box_segments(size: Array) -> tuple[Array, Array]:
    """Segments and radii that stand for a box: its twelve edges, and a core.

    The edges, of no radius, are exact against all that is larger than a face. The core, the
    largest capsule inside the box, keeps thin posts from passing between the edges.

    Args:
        size: (3,) extents [m].

    Returns:
        (13, 2, 3) ends in the box's frame [m] and (13,) radii [m].
    """
    half = 0.5 * np.asarray(size, dtype=float)
    segments = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        for signs in itertools.product((-1.0, 1.0), repeat=2):
            end = np.zeros(3)
            end[others] = np.array(signs) * half[others]
            along = np.zeros(3)
            along[axis] = half[axis]
            segments.append([end - along, end + along])
    thin, long = float(half.min()), int(half.argmax())
    core = np.zeros(3)
    core[long] = half[long] - thin
    segments.append([-core, core])
    return np.array(segments), np.array([0.0] * 12 + [thin])
