"""What the controller answers in one step."""

from __future__ import annotations

from dataclasses import dataclass, field

from motm_wbc.geometry.arrays import Array
from motm_wbc.qp.describe import Situation
from motm_wbc.qp.ladder import Answer
from motm_wbc.qp.rung import Rung


@dataclass(slots=True, eq=False)
class WholeBodyResult:
    """A command, and why it is what it is. There is one in every case.

    Attributes:
        base: (n_base,) base inputs [m/s, rad/s].
        arm: (n_arm,) joint velocities [rad/s or m/s].
        rung: `full`: all limits and collision rows hold. `no_acceleration`: the arm's
            acceleration limits gave way. `soft_collision`: collision rows gave way, too.
            `brake`: the input was unusable or no solver answered; everything brakes.
        scale: factor that navigation's command was scaled by; 0.0 where the base brakes on
            its last arc instead; 1.0 without navigation.
        slack: (6,) the twist that is asked of the robot's own tool less the one it gets, at
            the step's beginning, world axes [m/s, rad/s]; zero without a tool task.
        clearance: smallest distance of the pairs that are near enough to be looked at [m];
            infinite if there is none.
        solve_time: wall time of the solvers [s].
        step_time: wall time of the whole step [s].
        solver_fallback: daqp answered for the chosen solver, which failed or is not asked any more.
    """

    base: Array
    arm: Array
    rung: Rung
    scale: float
    slack: Array
    clearance: float
    solve_time: float
    step_time: float
    solver_fallback: bool
    _passed: str = field(default="", repr=False)
    _answer: Answer | None = field(default=None, repr=False)
    _situation: Situation | None = field(default=None, repr=False)

    @property
    def reason(self) -> str:
        """One line that names what contradicted what and what gave way; empty for `full`."""
        later = "" if self._answer is None else self._answer.reason
        return "; ".join(part for part in (self._passed, later) if part)

    @property
    def note(self) -> str:
        """Why the chosen solver is not asked any more; empty while it is."""
        return "" if self._answer is None else self._answer.note

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the limits and pairs that hold the command back."""
        return () if self._situation is None else self._situation.active()

    @property
    def clearance_pair(self) -> str:
        """Name of the pair with the smallest distance, empty if there is none."""
        return "" if self._situation is None else self._situation.closest()
