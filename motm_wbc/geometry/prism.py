"""Outlines of upright prisms as tables of edges, and their placement in the world."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import kernel

X, Y, UX, UY, NX, NY, LENGTH = range(7)
"""Columns of a table of edges: first corner, unit direction, unit outward normal, length."""


def outline_edges(outline: Array) -> Array:
    """The edges of a convex outline.

    Args:
        outline: (n, 2) corners of a convex polygon, counter-clockwise [m]. Corners on a
            straight edge are legal.

    Returns:
        (n, 7) for each edge its first corner x, y [m], its unit direction x, y, its unit
        outward normal x, y, and its length [m].

    Raises:
        InputError: two neighbouring corners are the same, or there are less than three.
    """
    corners = np.asarray(outline, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise InputError(f"an outline is (n, 2) with n >= 3, not {corners.shape}")
    step = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(step[:, 0], step[:, 1])
    if not length.min() > 0.0:
        raise InputError("neighbouring corners of an outline must differ")
    unit = step / length[:, None]
    return np.column_stack([corners, unit, unit[:, 1], -unit[:, 0], length])


@kernel
def place_edges(local: Array, x: float, y: float, yaw: float, out: Array) -> None:
    """Edges given in the frame of a body, in the world.

    Args:
        local: (n, 7) as from `outline_edges`, in the body's frame.
        x: the body's place in the world [m].
        y: the same.
        yaw: its heading [rad].
        out: (n, 7), is written; may be `local` itself.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    for i in range(local.shape[0]):
        px, py = local[i, X], local[i, Y]
        out[i, X], out[i, Y] = x + c * px - s * py, y + s * px + c * py
        ux, uy = local[i, UX], local[i, UY]
        out[i, UX], out[i, UY] = c * ux - s * uy, s * ux + c * uy
        out[i, NX], out[i, NY] = out[i, UY], -out[i, UX]
        out[i, LENGTH] = local[i, LENGTH]
