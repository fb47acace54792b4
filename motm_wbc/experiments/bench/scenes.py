"""Boxes round the arm: enough of them that the collision rows are always in use.

Every box is (6,): centre, then size [m]. They hang above the base's body, so that only the
arm meets them.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import Body

_THICK = 0.1  # [m] of a wall


def walls(
    half_width: float, x: tuple[float, float], z: tuple[float, float], cuts: tuple[int, int]
) -> Array:
    """Two walls along x, cut into `cuts` lengths and layers, a gap of a tenth between them."""
    edges = [np.linspace(*span, count + 1) for span, count in zip((x, z), cuts, strict=True)]
    boxes = []
    for side in (-1.0, 1.0):
        y = side * (half_width + 0.5 * _THICK)
        for low_x, high_x in zip(edges[0][:-1], edges[0][1:], strict=True):
            for low_z, high_z in zip(edges[1][:-1], edges[1][1:], strict=True):
                size = 0.9 * (high_x - low_x), _THICK, 0.9 * (high_z - low_z)
                boxes.append([0.5 * (low_x + high_x), y, 0.5 * (low_z + high_z), *size])
    return np.array(boxes)


def ring(centre: Array, radius: float, z: tuple[float, float], count: int) -> Array:
    """(count, 6) pillars on a circle about `centre` (2,) [m]."""
    angles = math.tau * np.arange(count) / count
    boxes = np.empty((count, 6))
    boxes[:, 0] = centre[0] + radius * np.cos(angles)
    boxes[:, 1] = centre[1] + radius * np.sin(angles)
    boxes[:, 2] = 0.5 * (z[0] + z[1])
    boxes[:, 3:] = _THICK, _THICK, z[1] - z[0]
    return boxes


def bodies(boxes: Array) -> tuple[Body, ...]:
    """The boxes as the controller has them."""
    return tuple(
        Body(
            name=f"box{i}",
            role=SolidRole.OBSTACLE,
            outlines=(polygons.rectangle(box[3], box[4]),),
            radius=None,
            bottom=float(box[2] - 0.5 * box[5]),
            top=float(box[2] + 0.5 * box[5]),
            pose=np.array([box[0], box[1], 0.0]),
            velocity=np.zeros(3),
        )
        for i, box in enumerate(boxes)
    )
