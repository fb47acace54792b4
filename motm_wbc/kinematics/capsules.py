"""Fitting capsules to a URDF's collision shapes, and proving that they contain them.

For whoever writes a robot file: `fit_link` gives the numbers of a `[[capsules]]` entry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.optimize import minimize

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.hulls import collision_hulls

_PENALTY_LENGTH = 1e-5  # [m] beyond the plane that count as much as twice the volume


@dataclass(frozen=True, slots=True, eq=False)
class FittedCapsule:
    """A capsule that contains a set of points.

    Attributes:
        a: (3,) one end of the segment [m].
        b: (3,) the other end [m].
        radius: [m].
        volume: [m^3].
        volume_ratio: its volume over that of the points' convex hull.
    """

    a: Array
    b: Array
    radius: float
    volume: float
    volume_ratio: float


def collision_points(urdf: Path, link: str) -> Array:
    """(n, 3) points in the link frame whose convex hull contains the link's collision shapes.

    Args:
        urdf: a robot's generated URDF, whose meshes have absolute paths.
        link: name of the link.

    Raises:
        InputError: no such link with a collision shape.
    """
    hulls = collision_hulls(urdf)
    if link not in hulls:
        raise UnknownName("link with a collision shape", link, hulls, str(urdf))
    return np.concatenate(hulls[link])


def fit_link(urdf: Path, link: str, plane: Array | None = None) -> FittedCapsule:
    """The smallest capsule about a link's collision shapes; see `fit_capsule`."""
    return fit_capsule(collision_points(urdf, link), plane)


def fit_capsule(points: Array, plane: Array | None = None) -> FittedCapsule:
    """The capsule of least volume that contains all points, by local search from many starts.

    Deterministic. The ends are rounded to 0.1 mm, then the radius up, so that what is
    written in a file still contains the points.

    Args:
        points: (n, 3) [m], not all in one plane.
        plane: (4,) unit normal n and height h [m]: the capsule shall not reach beyond
            n x = h, for finger tips that come close to a table.
    """
    hull = trimesh.convex.convex_hull(points)
    corners = np.asarray(hull.vertices, dtype=float)
    centre = corners.mean(axis=0)
    principal = np.linalg.svd(corners - centre, full_matrices=False)[2]
    found = []
    for axis in (*principal, *np.eye(3)):
        along = (corners - centre) @ axis
        for share in (0.9, 0.5):
            start = np.concatenate(
                [centre + share * along.min() * axis, centre + share * along.max() * axis]
            )
            found.append(_descend(start, corners, plane))
    ends = min(found, key=lambda pair: pair[0])[1]
    a, b = np.round(ends[:3], 4), np.round(ends[3:], 4)
    radius = math.ceil(float(segment_distance(corners, a, b).max()) * 1e4) / 1e4
    volume = capsule_volume(a, b, radius)
    return FittedCapsule(a, b, radius, volume, volume / float(hull.volume))


def excess(points: Array, a: Array, b: Array, radius: float) -> float:
    """How far the farthest point sticks out of the capsule [m]; negative: all are inside."""
    return float(segment_distance(points, a, b).max()) - radius


def segment_distance(points: Array, a: Array, b: Array) -> Array:
    """(n,) distances of points (n, 3) from the segment between a and b [m]."""
    direction = b - a
    square = float(direction @ direction)
    share = np.clip((points - a) @ direction / square, 0.0, 1.0) if square > 0.0 else 0.0
    nearest = a + np.multiply.outer(share * np.ones(len(points)), direction)
    return np.asarray(np.linalg.norm(points - nearest, axis=1))


def capsule_volume(a: Array, b: Array, radius: float) -> float:
    """[m^3]."""
    return math.pi * radius**2 * (float(np.linalg.norm(b - a)) + 4.0 / 3.0 * radius)


def _descend(start: Array, corners: Array, plane: Array | None) -> tuple[float, Array]:
    """Volume and ends (6,) of a locally smallest capsule about the corners."""

    def volume(ends: Array) -> float:
        radius = float(segment_distance(corners, ends[:3], ends[3:]).max())
        size = capsule_volume(ends[:3], ends[3:], radius)
        if plane is None:
            return size
        beyond = float((ends.reshape(2, 3) @ plane[:3]).max()) + radius - plane[3]
        return float(size * (1.0 + max(0.0, beyond) / _PENALTY_LENGTH))

    # the radius is a maximum over points, so the volume has kinks: no gradients
    first = minimize(
        volume,
        start,
        method="Nelder-Mead",
        options={"maxfev": 4000, "xatol": 1e-5, "fatol": 1e-9, "adaptive": True},
    )
    second = minimize(volume, first.x, method="Powell", options={"maxiter": 50})
    return float(second.fun), np.asarray(second.x)
