"""Whether the base comes nearer to its goal."""

from __future__ import annotations

import math


class Progress:
    """Watches the time to go of one goal.

    Attributes:
        patience: time without progress after which the base counts as stuck [s].
        gain: by which the time to go has to fall to count as progress [s].
    """

    def __init__(self, patience: float = 8.0, gain: float = 0.25) -> None:
        self.patience = patience
        self.gain = gain
        self.restart()

    def restart(self) -> None:
        """There is another goal."""
        self._least = math.inf
        self._since = math.nan

    def update(self, time: float, time_to_go: float) -> float:
        """Take note of a step.

        Args:
            time: [s].
            time_to_go: [s], infinite if there is no path.

        Returns:
            For how long there has been no progress [s].
        """
        if math.isnan(self._since) or time_to_go < self._least - self.gain:
            self._least, self._since = time_to_go, time
        return time - self._since
