"""Drives on one floor, judged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.navigating.lattice import Lattice
from benchmarks.navigating.movers import with_movers
from benchmarks.navigating.outcome import Outcome
from benchmarks.navigating.tasks import ANGLE, DISTANCE, Task, draw_task
from benchmarks.navigating.worlds import Floor, make_floor
from motm_wbc import load_robot
from motm_wbc.basenav import GlobalPlanner, World
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.experiments.nav.drive import drive
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

MOST_MOVERS = 8
_ATTEMPTS = 20


@dataclass(frozen=True)
class Base:
    """The base that is driven.

    Attributes:
        footprint: (4, 2) [m].
        limits: its speeds and accelerations.
    """

    footprint: Array
    limits: BaseLimits

    @property
    def width(self) -> float:
        """Across the heading [m]."""
        return float(np.ptp(self.footprint[:, 1]))


@cache
def the_base() -> Base:
    """Frankie's."""
    model = load_robot("frankie")
    return Base(model.footprint, model.base_limits)


def still_drives(seed: int, count: int, planner: str) -> list[Outcome]:
    """All drives among obstacles at rest: `count` tasks, the first one nose to a table.

    A floor on which no table can be come to is drawn again.

    Args:
        seed: of the floor.
        count: of tasks.
        planner: name of the local planner.
    """
    base, nose = the_base(), None
    for attempt in range(_ATTEMPTS):
        floor = make_floor(seed, base.width, attempt)
        lattice = Lattice(floor.world, base.footprint)
        nose = draw_task(floor, lattice, base.footprint, 0, nose=True)
        if nose is not None:
            break
    tasks = [nose, *(draw_task(floor, lattice, base.footprint, k) for k in range(1, count))]
    return [out for task in tasks if task for out in _task_outcomes(floor, task, planner)]


def moving_drives(seed: int, planner: str) -> list[Outcome]:
    """One drive among 1 to 8 obstacles that move; none if there is no goal, or room to move.

    Args:
        seed: of the floor and of what moves; a stop and a drive through take turns.
        planner: name of the local planner.
    """
    base, floor = the_base(), make_floor(seed, the_base().width)
    task = draw_task(floor, Lattice(floor.world, base.footprint), base.footprint, seed % 2)
    if task is None:
        return []
    goal, limits = task.goals[0], base.limits
    alone = _drive(floor.world, task.start, goal, planner)
    path = GlobalPlanner(
        floor.world, limits.v_max, limits.omega_max, alone.inflation_m, limits.v_reverse
    ).plan(tuple(task.start), tuple(goal.pose))
    count = 1 + seed // 2 % MOST_MOVERS
    world = with_movers(floor.world, seed, count, path.points, path.time)
    movers = sum(solid.moves for solid in world.solids)
    if movers == 0:
        return []
    result = _drive(world, task.start, goal, planner)
    outcome = _outcome(floor, task, goal, task.start, result, movers)
    return [replace(outcome, alone=alone.time_s or 0.0)]


def _task_outcomes(floor: Floor, task: Task, planner: str) -> list[Outcome]:
    outcomes, start = [], task.start
    for goal in task.goals:
        result = _drive(floor.world, start, goal, planner)
        outcomes.append(_outcome(floor, task, goal, start, result, 0))
        if not result.success:
            break
        start = result.trajectory[-1, 1:4]
    return outcomes


def _drive(world: World, start: Array, goal: Goal, planner: str) -> DriveResult:
    base = the_base()
    return drive(
        world,
        base.footprint,
        base.limits,
        start,
        goal.pose,
        stop=goal.stop,
        planner=planner,
        tolerance=(DISTANCE, ANGLE),
    )


def _outcome(
    floor: Floor, task: Task, goal: Goal, start: Array, result: DriveResult, movers: int
) -> Outcome:
    end, clearance = result.trajectory[-1], result.min_clearance_m
    spread = result.step_ms
    return Outcome(
        scene=floor.seed,
        kind=floor.kind,
        index=task.index,
        leg=_leg(task, goal),
        movers=movers,
        start=tuple(start.tolist()),
        goal=tuple(goal.pose.tolist()),
        reached=result.success,
        reason=result.failure_reason or "",
        time=float(end[0]),
        bound=result.lower_bound_s or 0.0,
        alone=0.0,
        inflation=result.inflation_m,
        collisions=result.collisions,
        excused=result.excused,
        clearance=0.0 if clearance is None else clearance,
        excess=max(result.max_speed_excess, result.max_acceleration_excess),
        blocked=result.blocked_steps,
        guards=result.clock_guard_firings,
        steps=len(result.trajectory) // 6,
        step_ms=0.0 if spread is None else spread.median,
        step_p99_ms=0.0 if spread is None else spread.p99,
    )


def _leg(task: Task, goal: Goal) -> str:
    if len(task.goals) == 1:
        return "stop" if goal.stop else "through"
    return "nose" if goal is task.goals[0] else "leave"
