"""The result of a run: what `motm run --json` prints, and its trace."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from motm_wbc.experiments.metrics import Spread
from motm_wbc.interfaces import Event

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, slots=True)
class RunSummary:
    """The figures of one run; names carry the units.

    Attributes:
        scenario: its name.
        robot: its name.
        method: its name.
        plant: `bullet` or `kinematic`.
        failure_delay_s: attempts that start less than this after the first one failed.
        seed: 0 is the nominal run.
        success: every object stands at its place.
        failure_reason: why not; None on success.
        task_time_s: when the last object's fingers had opened; None if the task failed.
        grasp_attempts: of all objects.
        first_attempt_time_s: when the first attempt began; None without one.
        grasp_time_s: when the first grasp took hold; None without one.
        base_speed_at_grasp_m_s: forward speed of the base at that moment.
        object_error_at_drop_m: largest distance of an object from its place, flat, one
            second after its release.
        base_path_length_m: length of the base's way.
        min_base_clearance_m: least distance of the base from anything.
        min_arm_clearance_m: least distance of arm, hand and load from anything they may not
            touch.
        collisions: episodes of contact that the audit found.
        limit_violation_max: largest excess of a commanded speed or acceleration as a share of
            its limit, and of the positions they integrate to as a share of the range.
        limit_violation_measured_max: the same of the measured motion.
        goal_switches: how often the base's goal changed after the first.
        fallback_steps: control steps answered below the controller's full problem.
        clock_guard_firings: searches ended by the clock.
        base_step_ms: wall time of the base steps.
        arm_step_ms: wall time of the arm steps.
        real_time_factor: simulated time over wall time.
    """

    scenario: str
    robot: str
    method: str
    plant: str
    failure_delay_s: float
    seed: int
    success: bool
    failure_reason: str | None
    task_time_s: float | None
    grasp_attempts: int
    first_attempt_time_s: float | None
    grasp_time_s: float | None
    base_speed_at_grasp_m_s: float | None
    object_error_at_drop_m: float | None
    base_path_length_m: float
    min_base_clearance_m: float | None
    min_arm_clearance_m: float | None
    collisions: int
    limit_violation_max: float
    limit_violation_measured_max: float
    goal_switches: int
    fallback_steps: int
    clock_guard_firings: int
    base_step_ms: Spread | None
    arm_step_ms: Spread | None
    real_time_factor: float

    def as_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class RunResult:
    """A finished run.

    Attributes:
        summary: the figures.
        trace: state, references, commands and timings at the control rate, as a table.
        events: what happened, in order.
        collisions: one line for each episode of contact.
        configuration: all parameters, resolved, and the versions of what ran.
    """

    summary: RunSummary
    trace: pa.Table
    events: tuple[Event, ...]
    collisions: tuple[str, ...]
    configuration: dict[str, Any] = field(repr=False)
