"""Upright convex solids as arrays, one solid a row: prisms (boxes among them), cylinders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray


@dataclass(frozen=True, slots=True)
class UprightPrisms:
    """Prisms over convex outlines, all with the same number of corners n.

    Attributes:
        edges: (m, n, 7) for each edge its first corner x, y [m], its unit direction x, y,
            its unit outward normal x, y, and its length [m].
        faces: (m, 2) heights of the lower and upper faces [m].
    """

    edges: Array
    faces: Array

    @classmethod
    def over(cls, polygon: Array, faces: Array) -> UprightPrisms:
        """Prisms over outlines (m, n, 2) in the world, counter-clockwise, with `faces` (m, 2).

        Neighbouring corners must differ; corners on a straight edge are legal.
        """
        edges = np.empty((*polygon.shape[:2], 7))
        edges[:, :, :2] = polygon
        step = polygon[:, _following(polygon.shape[1])] - polygon
        length = np.sqrt(step[:, :, 0] ** 2 + step[:, :, 1] ** 2)
        edges[:, :, 2:4] = step / length[:, :, None]
        edges[:, :, 4] = edges[:, :, 3]
        edges[:, :, 5] = -edges[:, :, 2]
        edges[:, :, 6] = length
        return cls(edges, np.asarray(faces, dtype=float))

    @classmethod
    def stack(cls, outlines: Sequence[Array], faces: Array) -> UprightPrisms:
        """Prisms over convex outlines (n_i, 2) of different numbers of corners."""
        corners = max((len(outline) for outline in outlines), default=4)
        padded = [_with_corners(outline, corners) for outline in outlines]
        polygon = np.array(padded).reshape(-1, corners, 2)
        return cls.over(polygon, np.asarray(faces).reshape(-1, 2))

    def take(self, rows: IntArray) -> UprightPrisms:
        """The prisms of the given rows, in that order."""
        return UprightPrisms(self.edges[rows], self.faces[rows])


@dataclass(frozen=True, slots=True)
class UprightCylinders:
    """Cylinders about vertical axes.

    Attributes:
        discs: (m, 3) x and y of the axis and the radius [m].
        faces: (m, 2) heights of the lower and upper faces [m].
    """

    discs: Array
    faces: Array

    def take(self, rows: IntArray) -> UprightCylinders:
        """The cylinders of the given rows, in that order."""
        return UprightCylinders(self.discs[rows], self.faces[rows])


def _with_corners(outline: Array, corners: int) -> Array:
    """The same outline with more corners: its longest edges are halved."""
    points = np.asarray(outline, dtype=float)
    while len(points) < corners:
        step = points[_following(len(points))] - points
        longest = int(np.argmax(step[:, 0] ** 2 + step[:, 1] ** 2))
        points = np.insert(points, longest + 1, points[longest] + 0.5 * step[longest], axis=0)
    return points


def _following(count: int) -> list[int]:
    return [*range(1, count), 0]
