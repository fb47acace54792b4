"""What base placement answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

from motm_wbc.basenav.planner import Path
from motm_wbc.basenav.ring import REASONS
from motm_wbc.basenav.walls import Indices
from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True)
class PlacementResult:
    """All candidates with their costs, and what was chosen.

    Attributes:
        candidates: (m, 3) poses.
        leg1: (m,) time from the robot to each [s], infinite where rejected.
        leg2: (m,) time from each to the next target [s], zero without one; infinite where
            the base can't stand, or there is no way on.
        costs: (m,) leg1 + w leg2, with what a wait changes [s], infinite where rejected.
        rejections: (m,) index into `REASONS`, 0 where a candidate is legal.
        selected: the chosen candidate, -1 if none is, or the robot shall stop here.
        stop_here: the robot shall brake to a stop where it can.
        stop_cost: cost of that [s], infinite where it is not offered.
        goal: (3,) the chosen candidate or the pose at rest, None if there is neither.
        next_reachable: the next target can be reached from a candidate; else leg 2 was left
            out of the choice.
        robot_push: distance from the robot to the nearest free point, where it stands
            inside an inflated obstacle; else 0 [m].
        next_push: the same of the next target, or of that one of the poses about it from
            which it is the least; it is part of leg 2 [m].
    """

    candidates: Array
    leg1: Array
    leg2: Array
    costs: Array
    rejections: Indices
    selected: int
    stop_here: bool
    stop_cost: float
    goal: Array | None
    next_reachable: bool
    robot_push: float
    next_push: float
    _route: Callable[[Array], Path | None] = field(repr=False, compare=False)

    @cached_property
    def path(self) -> Path | None:
        """From the robot to the goal, worked out when it is first asked for; None without one."""
        return None if self.goal is None else self._route(self.goal)

    @property
    def reasons(self) -> tuple[str, ...]:
        """(m,) why each candidate is rejected, in words; empty where it is legal."""
        return tuple(REASONS[code] for code in self.rejections)
