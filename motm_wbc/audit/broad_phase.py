"""Spheres and boxes about everything: what they keep apart needs no exact look."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from motm_wbc.geometry.arrays import Array

Mask = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]


def squared_gaps(centres: Array, lower: Array, upper: Array) -> Array:
    """Squared distances of points to boxes in world axes.

    Args:
        centres: (p, 3) [m].
        lower: (s, 3) lower corners [m].
        upper: (s, 3) upper corners [m].

    Returns:
        (p, s) [m^2], zero inside.
    """
    points = centres[:, None, :]
    outside = np.maximum(lower - points, points - upper)
    np.maximum(outside, 0.0, out=outside)
    return np.asarray(np.einsum("psk,psk->ps", outside, outside))


class SpherePairs:
    """Pairs of spheres, made ready to be compared at every step.

    Args:
        pairs: (m, 2) indices.
        radii: (p,) [m].
        margin: gap up to which a pair counts as near [m].
    """

    def __init__(self, pairs: Indices, radii: Array, margin: float) -> None:
        self.pairs = pairs
        self._first = np.ascontiguousarray(pairs[:, 0])
        self._second = np.ascontiguousarray(pairs[:, 1])
        self._limit = (radii[self._first] + radii[self._second] + margin) ** 2

    def near(self, centres: Array) -> list[list[int]]:
        """Pairs whose spheres are near, for centres (p, 3) [m]."""
        apart = centres.take(self._first, axis=0)
        apart -= centres.take(self._second, axis=0)
        close = np.einsum("mk,mk->m", apart, apart) <= self._limit
        return [[int(i), int(j)] for i, j in self.pairs[close.nonzero()[0]]]
