"""A drive handed to its recorder, as plain data."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from motm_wbc.basenav.navigator import NavStatus
from motm_wbc.basenav.obstacle import Solid
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.experiments.nav.drive import Moment
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.interfaces import BaseReport, Event
from motm_wbc.recording.drive import DriveRecorder, Prism

_NOTHING = np.empty((0, 3))


class DriveTelling:
    """Watches a drive and tells the recorder of it."""

    def __init__(
        self,
        path: Path,
        world: World,
        footprint: Array,
        limits: BaseLimits,
        start: Array,
        goal: Array,
        inflation: float,
    ) -> None:
        """Open the recording; see `drive` for the arguments.

        Raises:
            InputError: the file can't be written.
        """
        self._velocities = np.array([s.velocity for s in world.solids if s.moves]).reshape(-1, 2)
        self._goal = goal
        self._status: NavStatus | None = None
        self._planner = GlobalPlanner(
            world.still(), limits.v_max, limits.omega_max, inflation, limits.v_reverse
        )
        self._recorder = DriveRecorder(
            path,
            still=[_prism(solid) for solid in world.solids if not solid.moves],
            moving=[_prism(solid) for solid in world.solids if solid.moves],
            boundary=world.boundary,
            footprint=footprint,
            limits=limits,
            start=start,
            goal=goal,
            title=f"nav to ({goal[0]:g}, {goal[1]:g})",
        )

    def see(self, moment: Moment) -> None:
        """Record a base step."""
        path = self._planner.route(moment.state[:3], self._goal)
        plan, step = moment.step.plan, moment.step
        report = BaseReport(
            goal=self._goal,
            candidates=_NOTHING,
            costs=np.empty(0),
            rejections=np.empty(0, dtype=np.int64),
            reasons=("",),
            selected=-1,
            global_path=np.empty((0, 2)) if path is None else path.points,
            local_plan=plan.poses,
            braking=plan.braking,
            compute_time=moment.compute_time,
            emergency=plan.emergency,
        )
        curves = {"clearance": moment.clearance, "compute_time": moment.compute_time}
        shifts = moment.time * self._velocities
        self._recorder.step(moment.time, moment.state, shifts, report, curves)
        if step.status is not self._status:
            self._status = step.status
            text = step.message or step.status.value
            level = "info" if step.status in (NavStatus.DRIVING, NavStatus.REACHED) else "warn"
            self._recorder.event(Event(moment.time, step.status.value, text, level))

    def close(self, result: DriveResult | None) -> None:
        """End the recording; without a result, because of an error."""
        if result is not None:
            time = float(result.trajectory[-1, 0])
            text = result.failure_reason or f"goal reached after {time:.2f} s"
            self._recorder.event(Event(time, "end", text, "info" if result.success else "error"))
        self._recorder.close()


def _prism(solid: Solid) -> Prism:
    return Prism(solid.outline, solid.holes)
