"""What the controller answers in one step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics import Configuration

Rung = Literal["full", "no_acceleration", "soft_collision", "brake"]
"""Rungs of the ladder, from normal operation to the last resort."""


@dataclass(frozen=True, slots=True, eq=False)
class WholeBodyResult:
    """A command, and why it is what it is. There is one in every case.

    Attributes:
        base: (n_base,) base inputs [m/s, rad/s].
        arm: (n_arm,) joint velocities [rad/s or m/s].
        rung: `full`: all limits and collision rows hold. `no_acceleration`: the arm's
            acceleration limits gave way. `soft_collision`: collision rows gave way, too.
            `brake`: the input was unusable or no solver answered; everything brakes.
        reason: one line that names what contradicted what; empty for `full`.
        active: names of the limits and pairs that hold the command back.
        scale: factor that navigation's command was scaled by; 0.0 where the base brakes on
            its last arc instead; 1.0 without navigation.
        slack: (6,) the tool task's twist less the tool's, world axes [m/s, rad/s]; zero
            without a tool task.
        clearance: smallest distance of the pairs within their influence distance [m];
            infinite if there is none.
        clearance_pair: name of that pair, empty if there is none.
        solve_time: wall time of the solvers [s].
        step_time: wall time of the whole step [s].
        solver_fallback: the chosen solver failed on a problem that daqp then solved.
        configuration: of the robot in this step; None if the input was unusable.
    """

    base: Array
    arm: Array
    rung: Rung
    reason: str
    active: tuple[str, ...]
    scale: float
    slack: Array
    clearance: float
    clearance_pair: str
    solve_time: float
    step_time: float
    solver_fallback: bool
    configuration: Configuration | None
