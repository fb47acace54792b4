"""How deep a segment lies in an upright convex solid, and the shortest way out.

The depth along an outward axis is how far the solid reaches along it, less how far the
segment's nearest point does. The least over the facets of the Minkowski difference is the
penetration depth (van den Bergen, Collision Detection in Interactive 3D Environments, 2003).
"""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.upright import UprightCylinders, UprightPrisms
from motm_wbc.geometry.vectors import TINY, across, dot, unit

_FAN = 65  # axes tried at once about the segment
_ZOOMS = 5  # each narrows the fan 32 times: the depth is exact to 1e-12 m
_UP = np.array([0.0, 0.0, 1.0])


def prism_depth(a: Array, b: Array, prisms: UprightPrisms) -> tuple[Array, Array]:
    """Depths (p,) [m] of segments a-b (p, 3) in prisms, and unit ways out (p, 3).

    The facets are the prism's own and those that the segment sweeps along its edges.
    """
    count, n = prisms.edges.shape[:2]
    direction = b - a
    axes = np.zeros((count, 4 + 3 * n, 3))
    axes[:, 0, 2], axes[:, 1, 2] = 1.0, -1.0
    axes[:, 2 : 2 + n, :2] = prisms.edges[:, :, 4:6]
    level = np.concatenate((prisms.edges[:, :, 2:4], np.zeros((count, n, 1))), axis=2)
    swept = unit(np.cross(level, direction[:, None, :]))
    axes[:, 2 + n : 2 + 2 * n], axes[:, 4 + 2 * n :] = swept, -swept
    beside = unit(np.cross(_UP, direction))
    axes[:, 2 + 2 * n], axes[:, 3 + 2 * n] = beside, -beside
    outline = np.einsum("mki,mni->mkn", axes[:, :, :2], prisms.edges[:, :, :2]).max(axis=2)
    return _least(a, b, axes, outline, prisms.faces)


def cylinder_depth(a: Array, b: Array, cylinders: UprightCylinders) -> tuple[Array, Array]:
    """Depths (p,) [m] of segments a-b (p, 3) in cylinders, and unit ways out (p, 3).

    The ways out: up, down, level through the mantle, and square to the segment over a rim;
    the best of the last is found by narrowing a fan of axes.
    """
    direction = b - a
    axes = np.zeros((len(a), 4, 3))
    axes[:, 0, 2], axes[:, 1, 2] = 1.0, -1.0
    axes[:, 2] = _through_mantle(a, direction, cylinders)
    axes[:, 3] = _over_rim(a, direction, cylinders)
    return _least(a, b, axes, _outline(axes, cylinders), cylinders.faces)


def _least(a: Array, b: Array, axes: Array, outline: Array, faces: Array) -> tuple[Array, Array]:
    """The least depth over unit axes (p, k, 3); zero axes don't count."""
    height = axes[:, :, 2]
    support = outline + np.maximum(height * faces[:, :1], height * faces[:, 1:])
    nearest = np.minimum(dot(axes, a[:, None]), dot(axes, b[:, None]))
    depth = np.where(dot(axes, axes) < 0.5, np.inf, support - nearest)
    rows, best = np.arange(len(a)), depth.argmin(axis=1)
    return depth[rows, best], axes[rows, best]


def _outline(axes: Array, cylinders: UprightCylinders) -> Array:
    """How far discs reach along the level part of axes (p, k, 3)."""
    level = axes[:, :, :2]
    discs = cylinders.discs[:, None]
    return np.asarray(dot(level, discs[:, :, :2]) + discs[:, :, 2] * np.sqrt(dot(level, level)))


def _through_mantle(a: Array, direction: Array, cylinders: UprightCylinders) -> Array:
    """(p, 3) level axes from the cylinder's axis to the segment."""
    level = direction * np.array([1.0, 1.0, 0.0])
    start = a * np.array([1.0, 1.0, 0.0])
    start[:, :2] -= cylinders.discs[:, :2]
    t = np.minimum(np.maximum(-dot(start, level) / (dot(level, level) + TINY), 0.0), 1.0)
    toward = unit(start + t[:, None] * level)
    beside = across(np.tile(_UP, (len(a), 1)), level)
    return np.where((dot(toward, toward) < 0.5)[:, None], beside, toward)


def _over_rim(a: Array, direction: Array, cylinders: UprightCylinders) -> Array:
    """(p, 3) best axes square to the segments; zero for a segment of no length."""
    first = across(direction, np.tile(_UP, (len(a), 1)))
    second = np.cross(unit(direction), first)
    angle, width = np.zeros(len(a)), np.pi
    rows = np.arange(len(a))
    for _ in range(_ZOOMS):
        angles = (angle[:, None] + np.linspace(-width, width, _FAN))[:, :, None]
        fan = np.cos(angles) * first[:, None] + np.sin(angles) * second[:, None]
        height = fan[:, :, 2] * cylinders.faces[:, :1], fan[:, :, 2] * cylinders.faces[:, 1:]
        reach = _outline(fan, cylinders) + np.maximum(*height)
        best = (reach - dot(fan, a[:, None])).argmin(axis=1)
        angle, width = angles[rows, best, 0], width * 2.0 / (_FAN - 1)
    return np.asarray(fan[rows, best] * (dot(direction, direction) > 0.0)[:, None])
