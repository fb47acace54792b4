"""One control step of the whole-body controller, beside roboplan, pink and mink."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from motm_wbc.experiments.bench.contestants import OURS, PEERS, Entrant, find_peers
from motm_wbc.experiments.bench.figures import Figures, figures, tool_error
from motm_wbc.experiments.bench.problems import PROBLEMS, Entry
from motm_wbc.experiments.bench.shared.motm_bench import Problem
from motm_wbc.experiments.bench.worker import Worker, WorkerError
from motm_wbc.kinematics import load_robot

STATES = 400
ROUNDS = 10


@dataclass(frozen=True, slots=True)
class BenchResult:
    """What a benchmark came to.

    Attributes:
        figures: by name: `<robot>_<solver>[_<problem>]_us` for ours,
            `<library>[_<problem>]_us` for others; None where there was none to time.
        missing: who or what was left out, and why.
        titles: what each name is, for people.
    """

    figures: dict[str, Figures | None] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    titles: dict[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON: the figures, and under `peers` why some are null."""
        return {**self.figures, "peers": self.missing}


def bench_wholebody(
    peers: Path,
    *,
    states: int = STATES,
    rounds: int = ROUNDS,
    problems: Sequence[Entry] = PROBLEMS,
    progress: Callable[[str], None] = lambda _: None,
) -> BenchResult:
    """Time all contestants on all problems.

    All contestants of a problem are alive at once and take turns, round by round, so that
    what else the machine does meets all alike.

    Args:
        peers: folder with an environment for each library; what it lacks is left out.
        states: of each problem.
        rounds: each is one pass over a problem's states.
        problems: to run.
        progress: is told what is done next.

    Raises:
        WorkerError: our own controller ended early.
    """
    found, missing = find_peers(peers)
    result = BenchResult(missing=dict(missing))
    for entry in problems:
        names = {
            **{entrant.name: _key(entry, entrant.name, ours=True) for entrant in OURS},
            **{name: _key(entry, name, ours=False) for name in PEERS},
        }
        result.figures.update(dict.fromkeys(names.values()))
        result.titles.update(dict.fromkeys(names.values(), entry.title))
        progress(f"recording: {entry.title}")
        problem = entry.make(states, peers)
        if problem is None:
            result.missing[entry.key] = "its robot's model comes with roboplan"
            continue
        progress(f"timing: {entry.title}")
        timed, failures = _compete(problem, (*OURS, *found), rounds)
        result.figures.update({names[name]: one for name, one in timed.items()})
        for name, reason in failures.items():
            result.missing[f"{name}, {problem.name}"] = reason
    return result


def _key(entry: Entry, name: str, *, ours: bool) -> str:
    parts = [entry.robot, name] if ours else [name]
    if entry.key and entry.key not in parts:
        parts.append(entry.key)
    return "_".join([*parts, "us"])


def _compete(
    problem: Problem, entrants: Sequence[Entrant], rounds: int
) -> tuple[dict[str, Figures], dict[str, str]]:
    """Figures by contestant, and why others have none."""
    failures: dict[str, str] = {}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="motm-bench-")))
        file = folder / "problem.npz"
        problem.save(file)
        workers = {}
        for entrant in entrants:
            try:
                command = entrant.command(file)
                worker = Worker(entrant.name, command, foreign=not entrant.ours)
            except WorkerError as error:
                if entrant.ours:
                    raise
                failures[entrant.name] = str(error)
            else:
                workers[entrant.name] = stack.enter_context(worker)
        answers = {name: worker.answers() for name, worker in workers.items()}
        times = [{name: worker.round() for name, worker in workers.items()} for _ in range(rounds)]
        model = load_robot(problem.robot)
        timed = {
            name: figures(
                [one[name] for one in times],
                dict(worker.about),
                tool_error(model, problem, answers[name]),
            )
            for name, worker in workers.items()
        }
    return timed, failures
