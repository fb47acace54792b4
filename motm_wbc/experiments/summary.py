"""From what was seen during a run to its figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from motm_wbc.audit import AuditResult
from motm_wbc.experiments.metrics import MotionTrace, limit_violation, spread_ms
from motm_wbc.experiments.result import RunSummary
from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event, GroundTruth, StepReport
from motm_wbc.mission.executive import Executive
from motm_wbc.scene.scenario import Scenario
from motm_wbc.simulation import SimulatedPlant

if TYPE_CHECKING:
    from motm_wbc.experiments.run import Setup

_PLACED = 0.05  # [m] from its place at which an object counts as placed
_UPRIGHT = 0.95  # cosine of the tilt at which it still stands


@dataclass(slots=True)
class RunLog:
    """What the loop keeps of each control step, for the figures.

    Attributes:
        truths: at the start of each control step.
        commands: (base, arm) sent in each.
        rungs: of the controller.
        base_steps: wall times [s].
        arm_steps: wall times [s].
        guards: searches that the clock ended.
        events: from the executive.
        failure_reason: why the run ended early, or None.
        wall_time: of the loop [s].
        placed: index of a release -> pose (4, 4) of its object once it had come to rest.
    """

    truths: list[GroundTruth] = field(default_factory=list)
    commands: list[tuple[Array, Array]] = field(default_factory=list)
    rungs: list[str] = field(default_factory=list)
    base_steps: list[float] = field(default_factory=list)
    arm_steps: list[float] = field(default_factory=list)
    guards: int = 0
    events: list[Event] = field(default_factory=list)
    failure_reason: str | None = None
    wall_time: float = 0.0
    placed: dict[int, Array] = field(default_factory=dict)

    def watch_releases(self, plant: SimulatedPlant, settle: float) -> None:
        """Keep where each released object stands `settle` [s] later."""
        for index, release in enumerate(plant.releases):
            if index not in self.placed and plant.time >= release.time + settle - 1e-9:
                self.placed[index] = plant.truth().objects[release.object].copy()

    def add(self, truth: GroundTruth, report: StepReport) -> None:
        """Keep one control step."""
        self.truths.append(truth)
        self.commands.append((report.command.base, report.command.arm))
        self.rungs.append(report.rung)
        self.arm_steps.append(report.compute_time)
        self.events.extend(report.events)
        if report.base is not None:
            self.base_steps.append(report.base.compute_time)
            self.guards += int(report.base.clock_guard_fired)


def summarise(
    setup: Setup, executive: Executive, plant: SimulatedPlant, audit: AuditResult, log: RunLog
) -> RunSummary:
    """The figures of a finished run."""
    error = _object_error(setup.scenario, log, plant)
    reason = log.failure_reason or _misplaced(setup.scenario, executive, plant, error)
    grasps = [event.time for event in plant.events if event.kind == "grasped"]
    grasp_time = min(grasps, default=None)
    simulated = plant.time
    return RunSummary(
        scenario=setup.scenario.name,
        robot=setup.model.name,
        method=setup.method,
        plant=setup.plant,
        failure_delay_s=setup.failure.delay,
        seed=setup.seed,
        success=reason is None,
        failure_reason=reason,
        task_time_s=_task_time(log.events) if reason is None else None,
        grasp_attempts=len(plant.attempts),
        first_attempt_time_s=_rounded(plant.attempts[0].time if plant.attempts else None),
        grasp_time_s=_rounded(grasp_time),
        base_speed_at_grasp_m_s=_speed_at(log.truths, grasp_time),
        object_error_at_drop_m=_rounded(error),
        base_path_length_m=round(_path_length(log.truths), 4),
        min_base_clearance_m=_rounded(audit.min_base_clearance_m),
        min_arm_clearance_m=_rounded(audit.min_arm_clearance_m),
        collisions=audit.collisions,
        limit_violation_max=limit_violation(setup.model, _commanded(log, setup.dt)),
        limit_violation_measured_max=limit_violation(setup.model, _measured(log, setup.dt)),
        goal_switches=executive.goal_switches,
        fallback_steps=sum(rung != "full" for rung in log.rungs),
        clock_guard_firings=log.guards,
        base_step_ms=spread_ms(np.array(log.base_steps)),
        arm_step_ms=spread_ms(np.array(log.arm_steps)),
        real_time_factor=round(simulated / max(log.wall_time, 1e-9), 3),
    )


def _misplaced(
    scenario: Scenario, executive: Executive, plant: SimulatedPlant, error: float | None
) -> str | None:
    """Why a run that came to its end has not done the task, or None."""
    if not executive.done:
        return "the task was not finished"
    if error is None:
        return "no object was placed"
    if error > _PLACED:
        return f"an object stands {error:.3f} m from its place"
    poses = plant.truth().objects
    for name in {step.object for step in scenario.task}:
        if poses[name][2, 2] < _UPRIGHT:
            return f"{name} has toppled"
    return None


def _task_time(events: Sequence[Event]) -> float | None:
    """When the fingers had opened over the last place [s]."""
    times = [event.time for event in events if event.kind == "dropped"]
    return _rounded(max(times)) if times else None


def _object_error(scenario: Scenario, log: RunLog, plant: SimulatedPlant) -> float | None:
    """Largest flat distance of a released object from where its step puts it [m]."""
    wanted: dict[str, list[tuple[float, float]]] = {}
    for step in scenario.task:
        if step.at is not None:
            wanted.setdefault(step.object, []).append(step.at)
    errors = []
    for index, pose in sorted(log.placed.items()):
        name = plant.releases[index].object
        before = sum(release.object == name for release in plant.releases[:index])
        places = wanted[name]
        errors.append(math.dist(pose[:2, 3], places[min(before, len(places) - 1)]))
    return max(errors, default=None)


def _speed_at(truths: Sequence[GroundTruth], time: float | None) -> float | None:
    """Forward speed of the base at a time [m/s]."""
    if time is None:
        return None
    nearest = min(truths, key=lambda truth: abs(truth.time - time))
    return _rounded(float(nearest.base_velocity[0]))


def _path_length(truths: Sequence[GroundTruth]) -> float:
    points = np.array([truth.base_pose[:2] for truth in truths])
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) > 1 else 0.0


def _commanded(log: RunLog, dt: float) -> MotionTrace:
    return MotionTrace(
        base=np.array([base for base, _ in log.commands]),
        arm=np.array([arm for _, arm in log.commands]),
        q=np.array([truth.q for truth in log.truths]),
        counted=np.array([rung == "full" for rung in log.rungs]),
        dt=dt,
    )


def _measured(log: RunLog, dt: float) -> MotionTrace:
    """The motion that was measured; a state shows what the command before it did."""
    before = ["full", *log.rungs[:-1]]
    return MotionTrace(
        base=np.array([truth.base_velocity for truth in log.truths]),
        arm=np.array([truth.v for truth in log.truths]),
        q=np.array([truth.q for truth in log.truths]),
        counted=np.array([rung == "full" for rung in before]),
        dt=dt,
    )


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, 6)
