"""Arrays of vectors: products, unit vectors, vectors across others."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array

TINY = 1e-300
"""Keeps a division by an exact zero finite."""
TOUCHING = 1e-9
"""Length below which a vector has no direction [m]."""


def dot(x: Array, y: Array) -> Array:
    """Scalar products along the last axis."""
    return np.asarray(np.add.reduce(x * y, axis=-1))


def unit(vectors: Array) -> Array:
    """Unit vectors; a vector shorter than `TOUCHING` becomes zero."""
    norm = np.sqrt(dot(vectors, vectors))[..., None]
    return np.where(norm > TOUCHING, vectors / np.maximum(norm, TOUCHING), 0.0)


def across(u: Array, v: Array) -> Array:
    """(m, 3) unit vectors square to u and v; to u alone where the two are parallel."""
    axis = unit(np.cross(u, v))
    spare = unit(np.cross(u, np.eye(3)[np.abs(u).argmin(axis=1)]))
    spare[dot(spare, spare) < 0.5] = [0.0, 0.0, 1.0]
    return np.where((dot(axis, axis) < 0.5)[:, None], spare, axis)
