"""Stuck: noticed by the cost-to-go that no longer falls, and what is tried then."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass


class Remedy(enum.StrEnum):
    """What a base that is stuck tries.

    `WIDER` searches with more actions and expansions; `TURNING_PLACE` drives straight to the
    nearest place where the base can turn on the spot, back or ahead, before it goes on.
    """

    NONE = "none"
    WIDER = "wider search"
    TURNING_PLACE = "to a turning place"


@dataclass(frozen=True)
class Standing:
    """How it stands with a goal.

    Attributes:
        stalled: for how long the cost-to-go has not fallen [s].
        remedy: what to plan the next step with.
        stuck: all remedies have been tried since.
    """

    stalled: float = 0.0
    remedy: Remedy = Remedy.NONE
    stuck: bool = False


class ProgressMonitor:
    """Watches the cost-to-go of one goal.

    Attributes:
        patience: time without progress after which a remedy is tried [s].
        spell: how long each is tried, in turn [s].
        gain: by which the cost-to-go has to fall below its least so far to be progress [s].
    """

    def __init__(self, patience: float = 3.0, spell: float = 4.0, gain: float = 0.1) -> None:
        self.patience = patience
        self.spell = spell
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
            waits: the base is at its goal, or shall not move for another reason.
        """
        if waits or math.isnan(self._since) or cost_to_go < self._least - self.gain:
            self._least, self._since = cost_to_go, time
        stalled = time - self._since
        if stalled < self.patience:
            return Standing(stalled)
        tried = int((stalled - self.patience) / self.spell)
        remedies = (Remedy.WIDER, Remedy.TURNING_PLACE)
        return Standing(stalled, remedies[tried % len(remedies)], tried >= len(remedies))
