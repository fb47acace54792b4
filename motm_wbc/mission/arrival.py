"""When, and from where, a target comes into range: read off the base's own plan."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.mission.cylinder import arm_base_position

_STEP = 0.05  # [m] between poses along the path


@dataclass(frozen=True, slots=True)
class Arrival:
    """The moment at which a target comes into range.

    Attributes:
        time: from now [s].
        base_pose: (3,) where the base will be.
    """

    time: float
    base_pose: Array


def base_prediction(base_pose: Array, local_plan: Array, global_path: Array, v_max: float) -> Array:
    """(k, 4) time from now [s], x, y, heading along which the base will go.

    The local plan as far as it leads, then the global path at full speed.

    Args:
        base_pose: (3,) now.
        local_plan: (j, 4) time from now, x, y, heading; may be empty.
        global_path: (m, 2) points from about here to the goal; may be empty.
        v_max: [m/s].
    """
    rows = [np.array([0.0, *base_pose])]
    rows.extend(local_plan)
    last = rows[-1]
    rest = _remainder(global_path, last[1:3])
    time, point, heading = float(last[0]), last[1:3], float(last[3])
    for following in rest:
        length = math.dist(point, following)
        if length < 1e-9:
            continue
        heading = math.atan2(following[1] - point[1], following[0] - point[0])
        count = max(1, math.ceil(length / _STEP))
        for k in range(1, count + 1):
            share = k / count
            x, y = point + share * (following - point)
            rows.append(np.array([time + share * length / v_max, x, y, heading]))
        time += length / v_max
        point = following
    return np.array(rows)


def arrival_in_range(
    prediction: Array, arm_xy: Array, target_xy: Array, reach: float
) -> Arrival | None:
    """The first predicted pose from which the target is in range, or None if there is none."""
    for row in prediction:
        centre = arm_base_position(row[1:], arm_xy)
        if math.dist(centre, target_xy) <= reach:
            return Arrival(float(row[0]), row[1:].copy())
    return None


def _remainder(path: Array, point: Array) -> Array:
    """Points of the path that lie ahead of the place on it that is nearest to `point`."""
    if len(path) < 2:
        return np.empty((0, 2))
    legs = path[1:] - path[:-1]
    squared = np.maximum((legs**2).sum(axis=1), 1e-12)
    shares = np.clip(((point - path[:-1]) * legs).sum(axis=1) / squared, 0.0, 1.0)
    feet = path[:-1] + shares[:, None] * legs
    nearest = int(np.argmin(((feet - point) ** 2).sum(axis=1)))
    return np.asarray(path[nearest + 1 :])
