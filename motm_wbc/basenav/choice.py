"""Which candidate is chosen, given what each one costs."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.geometry.arrays import Array


def select(
    poses: Array,
    costs: Array,
    leg2: Array,
    previous: Array | None,
    parameters: PlacementParameters,
) -> int:
    """The cheapest candidate; ties go toward the next target; the last choice is kept.

    Candidates on the way cost nearly the same, and which of them is the cheapest changes
    from step to step. Of those within the slack the one with the least way on is taken. The
    last choice stands unless another is cheaper by more than the hysteresis, or lies nearer
    to the next target: that is progress, and never held up.

    Args:
        poses: (m, 3) candidates.
        costs: (m,) [s], infinite where rejected.
        leg2: (m,) time on to the next target [s].
        previous: (3,) goal of the last step, or None.
        parameters: slack, hysteresis and the ring's measures.

    Returns:
        Index of the choice, -1 if all are rejected.
    """
    least = float(costs.min())
    if math.isinf(least):
        return -1
    tied = np.flatnonzero(costs <= least + parameters.tie_slack)
    order = np.lexsort((tied, costs[tied], leg2[tied]))
    chosen = int(tied[order[0]])
    kept = match(poses, previous, parameters)
    if (
        kept >= 0
        and costs[kept] <= costs[chosen] + parameters.hysteresis
        and leg2[kept] <= leg2[chosen]
    ):
        return kept
    return chosen


def match(poses: Array, previous: Array | None, parameters: PlacementParameters) -> int:
    """The candidate that `previous` was, though the object may have moved a little; else -1."""
    if previous is None:
        return -1
    apart = np.hypot(poses[:, 0] - previous[0], poses[:, 1] - previous[1])
    turned = np.abs(np.remainder(poses[:, 2] - previous[2] + math.pi, math.tau) - math.pi)
    spacing = math.tau / parameters.count
    same = (apart < 0.5 * spacing * parameters.radius) & (turned < 0.5 * spacing)
    return int(np.argmin(np.where(same, apart, math.inf))) if same.any() else -1
