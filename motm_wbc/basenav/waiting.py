"""What waiting for a grasp does to the cost of a place to wait at.

The paper's cost C(robot -> i) + w C(i -> next) is the time of a robot whose grasp holds at
once. While attempts fail, driving on within reach is free as long as it takes no longer than
the wait, and what counts is how far it still is to the next target afterwards (see
`choice.time_until_leaving`).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Wait:
    """How long the robot is needed at its target, as far as it can tell.

    Attributes:
        expected: time from now until the step is done [s].
        restart: what coming to rest and starting again costs beside driving through [s].
        open_end: nothing is known of its end, so the robot will have to wait wherever it goes.
    """

    expected: float = 0.0
    restart: float = 0.0
    open_end: bool = False
