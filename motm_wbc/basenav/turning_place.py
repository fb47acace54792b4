"""The nearest place, straight ahead or back, where the base can turn on the spot."""

from __future__ import annotations

import math

from motm_wbc.basenav.departure import turn_is_clear
from motm_wbc.basenav.footprint_check import EdgeMap, Outline, is_clear
from motm_wbc.geometry.jit import kernel

_STEP = 0.04  # [m]
_FARTHEST = 5.0  # radii of the outline


@kernel
def _can_turn(
    edges: EdgeMap, outline: Outline, x: float, y: float, heading: float, margin: float
) -> bool:
    """Whether the base can turn all the way round."""
    middle = heading + math.pi
    return turn_is_clear(edges, outline, x, y, heading, middle, margin) and turn_is_clear(
        edges, outline, x, y, middle, heading + math.tau, margin
    )


@kernel
def turning_place(
    edges: EdgeMap, outline: Outline, x: float, y: float, heading: float, margin: float
) -> float:
    """How far to drive, negative backwards [m], to be able to turn on the spot; NaN: too far.

    Args:
        edges: the world, not inflated.
        outline: footprint.
        x: [m].
        y: [m].
        heading: [rad].
        margin: distance that the footprint keeps [m].
    """
    c, s = math.cos(heading), math.sin(heading)
    ahead = back = True
    for k in range(int(_FARTHEST * outline.radius / _STEP) + 1):
        for sense in (-1.0, 1.0):
            way = sense * k * _STEP
            if not (back if sense < 0.0 else ahead):
                continue
            px, py = x + way * c, y + way * s
            if not is_clear(edges, outline, px, py, c, s, margin):
                if sense < 0.0:
                    back = False
                else:
                    ahead = False
            elif _can_turn(edges, outline, px, py, heading, margin):
                return way
    return math.nan
