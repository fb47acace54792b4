"""Who takes part, and how each is started."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from motm_wbc.experiments.bench.ours import FREE, NAVIGATED

PEERS = ("roboplan", "pink", "mink")


@dataclass(frozen=True, slots=True)
class Entrant:
    """A contestant.

    Attributes:
        name: of the library, with ours the solver (and the mode).
        ours: it is our controller, whose figures carry the robot's name.
        command: starts it, when the problem's file is put behind `before`.
    """

    name: str
    ours: bool
    before: tuple[str, ...]
    after: tuple[str, ...] = ()

    def command(self, problem: Path) -> Sequence[str]:
        """What starts it on a problem's file."""
        return [*self.before, str(problem), *self.after]


_OURS = (sys.executable, "-m", "motm_wbc.experiments.bench.ours")
OURS = (
    Entrant("daqp", True, _OURS, ("daqp", FREE)),
    Entrant("osqp", True, _OURS, ("osqp", FREE)),
    Entrant("daqp_navigated", True, _OURS, ("daqp", NAVIGATED)),
)


def find_peers(folder: Path) -> tuple[list[Entrant], dict[str, str]]:
    """The other libraries that are installed, and the reasons why the rest is not.

    Args:
        folder: holds an environment for each; their scripts lie in `benchmarks/peers` beside it.
    """
    found, missing = [], {}
    scripts = folder.resolve().parent / "benchmarks" / "peers"
    for name in PEERS:
        python, script = folder.resolve() / name / "bin" / "python", scripts / f"worker_{name}.py"
        lacking = next((path for path in (python, script) if not path.exists()), None)
        if lacking is None:
            found.append(Entrant(name, False, (str(python), str(script))))
        else:
            missing[name] = f"not found: {lacking}"
    return found, missing
