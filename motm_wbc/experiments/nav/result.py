"""What came of a drive."""

from __future__ import annotations

from dataclasses import dataclass, field

from motm_wbc.experiments.metrics import Spread
from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class DriveResult:
    """The figures of one drive; names carry the units.

    Attributes:
        success: the goal was reached without contact.
        failure_reason: why not, in words; None on success.
        time_s: when the goal was reached; None if it was not.
        collisions: contacts that the audit found; a drive ends with the first.
        excused: of these, where an obstacle moved into a robot that had been at rest for
            a second.
        min_clearance_m: least distance of the footprint from anything; None if there is
            nothing.
        path_length_m: length of the base's way.
        global_path_length_m: of the global path at the start; None if there was none.
        lower_bound_s: its PathRTR, and v / a for the acceleration; None without a path.
        step_ms: wall time of the base steps.
        blocked_steps: base steps in which nothing but braking was safe or led on.
        clock_guard_firings: searches that the clock ended.
        max_speed_excess: by which a command would have led beyond a speed limit, as a share
            of it; 0 when all is well.
        max_acceleration_excess: the same of commanded accelerations.
        inflation_m: radius that the global planner planned for.
        trajectory: (k, 6) time, x, y, heading, v, omega at every control step.
    """

    success: bool
    failure_reason: str | None
    time_s: float | None
    collisions: int
    excused: int
    min_clearance_m: float | None
    path_length_m: float
    global_path_length_m: float | None
    lower_bound_s: float | None
    step_ms: Spread | None
    blocked_steps: int
    clock_guard_firings: int
    max_speed_excess: float
    max_acceleration_excess: float
    inflation_m: float
    trajectory: Array = field(repr=False)
