"""The floor's end: where the base must stay, and what of it is near."""

from __future__ import annotations

import shapely

from motm_wbc.basenav.inflation import shrink
from motm_wbc.basenav.outlines import HOLDS, Ellipse, pack
from motm_wbc.basenav.union import united
from motm_wbc.basenav.vicinity import box_about, clipped, relations_grown
from motm_wbc.geometry.arrays import Array

_KEPT_RADII = 8


class Floor:
    """The inside of a boundary; it never moves.

    Attributes:
        boundary: (n, 2) counter-clockwise outline [m].
        box: (4,) x and y of the lower, then of the upper bound [m].
    """

    def __init__(self, boundary: Array) -> None:
        self.boundary = boundary
        self._outlines = pack([(boundary,)])
        self.box: Array = self._outlines.box[0]
        self._free: dict[float, tuple[shapely.Polygon, ...]] = {}

    def free(self, radius: float) -> tuple[shapely.Polygon, ...]:
        """Polygons in which a disc's centre can be; see `shrink`."""
        if radius not in self._free:
            if len(self._free) >= _KEPT_RADII:
                self._free.pop(next(iter(self._free)))
            self._free[radius] = shrink(self.boundary, radius)
        return self._free[radius]

    def blocked_near(self, ellipse: Ellipse, radius: float) -> list[shapely.Polygon]:
        """What the boundary blocks in a box about an ellipse; nothing, if it is far away."""
        if relations_grown(self._outlines, ellipse, radius)[0] == HOLDS:
            return []
        box = box_about(ellipse)
        free = [piece for part in self.free(radius) for piece in clipped(part, box)]
        return united([shapely.box(*box)], without=free)
