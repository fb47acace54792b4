"""The colours of a recording, for a dark background, as 0xRRGGBBAA."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from motm_wbc.geometry.arrays import Array

Colours: TypeAlias = NDArray[np.uint32]

FLOOR_LINE = 0x8090A0FF
PICK_SUPPORT = 0xC8A06EFF
PLACE_SUPPORT = 0x5E9C8FFF
OTHER_SUPPORT = 0x8C8C96FF
OBSTACLE = 0xA8584AFF
OBJECTS = (0xFF8C1AFF, 0xE84A8AFF, 0x4AB8F0FF, 0xB6E03CFF, 0xB68CFFFF)
LABEL = 0xF4F4F4FF
DROP = 0x7CF0C8FF

FOOTPRINT = 0xFFFFFFFF
TRAIL = 0xFFFFFF90
GLOBAL_PATH = 0x9AD0FFFF
LOCAL_PLAN = 0x33D6FFFF
BRAKING = 0xFF5A4AFF
GOAL = 0xFF3CF0FF
REJECTED = 0x8A8A8AFF
CANDIDATE_RING = 0x9090A0A0
REACH_RING = 0xFFC83CFF
AXES = (0xFF4040FF, 0x40E040FF, 0x5080FFFF)

LIMIT = 0x9A4040FF
COMMAND = 0x4AB8F0FF
REFERENCE = 0xFFC83CFF
MEASURED = 0xF0F0F0FF
SERIES = (
    0x4AB8F0FF,
    0xFFA03CFF,
    0x6EDC6EFF,
    0xF06A6AFF,
    0xB68CFFFF,
    0xD0A070FF,
    0xFF8CD2FF,
    0xC8D24AFF,
)
STATES = (
    0x3F7FB5FF,
    0xB5793FFF,
    0x4E9A5AFF,
    0x9A4E86FF,
    0x8A8A3AFF,
    0x5E5EB0FF,
    0x3F9A96FF,
    0xB05050FF,
)

_VIRIDIS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    dtype=float,
)


_VISIBLE = 0.8  # share of the scale that stands out from a dark background


def packed(rgb: Array) -> Colours:
    """Opaque colours (n, 3) in 0 ... 255 as 0xRRGGBBAA."""
    channels = np.rint(rgb).astype(np.uint32)
    return np.asarray(
        channels[:, 0] << 24 | channels[:, 1] << 16 | channels[:, 2] << 8 | 0xFF, dtype=np.uint32
    )


def viridis(share: Array) -> Colours:
    """The perceptually even scale from dark violet (0) over green to bright yellow (1)."""
    place = np.clip(share, 0.0, 1.0) * (len(_VIRIDIS) - 1)
    knots = np.arange(len(_VIRIDIS))
    return packed(np.column_stack([np.interp(place, knots, _VIRIDIS[:, k]) for k in range(3)]))


def by_cost(costs: Array) -> Colours:
    """Colours of finite costs (n,): the cheapest is the brightest."""
    if len(costs) == 0:
        return np.empty(0, dtype=np.uint32)
    span = float(np.ptp(costs))
    share = (costs - costs.min()) / span if span > 0.0 else np.zeros(len(costs))
    return viridis(1.0 - _VISIBLE * share)
