"""Stuck: noticed by the cost-to-go that no longer falls."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Standing:
    """How it stands with a goal.

    Attributes:
        stalled: for how long the cost-to-go has not fallen [s].
        stuck: for longer than there is patience.
    """

    stalled: float = 0.0
    stuck: bool = False


class ProgressMonitor:
    """Watches the cost-to-go of one goal.

    Attributes:
        patience: time without progress after which the base is stuck [s].
        gain: by which the cost-to-go has to fall below its least so far to be progress [s].
    """

    def __init__(self, patience: float = 11.0, gain: float = 0.1) -> None:
        self.patience = patience
        self.gain = gain
        self.restart()

    def restart(self) -> None:
        """There is another goal."""
        self._least = math.inf
        self._since = math.nan

    def update(self, time: float, cost_to_go: float, waits: bool = False) -> Standing:
        """Take note of a step.

        Args:
            time: [s].
            cost_to_go: `StaaPlan.cost_to_go` [s], infinite if there is no path.
            waits: it need not fall now: the base is at its goal, or on a way that leads there.
        """
        if waits or math.isnan(self._since) or cost_to_go < self._least - self.gain:
            self._least, self._since = cost_to_go, time
        stalled = time - self._since
        return Standing(stalled, stalled >= self.patience)
