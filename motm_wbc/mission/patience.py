"""How long a grasp will still take, as far as the robot can tell.

Before the first attempt it is the time until the arm can make it. After a failed one nothing
is known of the cause; the longer it has lasted, the longer it is likely to last, so the wait
is taken to be as long again as it has been so far (the estimate for a scale-free prior).
"""

from __future__ import annotations


def expected_wait(
    time: float, first_attempt: float | None, until_in_range: float, attempt_time: float
) -> float:
    """Expected time from now until the present step is done [s].

    Args:
        time: now [s].
        first_attempt: when the first attempt of this step began [s], None before it.
        until_in_range: time until the target comes into range, zero if it is [s].
        attempt_time: from coming into range to the end of a first attempt that holds [s].
    """
    if first_attempt is None:
        return until_in_range + attempt_time
    return max(time - first_attempt, attempt_time)
