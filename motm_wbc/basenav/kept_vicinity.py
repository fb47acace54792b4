"""The free space that paths of a limited length between two places can meet, kept.

Every point x of a path of length l from p to a place within r of q has

    |x - p| + |x - q| <= l + r,

so that what does not meet the ellipse of that length can't meet the path. A time found in
the ellipse is exact if its path is short enough; if there is no path in it, there is none
(see `World.near`). When p moves by d, an ellipse that is longer by d contains the new one.
"""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.inflated import Inflated
from motm_wbc.basenav.walls import Walls
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array

SLACK = 0.5
"""What an ellipse is made longer than it seems to have to be [m]."""
ENLARGEMENTS = 6
"""Ellipses tried before the whole world is looked at."""
_GROWTH = 1.3
_FAR_TOO_LONG = 1.5  # times what is wanted: a part of the world that is not worth its time


class KeptVicinity:
    """The free space in an ellipse about two places, kept while it serves.

    Attributes:
        inflated: the free space.
    """

    inflated: Inflated

    def __init__(self, radius: float) -> None:
        """Of the free space of a disc with this radius [m]; look at a world first."""
        self._radius = radius
        self._world: World | None = None
        self._first = np.zeros(2)
        self._asked = self._length = 0.0

    def is_of(self, world: World) -> bool:
        """Whether this world has been looked at last."""
        return world is self._world

    def look(self, world: World, first: Array, second: Array, length: float) -> bool:
        """Take what meets the ellipse out of a world.

        Args:
            world: obstacles.
            first: (2,) a place [m].
            second: (2,) the other one [m].
            length: sum of the distances to both places, on the ellipse's rim [m]; infinite:
                the whole world.

        Returns:
            Whether the free space is another one than before.
        """
        if math.isfinite(length):
            found = world.near(self._radius, first, second, length)
        else:
            found = world.inflated(self._radius)
        changed = self._world is None or not _same(found.walls, self.inflated.walls)
        if changed:
            self.inflated = found
        self._world, self._first, self._asked = world, first.copy(), length
        self._length = length if found.ellipse is not None else math.inf
        return changed

    def serves(self, first: Array, needed: float) -> bool:
        """Whether an ellipse of length `needed` [m] about another first place lies inside."""
        return needed + math.hypot(*(first - self._first)) <= self._length

    def length_for(self, wanted: float) -> float:
        """The length to ask a new world for [m]: the last one, if it still suits."""
        return self._asked if wanted <= self._asked <= _FAR_TOO_LONG * wanted else wanted

    def enlarged(self, needed: float, tried: int) -> float:
        """The length to be tried after one did not serve [m]; infinite: no more of them."""
        if tried >= ENLARGEMENTS:
            return math.inf
        return max(needed + SLACK, _GROWTH * self._asked if tried > 1 else 0.0)


def _same(first: Walls, second: Walls) -> bool:
    """Whether two free spaces are equal to the bit."""
    return first is second or (
        first.bounded == second.bounded
        and np.array_equal(first.ring_start, second.ring_start)
        and np.array_equal(first.corners, second.corners)
        and np.array_equal(first.links, second.links)
    )
