"""What came of drives: one record each, and what many come to."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Outcome:
    """One drive to one goal.

    Attributes:
        scene: seed of its floor.
        kind: of the floor.
        index: of the task.
        leg: `through`, `stop`, `nose` (to a table) or `leave` (it again).
        movers: obstacles that move.
        start: pose [m, m, rad].
        goal: pose [m, m, rad].
        reached: within 0.10 m and 0.35 rad, at rest if it is a stop.
        reason: why not; empty if it was.
        time: to reach it, or to the end [s].
        bound: PathRTR and v/a, among what is at rest [s].
        alone: time without what moves [s]; 0: not asked, or not reached.
        inflation: of the path [m].
        collisions: contacts; the drive ends with the first.
        excused: of these, with a robot that had been at rest for a second.
        clearance: least distance from anything [m].
        excess: of a command over a limit of speed or acceleration, as a share of it.
        blocked: base steps in which nothing but braking was safe.
        guards: searches that the clock ended.
        steps: base steps.
        step_ms: median of their wall time [ms].
        step_p99_ms: 99 % quantile of it [ms].
    """

    scene: int
    kind: str
    index: int
    leg: str
    movers: int
    start: tuple[float, ...]
    goal: tuple[float, ...]
    reached: bool
    reason: str
    time: float
    bound: float
    alone: float
    inflation: float
    collisions: int
    excused: int
    clearance: float
    excess: float
    blocked: int
    guards: int
    steps: int
    step_ms: float
    step_p99_ms: float

    @property
    def ratio(self) -> float:
        """Time as a share of the bound."""
        return self.time / self.bound


def table(outcomes: Sequence[Outcome]) -> str:
    """Shares of goals reached, times and clearances, by kind of floor and of goal."""
    lines = [f"{'':<14}{'goals':>7}{'reached':>9}{'%':>8}{'hit':>5}{'excused':>9}"]
    lines[0] += f"{'median':>9}{'p95':>7}{'worst':>7}"
    lines.append(_line("all", outcomes))
    groupings: list[Callable[[Outcome], str]] = [lambda o: o.leg, lambda o: o.kind]
    if any(outcome.movers for outcome in outcomes):
        groupings.append(lambda o: f"{o.movers} moving")
    for key in groupings:
        ordered = sorted(outcomes, key=key)
        for name, group in itertools.groupby(ordered, key=key):
            lines.append(_line(f"  {name}", list(group)))
    lines.append("times are shares of PathRTR + v/a of the static floor")
    alone = [o.time / o.alone for o in outcomes if o.reached and o.alone > 0.0]
    if alone:
        middle, high = np.quantile(alone, (0.5, 0.95))
        lines.append(f"shares of the time without what moves: {middle:.3f}, p95 {high:.3f}")
    steps = sum(o.steps for o in outcomes)
    spent = sum(o.steps * o.step_ms for o in outcomes) / max(steps, 1)
    lines += [
        f"least clearance {1e3 * min(o.clearance for o in outcomes):.1f} mm",
        f"largest excess of a limit {max(o.excess for o in outcomes):.2g}",
        f"searches ended by the clock {sum(o.guards for o in outcomes)}",
        f"base steps {steps}, {spent:.2f} ms in the mean of the drives' medians, "
        f"p99 {np.median([o.step_p99_ms for o in outcomes]):.1f} ms in the median drive",
        "not reached, by reason:",
    ]
    reasons = Counter(o.reason.split(" at ")[0].split(" of ")[0] for o in outcomes if not o.reached)
    lines += [f"  {number:4d}  {reason}" for reason, number in reasons.most_common()]
    return "\n".join(lines)


def _line(name: str, outcomes: Sequence[Outcome]) -> str:
    reached = [o for o in outcomes if o.reached]
    hit = sum(o.collisions - o.excused for o in outcomes)
    line = f"{name:<14}{len(outcomes):7d}{len(reached):9d}"
    line += f"{100.0 * len(reached) / len(outcomes):8.2f}{hit:5d}"
    line += f"{sum(o.excused for o in outcomes):9d}"
    if reached:
        middle, high, most = np.quantile([o.ratio for o in reached], (0.5, 0.95, 1.0))
        line += f"{middle:9.3f}{high:7.3f}{most:7.2f}"
    return line
