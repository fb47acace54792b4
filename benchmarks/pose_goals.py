"""Random pose goals on random floors: is every one reached that can be, without contact?

    python -m benchmarks.pose_goals [--floors 200] [--first 1000] [--goals 10] [--moving]
        [--planner staa] [--processes 2] [--log out/pose_goals.jsonl]

Seven kinds of floors, 8 to 12 m wide, with 1 to 40 obstacles: convex, concave, overlapping,
doors, U-traps, corridors, furniture. The first goal of each floor is nose to a table, to be
left again for another; the rest are poses anywhere, to be driven through and to stop at in
turn. A goal counts if a brute-force search over (x, y, heading) with the true footprint gets
there. With `--moving`, one goal a floor, among 1 to 8 obstacles that move at up to 0.5 m/s.

Times are set against PathRTR + v/a: the global path's time for the disc that the navigator
plans for (of the inner radius where only that passes), and one second to speed up and stop.

A run that was interrupted goes on where it stopped if it is given the same log; one log is of
one planner and number of goals.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from benchmarks import log
from benchmarks.navigating.drives import moving_drives, still_drives
from benchmarks.navigating.outcome import Outcome, table


def run(
    seeds: Sequence[int], goals: int, *, moving: bool, planner: str, processes: int
) -> Iterator[list[Outcome]]:
    """The outcomes of each floor as they come, in no order.

    Args:
        seeds: of the floors.
        goals: tasks on each, if nothing moves.
        moving: one task on each, with obstacles that move.
        planner: name of the local planner.
        processes: how many at once.
    """
    with ProcessPoolExecutor(processes) as pool:
        jobs = [
            pool.submit(moving_drives, seed, planner)
            if moving
            else pool.submit(still_drives, seed, goals, planner)
            for seed in seeds
        ]
        for job in as_completed(jobs):
            yield job.result()


def main() -> None:
    """Run what the log does not have yet, and print the table of all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--floors", type=int, default=200)
    parser.add_argument("--first", type=int, default=1000, help="seed of the first floor")
    parser.add_argument("--goals", type=int, default=10, help="on each floor")
    parser.add_argument("--moving", action="store_true", help="among obstacles that move")
    parser.add_argument("--planner", default="staa")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--log", type=Path, help="default: named by what is run, in out/")
    words = parser.parse_args()
    name = f"pose_goals-{words.planner}{'-moving' if words.moving else ''}.jsonl"
    path = words.log or Path("out") / name
    path.parent.mkdir(parents=True, exist_ok=True)
    outcomes = log.read(path, Outcome)
    done = {outcome.scene for outcome in outcomes}
    seeds = range(words.first, words.first + words.floors)
    open_seeds = [seed for seed in seeds if seed not in done]
    for of_floor in run(
        open_seeds,
        words.goals,
        moving=words.moving,
        planner=words.planner,
        processes=words.processes,
    ):
        log.append(path, of_floor)
        outcomes += of_floor
        reached = sum(outcome.reached for outcome in outcomes)
        print(f"{len(outcomes)} drives, {reached} reached", end="\r", flush=True)
    print()
    print(table([outcome for outcome in outcomes if outcome.scene in seeds]))


if __name__ == "__main__":
    main()
