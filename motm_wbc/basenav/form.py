"""The form of a solid, wherever it may be; what is derived from it once moves along."""

from __future__ import annotations

import numpy as np
import shapely

from motm_wbc.basenav.inflation import grow, turning
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array

_KEPT_RADII = 8


class Form:
    """A simple polygon at the pose that it was given at.

    Attributes:
        rings: its outline (n, 2), counter-clockwise, and its holes, clockwise [m].
        convex: it is, and has no holes.
    """

    def __init__(self, rings: tuple[Array, ...]) -> None:
        self.rings = rings
        self.convex = len(rings) == 1 and turning(rings[0])[0] >= 0.0
        self._grown: dict[float, tuple[shapely.Polygon, ...]] = {}

    @property
    def corners(self) -> int:
        """How many corners it has."""
        return sum(map(len, self.rings))

    def rings_at(self, pose: Array) -> tuple[Array, ...]:
        """The rings, moved by a pose (3,) [m], [rad]; not to be written to."""
        if not pose.any():
            return self.rings
        moved = tuple(se2.transform_points(pose, ring) for ring in self.rings)
        for ring in moved:
            ring.flags.writeable = False
        return moved

    def grown(self, radius: float, pose: Array) -> tuple[shapely.Polygon, ...]:
        """Polygons that the form grown by a disc consists of, where the form is at a pose.

        Args:
            radius: of the disc [m].
            pose: (3,) by which the form was moved since [m], [rad].
        """
        if radius not in self._grown:
            if len(self._grown) >= _KEPT_RADII:
                self._grown.pop(next(iter(self._grown)))
            self._grown[radius] = grow(self.rings, radius)
        if not pose.any():
            return self._grown[radius]
        return tuple(
            shapely.transform(part, lambda points: se2.transform_points(pose, points))
            for part in self._grown[radius]
        )


def turned_by(poses: Array, ways: Array) -> Array:
    """Poses (s, 3), each moved by a transform (s, 3) about the world's origin."""
    c, s = np.cos(ways[:, 2]), np.sin(ways[:, 2])
    x = c * poses[:, 0] - s * poses[:, 1] + ways[:, 0]
    y = s * poses[:, 0] + c * poses[:, 1] + ways[:, 1]
    return np.column_stack([x, y, poses[:, 2] + ways[:, 2]])
