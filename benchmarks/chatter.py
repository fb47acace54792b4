"""How often the base's goal changes in a run, with and without each option of the placement.

    python -m benchmarks.chatter [--delays 0,3,6] [--plant kinematic] [--processes 2]

Every scene of the paper is run with all options as they are by default, with each one switched
off, with the placement in its literal form, and with everything literal. A change of the goal
is no harm by itself: while an attempt fails, it slides along the ring. *Returns* are: goals
taken again after they had been left.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from statistics import mean

from rich.console import Console
from rich.table import Table

from motm_wbc import load_robot, load_scenario, run
from motm_wbc.experiments.parameters import make_parameters

SCENES = ("line", "turn", "obstructed_turn")
_LITERAL = (
    "placement.hysteresis=0",
    "placement.tie_slack=0",
    "placement.price_wait=false",
    "placement.stop_here=false",
    "placement.next_ring=false",
)
VARIANTS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "as by default": ("ours", ()),
    "no hysteresis": ("ours", ("placement.hysteresis=0",)),
    "no ties toward the next target": ("ours", ("placement.tie_slack=0",)),
    "neither": ("ours", ("placement.hysteresis=0", "placement.tie_slack=0")),
    "the wait not priced": ("ours", ("placement.price_wait=false",)),
    "no stop here": ("ours", ("placement.stop_here=false",)),
    "next target, not its ring": ("ours", ("placement.next_ring=false",)),
    "placement literal": ("ours", _LITERAL),
    "all literal": ("paper", ()),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """One run.

    Attributes:
        variant: key of `VARIANTS`.
        scene: name.
        delay: until which grasps fail [s].
        task_time: [s], None if the task failed.
        switches: changes of the goal after the first.
        returns: changes to a goal that had been left before.
    """

    variant: str
    scene: str
    delay: float
    task_time: float | None
    switches: int
    returns: int


def run_once(variant: str, scene: str, delay: float, plant: str) -> Outcome:
    """Run a scene with a variant of the placement."""
    preset, settings = VARIANTS[variant]
    result = run(
        load_scenario(scene),
        robot=load_robot("frankie"),
        failure_delay=delay,
        plant=plant,
        parameters=make_parameters(preset, settings),
    )
    goals = [event.text for event in result.events if event.kind == "goal"]
    summary = result.summary
    return Outcome(
        variant, scene, delay, summary.task_time_s, summary.goal_switches, _returns(goals)
    )


def _returns(goals: Sequence[str]) -> int:
    """Goals that had been taken before."""
    return len(goals) - len(set(goals))


def run_all(delays: Sequence[float], plant: str, processes: int) -> Iterator[Outcome]:
    """All runs, in the order of the table."""
    with ProcessPoolExecutor(processes) as pool:
        jobs = [
            pool.submit(run_once, variant, scene, delay, plant)
            for variant, scene, delay in product(VARIANTS, SCENES, delays)
        ]
        for job in jobs:
            yield job.result()


def table(outcomes: Sequence[Outcome]) -> Table:
    """Means over the delays: switches, returns, and task time, for each scene."""
    shown = Table("placement", *(f"{scene}: switches / returns / time [s]" for scene in SCENES))
    for variant in VARIANTS:
        cells = []
        for scene in SCENES:
            runs = [one for one in outcomes if (one.variant, one.scene) == (variant, scene)]
            times = [one.task_time for one in runs if one.task_time is not None]
            failed = len(runs) - len(times)
            time = f"{mean(times):.2f}" if times else "-"
            cells.append(
                f"{mean(one.switches for one in runs):.1f} / "
                f"{mean(one.returns for one in runs):.1f} / {time}"
                + (f" ({failed} of {len(runs)} failed)" if failed else "")
            )
        shown.add_row(variant, *cells)
    return shown


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Changes of the base's goal in a run.")
    parser.add_argument("--delays", default="0,3,6", help="failure delays [s]")
    parser.add_argument("--plant", default="kinematic")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    delays = [float(part) for part in arguments.delays.split(",")]
    outcomes = []
    for outcome in run_all(delays, arguments.plant, arguments.processes):
        print(outcome, flush=True)
        outcomes.append(outcome)
    Console(width=160).print(table(outcomes))


if __name__ == "__main__":
    main()
