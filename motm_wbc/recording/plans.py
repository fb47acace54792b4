"""What the base's method decided: candidates, goal, paths, and the braking arc."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import BaseReport
from motm_wbc.recording import colours
from motm_wbc.recording.encoders import Points, arrow_columns, strips
from motm_wbc.recording.timeline import TimeLine

ROOT = "/plan"
_HEIGHT = {"rejected": 0.012, "candidates": 0.02, "goal": 0.03}  # [m], above the floor's grid
_LENGTH = {"rejected": 0.06, "candidates": 0.14, "goal": 0.3}  # [m] of an arrow
_ASIDE = 0.025  # [m] from a candidate's place to the middle of its arrow
_LINES = {  # colour, radius [m], height [m]: the more binding, the higher
    "global_path": (colours.GLOBAL_PATH, 0.007, 0.016),
    "local_plan": (colours.LOCAL_PLAN, 0.014, 0.024),
    "braking": (colours.BRAKING, 0.012, 0.036),
}


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of one instant that are to be drawn as arrows.

    Attributes:
        poses: (n, 3) [m, m, rad].
        costs: (n,) [s].
        labels: n texts, or none: then the costs are the labels.
    """

    poses: Array
    costs: Array
    labels: Sequence[str] = ()


_NO_POSES = Poses(np.empty((0, 3)), np.empty(0))


class PlanLayer:
    """Draws a base report onto the floor."""

    def __init__(self, timeline: TimeLine, footprint: Array, lifetime: float) -> None:
        """Send the styles; `footprint` (n, 2) [m]; plans older than `lifetime` [s] vanish."""
        import rerun as rr

        self._outline = np.vstack([footprint, footprint[:1]])
        self._lifetime = lifetime
        self._last: BaseReport | None = None
        self._last_time = -np.inf
        self._arrows = {
            name: timeline.channel(f"{ROOT}/{name}", _encoder(name)) for name in _HEIGHT
        }
        self._lines = {name: timeline.channel(f"{ROOT}/{name}", strips) for name in _LINES}
        for name, radius in {"rejected": 0.006, "candidates": 0.011, "goal": 0.022}.items():
            timeline.static(
                f"{ROOT}/{name}",
                rr.Arrows3D.from_fields(radii=[radius], show_labels=False),
            )
        for name, (colour, radius, _) in _LINES.items():
            timeline.static(
                f"{ROOT}/{name}", rr.LineStrips3D.from_fields(colors=[colour], radii=[radius])
            )

    def add(self, time: float, report: BaseReport | None) -> None:
        """Stamp every entity at `time` [s], with the newest report or, if too old, with nothing.

        Args:
            time: instant of the frame [s].
            report: the report of this instant, or None if there is none.
        """
        if report is not None:
            self._last, self._last_time = report, time
        shown = self._last if time - self._last_time < self._lifetime else None
        for name, row in self._arrow_rows(shown).items():
            self._arrows[name].add(time, row)
        for name, lines in self._line_rows(shown).items():
            height = _LINES[name][2]
            self._lines[name].add(time, [_at_height(line, height) for line in lines])

    def _arrow_rows(self, report: BaseReport | None) -> dict[str, Poses]:
        if report is None:
            return dict.fromkeys(_HEIGHT, _NO_POSES)
        out = (report.rejections != 0) | ~np.isfinite(report.costs)
        reasons = [report.reasons[k] for k in report.rejections[out].astype(int).tolist()]
        goal = _NO_POSES
        if report.goal is not None:
            chosen = report.selected >= 0
            label = f"goal, {report.costs[report.selected]:.2f} s" if chosen else "goal"
            goal = Poses(report.goal[None, :].copy(), np.full(1, np.nan), [label])
        return {
            "rejected": Poses(report.candidates[out], np.full(len(reasons), np.nan), reasons),
            "candidates": Poses(report.candidates[~out], report.costs[~out]),
            "goal": goal,
        }

    def _line_rows(self, report: BaseReport | None) -> dict[str, list[Array]]:
        if report is None:
            return {name: [] for name in _LINES}
        stop = report.braking[-1:]
        return {
            "global_path": _drawable([report.global_path]),
            "local_plan": _drawable([report.local_plan[:, 1:3]]),
            "braking": _drawable(
                [report.braking[:, :2], *(polygons.place(self._outline, pose) for pose in stop)]
            ),
        }


def _encoder(name: str) -> Callable[[Sequence[Poses]], Any]:
    """What draws rows of poses as arrows; all rows of a batch at once, for speed."""

    def encode(rows: Sequence[Poses]) -> Any:
        counts = [len(row.poses) for row in rows]
        origins, vectors = _headings(name, np.concatenate([row.poses for row in rows]))
        costs = np.concatenate([row.costs for row in rows])
        if name == "candidates":
            colour = np.concatenate([colours.by_cost(row.costs) for row in rows])
        else:
            tint = colours.GOAL if name == "goal" else colours.REJECTED
            colour = np.full(len(costs), tint, dtype=np.uint32)
        labels = [reason for row in rows for reason in row.labels]
        return arrow_columns(
            origins, vectors, colour, labels or [f"{cost:.2f} s" for cost in costs.tolist()], counts
        )

    return encode


def _headings(name: str, poses: Array) -> tuple[Array, Array]:
    """Origins and vectors of arrows at the poses (n, 3), along their headings.

    They keep to the right, as traffic does: poses at one place with opposite headings would
    hide each other.
    """
    flat = np.zeros(len(poses))
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    vectors = np.column_stack([c, s, flat]) * _LENGTH[name]
    aside = np.column_stack([s, -c, flat]) * _ASIDE
    origins = np.column_stack([poses[:, :2], flat + _HEIGHT[name]]) + aside - 0.5 * vectors
    return origins, vectors


def _drawable(lines: list[Array]) -> list[Array]:
    return [line for line in lines if len(line) >= 2]


def _at_height(line: Array, height: float) -> Points:
    return np.column_stack([line, np.full(len(line), height)]).astype(np.float32)
