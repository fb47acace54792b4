"""Base placement, timed: all candidates, both legs, as the robot drives up to an object."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any, TypedDict

import numpy as np

from motm_wbc.basenav.placement import BasePlacement
from motm_wbc.basenav.world import World
from motm_wbc.experiments.bench.basenav_world import (
    AREA,
    FOOTPRINT,
    LIMITS,
    NavScene,
    along,
    random_scene,
    small_moves,
)

COUNTS = (1, 5, 20, 50, 100, 200, 400)
DENSE_COUNT, DENSE_AREAS = 100, (2.0, 7.0)  # [m^2] floor for each obstacle
MOST = 400
SCENES = 10
STEPS = 160  # of a base of 0.5 m/s and 20 Hz, over the 4 m to the object
MOVES = 40
_LOCAL_PLANNER = "motm_wbc.experiments.bench.basenav_staa"
_MICRO = 1e-3  # us in a ns


class Times(TypedDict):
    """What is reported of a call.

    Attributes:
        median: wall time [us].
        p99: CPU time that 99 of 100 calls keep [us].
        wall_p99: the same of wall time [us].
        count: calls that the times are of.
    """

    median: float
    p99: float
    wall_p99: float
    count: int


@dataclass(frozen=True, slots=True)
class NavBenchResult:
    """What the benchmark came to.

    Attributes:
        figures: by name: times in microseconds (`_us`) or milliseconds (`_ms`), or a number.
        titles: what each name is, for people.
    """

    figures: dict[str, Any] = field(default_factory=dict)
    titles: dict[str, str] = field(default_factory=dict)


def bench_basenav(
    *,
    scenes: int = SCENES,
    steps: int = STEPS,
    moves: int = MOVES,
    progress: Callable[[str], None] = lambda _: None,
) -> NavBenchResult:
    """Time the placement in worlds of more and more obstacles.

    Args:
        scenes: random worlds of each number of obstacles.
        steps: poses on the way to the object in each of them.
        moves: times that all obstacles of a world are moved.
        progress: is told what is done next.
    """
    result = NavBenchResult()
    for name, title, call in _entries(scenes, steps, moves):
        progress(f"timing: {title}")
        result.figures[name], result.titles[name] = call(), title
    if find_spec(_LOCAL_PLANNER) is not None:
        progress("timing: the local planner")
        found = import_module(_LOCAL_PLANNER).local_planner_figures()
        result.figures.update(found)
        result.titles.update(dict.fromkeys(found, "local planner"))
    return result


def _entries(scenes: int, steps: int, moves: int) -> Iterator[tuple[str, str, Callable[[], Times]]]:
    """Name, title and measurement of each figure."""
    for count in COUNTS:
        yield (
            f"placement_{count}_obstacles_us",
            f"placement, {count} obstacles",
            partial(_drives, count, AREA, scenes, steps),
        )
    for area in DENSE_AREAS:
        yield (
            f"placement_{DENSE_COUNT}_obstacles_per_{area:g}_m2_us",
            f"placement, {DENSE_COUNT} obstacles, one on {area:g} m2",
            partial(_drives, DENSE_COUNT, area, scenes, steps),
        )
    yield (
        f"placement_{MOST}_moved_us",
        f"{MOST} obstacles moved, then placement",
        partial(_moved, scenes, moves),
    )
    yield (
        f"placement_{MOST}_new_us",
        f"{MOST} new obstacles, then placement",
        partial(_new, scenes),
    )


def _drives(count: int, area: float, scenes: int, steps: int) -> Times:
    """One evaluation at each pose of the way to where the first one would have the base."""
    timer = _Timer()
    for placement, scene in _ready(count, area, scenes):
        path = placement.evaluate(scene.start, scene.target, scene.after).path
        previous = None
        for pose in [] if path is None else along(path.points, steps):
            with timer:
                result = placement.evaluate(pose, scene.target, scene.after, previous=previous)
            previous = result.goal
    return timer.times()


def _moved(scenes: int, moves: int) -> Times:
    """All obstacles are moved rigidly, and all is evaluated in the new world."""
    timer = _Timer()
    for seed, (placement, scene) in enumerate(_ready(MOST, AREA, scenes)):
        rng, world = np.random.default_rng(seed), World(scene.obstacles)
        placement.update(world)
        placement.evaluate(scene.start, scene.target, scene.after)
        for _ in range(moves):
            ways = small_moves(scene.obstacles, rng)
            with timer:
                placement.update(world.transformed(ways))
                placement.evaluate(scene.start, scene.target, scene.after)
    return timer.times()


def _new(scenes: int) -> Times:
    """A world of obstacles never seen before, checked, inflated, and evaluated."""
    timer = _Timer()
    for seed in range(scenes):
        scene = random_scene(MOST, seed)
        with timer:
            placement = BasePlacement(World(scene.obstacles), FOOTPRINT, LIMITS)
            placement.evaluate(scene.start, scene.target, scene.after)
    return timer.times()


def _ready(count: int, area: float, scenes: int) -> Iterator[tuple[BasePlacement, NavScene]]:
    for seed in range(scenes):
        scene = random_scene(count, seed, area)
        yield BasePlacement(World(scene.obstacles), FOOTPRINT, LIMITS), scene


class _Timer:
    """Wall and CPU time of what it is a context of."""

    def __init__(self) -> None:
        self._wall: list[int] = []
        self._cpu: list[int] = []

    def __enter__(self) -> None:
        self._begun = time.thread_time_ns(), time.perf_counter_ns()

    def __exit__(self, *_: object) -> None:
        wall, cpu = time.perf_counter_ns(), time.thread_time_ns()
        self._cpu.append(cpu - self._begun[0])
        self._wall.append(wall - self._begun[1])

    def times(self) -> Times:
        wall, cpu = (_MICRO * np.array(one, dtype=float) for one in (self._wall, self._cpu))
        return Times(
            median=round(float(np.median(wall)), 2),
            p99=round(float(np.percentile(cpu, 99)), 2),
            wall_p99=round(float(np.percentile(wall, 99)), 2),
            count=len(wall),
        )
