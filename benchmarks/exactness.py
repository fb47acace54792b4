"""The global planner's times against brute force, on random maps of ten kinds.

    python -m benchmarks.exactness [--maps 500] [--queries 6] [--first 0] [--processes 2]
        [--kind KIND] [--extremity .bench/extremity]

Each map is planned on in the world's own inflated outlines; how the reference works is told
in `benchmarks.exact`. With turning for nothing, the lengths are compared with those of
extremitypathfinder in an environment of its own (`make .bench/extremity/.ready`).
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.exact.maps import KINDS, make_map, random_pose, random_speeds
from benchmarks.exact.reference import Reference
from benchmarks.exact.sight import FreeSpace
from benchmarks.exact.straight import worst_difference
from motm_wbc.basenav import GlobalPlanner
from motm_wbc.errors import NoPath

_MAX_ERROR = 1e-9  # [s]
_MAX_LENGTH_ERROR = 1e-6  # [m]
_STRAIGHT_QUERIES = 300


@dataclass(frozen=True)
class Comparison:
    """What one map's queries gave.

    Attributes:
        kind: of map.
        seed: of the map.
        obstacles: how many.
        errors: (k,) difference of the times [s]; infinite where one found a path and the
            other none; 0 where both found none.
        reachable: how many queries have a path.
        corners: of the free space.
    """

    kind: str
    seed: int
    obstacles: int
    errors: tuple[float, ...]
    reachable: int
    corners: int


def compare(kind: str, seed: int, queries: int) -> Comparison:
    """Plan on a random map, and by brute force."""
    rng = np.random.default_rng([seed, *kind.encode()])
    drawn = make_map(kind, rng)
    while drawn.world.bounded and drawn.world.inflated(drawn.inflation).region.is_empty:
        drawn = make_map(kind, rng)
    world = drawn.world
    inflated = world.inflated(drawn.inflation)
    space = FreeSpace(inflated.region, world.bounded)
    reference = Reference(space)
    speeds = random_speeds(rng)
    planner = GlobalPlanner(world, speeds.forward, speeds.turning, drawn.inflation, speeds.backward)
    errors, reachable = [], 0
    for _ in range(queries):
        start, goal = (random_pose(rng, space, drawn.side) for _ in range(2))
        if rng.random() < 0.05:
            goal = (*start[:2], goal[2])
        expected = reference.time(start, goal, speeds)
        try:
            found = planner.plan(start, goal).time
        except NoPath:
            found = math.inf
        errors.append(0.0 if expected == found else abs(expected - found))
        reachable += math.isfinite(expected)
    return Comparison(
        kind, seed, len(drawn.obstacles), tuple(errors), reachable, len(space.corners)
    )


def table(found: Sequence[Comparison]) -> str:
    """Worst errors by kind."""
    head = f"{'maps of':22}{'maps':>5}{'corners':>9}{'queries':>9}{'no path':>9}{'worst [s]':>11}"
    lines = [head + f"{'reach':>7}"]
    for kind in dict.fromkeys(one.kind for one in found):
        rows = [one for one in found if one.kind == kind]
        lines.append(_line(kind, rows))
    lines.append(_line("all", found))
    return "\n".join(lines)


def _line(name: str, rows: Sequence[Comparison]) -> str:
    errors = np.array([error for one in rows for error in one.errors])
    reached = np.isfinite(errors)
    worst = errors[reached].max(initial=0.0)
    most = max(one.corners for one in rows)
    blocked = errors.size - sum(one.reachable for one in rows)
    wrong = int((~reached).sum())
    counts = f"{len(rows):5d}{most:9d}{errors.size:9d}{blocked:9d}"
    return f"{name:22}{counts}{worst:11.1e}{'same' if wrong == 0 else f'{wrong} !':>7}"


def main() -> int:
    """Compare, print, and say by the exit status whether all agrees."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--maps", type=int, default=500)
    parser.add_argument("--queries", type=int, default=6)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--kind", choices=KINDS)
    parser.add_argument("--extremity", type=Path, default=Path(".bench/extremity"))
    options = parser.parse_args()
    kinds = [options.kind] if options.kind else list(KINDS)
    each = math.ceil(options.maps / len(kinds))
    tasks = [(kind, options.first + k) for kind in kinds for k in range(each)]
    began = time.perf_counter()
    with ProcessPoolExecutor(options.processes) as pool:
        jobs = [pool.submit(compare, *task, options.queries) for task in tasks]
        found = [job.result() for job in jobs]
    print(table(found))
    print(f"{time.perf_counter() - began:.0f} s")
    wrong = [one for one in found if max(one.errors) > _MAX_ERROR]
    for one in wrong:
        print(f"differs: {one.kind}, seed {one.seed}, {one.obstacles} obstacles: {one.errors}")
    return 1 if wrong or not _lengths_agree(options.extremity) else 0


def _lengths_agree(environment: Path) -> bool:
    if not environment.is_dir():
        print(f"extremitypathfinder: left out, there is no {environment}")
        return True
    worst = worst_difference(environment, _STRAIGHT_QUERIES)
    print(f"extremitypathfinder: {_STRAIGHT_QUERIES} lengths, worst difference {worst:.1e} m")
    return worst <= _MAX_LENGTH_ERROR


if __name__ == "__main__":
    raise SystemExit(main())
