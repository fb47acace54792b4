"""Random reaches in cluttered scenes, with the whole-body controller alone.

    python -m benchmarks.reaches [--scenes 200] [--first 2000] [--targets 10] [--free-base]
        [--found-posture] [--posture-weight 1.0] [--processes 2] [--log out/reaches.jsonl]

Each scene has tables, shelves, pillars and things on them about the robot. A target counts if
inverse kinematics from many random starts finds a posture there that keeps every pair's safe
distance, and if the hand keeps them along the straight way from the start. The tool is told
to go straight; nothing plans. What the controller did is judged by others: distances of the
capsules by coal, contact of the meshes' hulls by python-fcl.

A run that was interrupted goes on where it stopped if it is given the same log; one log is of
one variant, weight and number of targets.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from benchmarks import log
from benchmarks.reaching.contact import ContactCheck
from benchmarks.reaching.distances import ExactDistances
from benchmarks.reaching.follow import followed_share
from benchmarks.reaching.reach import Outcome, Variant, judge, move
from benchmarks.reaching.scenes import make_scene
from benchmarks.reaching.table import table
from benchmarks.reaching.targets import find_target
from motm_wbc import load_robot
from motm_wbc.kinematics import RobotModel
from motm_wbc.qp import WholeBodyController, WholeBodyParameters

_DT = 1.0 / 120.0


def reaches_of_scene(
    seed: int, targets: int, variant: Variant, posture_weight: float = 1.0
) -> list[Outcome]:
    """All reaches of one scene; fewer than `targets` where a draw finds none that counts."""
    model = _robot()
    scene = make_scene(model, seed)
    distances = ExactDistances(model, scene.bodies)
    contact = ContactCheck(model, scene.bodies)
    parameters = WholeBodyParameters(posture_weight=posture_weight)
    controller = WholeBodyController(model, _DT, parameters)
    outcomes = []
    for index in range(targets):
        target = find_target(model, scene, distances, index)
        if target is None:
            continue
        motion, path = move(controller, scene, target, variant)
        outcome = judge(controller, target, scene, motion, path, (distances, contact))
        if not outcome.reached and not variant.base_free:
            share = followed_share(model, scene, distances, target)
            outcome = replace(outcome, followed_share=share)
        outcomes.append(outcome)
    return outcomes


def run(
    seeds: Sequence[int],
    targets: int,
    variant: Variant,
    processes: int,
    posture_weight: float = 1.0,
) -> Iterator[list[Outcome]]:
    """The outcomes of each scene as they come, in no order."""
    with ProcessPoolExecutor(processes) as pool:
        jobs = [
            pool.submit(reaches_of_scene, seed, targets, variant, posture_weight) for seed in seeds
        ]
        for job in as_completed(jobs):
            yield job.result()


@functools.cache
def _robot() -> RobotModel:
    return load_robot("frankie")


def main() -> None:
    """Run what the log does not have yet, and print the table of all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--first", type=int, default=2000, help="seed of the first scene")
    parser.add_argument("--targets", type=int, default=10, help="of each scene")
    parser.add_argument("--free-base", action="store_true", help="the base's inputs are free")
    parser.add_argument(
        "--found-posture", action="store_true", help="prefer the posture that was found"
    )
    parser.add_argument("--posture-weight", type=float, default=1.0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--log", type=Path, help="default: named by the variant, in out/")
    words = parser.parse_args()
    variant = Variant(words.free_base, words.found_posture)
    path = words.log or Path(
        f"out/reaches-{'free' if variant.base_free else 'still'}"
        f"-{'found' if variant.posture_found else 'own'}.jsonl"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    outcomes = log.read(path, Outcome)
    done = {outcome.scene for outcome in outcomes}
    seeds = range(words.first, words.first + words.scenes)
    open_seeds = [seed for seed in seeds if seed not in done]
    for of_scene in run(open_seeds, words.targets, variant, words.processes, words.posture_weight):
        log.append(path, of_scene)
        outcomes += of_scene
        reached = sum(outcome.reached for outcome in outcomes)
        print(f"{len(outcomes)} reaches, {reached} reached", end="\r", flush=True)
    print()
    print(table([outcome for outcome in outcomes if outcome.scene in seeds]))


if __name__ == "__main__":
    main()
