"""One run of a scenario: plant, executive, audit and recorders in one loop."""

from __future__ import annotations

import json
import math
import platform
import time
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from motm_wbc.audit import Audit
from motm_wbc.basenav.placement import BasePlacement
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.experiments.checks import check_start, check_still, check_targets
from motm_wbc.experiments.parameters import Parameters
from motm_wbc.experiments.result import RunResult
from motm_wbc.experiments.summary import RunLog, summarise
from motm_wbc.interfaces import Event, StepReport
from motm_wbc.kinematics import RobotModel, load_robot
from motm_wbc.kinematics.urdf import BASE_JOINTS
from motm_wbc.mission.executive import Executive, ExecutiveParameters
from motm_wbc.mission.methods import MethodContext, new_method
from motm_wbc.mission.reachable import grip_height, hold_radius, reach_of_step
from motm_wbc.recording import Recorders, RrdRecorder, ScalarRecorder, TraceRecorder
from motm_wbc.recording.atomic import AtomicFile
from motm_wbc.scene.footprints import base_obstacles
from motm_wbc.scene.scenario import GraspFailure, Scenario
from motm_wbc.simulation import SimulatedPlant, default_plant, make_plant

_SETTLE = 1.0  # [s] after the release at which an object's error is taken
_FALLEN = 0.05  # [m] below the lowest support at which an object counts as lost
_VERSIONS = ("motm-wbc", "pin", "numpy", "osqp", "daqp", "pybullet", "python-fcl", "numba")

Progress = Callable[[StepReport], None]


@dataclass(frozen=True, slots=True)
class Setup:
    """A run, ready to start.

    Attributes:
        scenario: the world and the task.
        model: the robot.
        method: name of the method.
        plant: name of the plant.
        failure: which grasp attempts fail; only the plant gets to know.
        seed: 0 is the nominal run.
        parameters: all numbers.
    """

    scenario: Scenario
    model: RobotModel
    method: str
    plant: str
    failure: GraspFailure
    seed: int
    parameters: Parameters = field(repr=False)

    @property
    def dt(self) -> float:
        """Control step [s]."""
        return 1.0 / self.parameters.control_rate


def run(
    scenario: Scenario,
    *,
    robot: RobotModel | str | Path = "frankie",
    method: str = "proposed",
    failure_delay: float | None = None,
    plant: str | None = None,
    seed: int = 0,
    parameters: Parameters | None = None,
    record: str | Path | None = None,
    trace: str | Path | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Run a scenario once.

    Args:
        scenario: the world and the task.
        robot: a loaded robot, its name, or the path of its file.
        method: how the base is led.
        failure_delay: every grasp attempt that starts less than this after the first one
            fails [s]; None: as the scenario says.
        plant: `bullet` or `kinematic`; None: bullet where pybullet can be imported.
        seed: of noise and random failures; 0 is the nominal run.
        parameters: None: the defaults.
        record: write a rerun recording to this file.
        trace: write the trace to this Parquet file.
        progress: called after each control step.

    Returns:
        The figures, the trace and the events.

    Raises:
        InputError: something given can't be used; the run has not started.
    """
    setup = Setup(
        scenario,
        robot if isinstance(robot, RobotModel) else load_robot(robot),
        method,
        plant or default_plant(),
        _failure(scenario, failure_delay),
        seed,
        parameters or Parameters(),
    )
    return run_setup(setup, record=record, trace=trace, progress=progress)


def run_setup(
    setup: Setup,
    *,
    record: str | Path | None = None,
    trace: str | Path | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Run what has been set up; see `run`."""
    executive = make_executive(setup)
    audit = Audit(setup.model, setup.scenario)
    inputs = setup.model.base_kind.inputs
    table = TraceRecorder(setup.model.arm_joints, inputs, _metadata(setup))
    if trace is not None:
        AtomicFile(Path(trace)).discard()  # what can't be written is said before the run
    recorders: list[ScalarRecorder] = [table]
    if record is not None:
        recorders.append(open_recording(setup, Path(record)))
    log = RunLog()
    with closing(Recorders(recorders)) as recorder, closing(_plant(setup)) as plant:
        started = time.perf_counter()
        _loop(setup, executive, plant, audit, recorder, log, progress)
        log.wall_time = time.perf_counter() - started
        _pass_on(plant.events, recorder)
    found = audit.result()
    if trace is not None:
        table.write_parquet(Path(trace))
    return RunResult(
        summarise(setup, executive, plant, found, log),
        table.table(),
        tuple(sorted((*log.events, *plant.events), key=lambda event: event.time)),
        tuple(str(episode) for episode in found.episodes),
        _configuration(setup),
    )


def make_executive(setup: Setup) -> Executive:
    """The controller of a run, after all checks that need no run.

    Raises:
        InputError: the task can't be done from what was given.
    """
    p, model = setup.parameters, setup.model
    check_start(setup.scenario, model)
    check_still(setup.scenario)
    reach = model.description.reach
    radius = hold_radius(model, setup.scenario, p.grasp)
    if radius <= 0.0:
        raise InputError(_out_of_arms_reach(setup), setup.scenario.name)
    region = ReachRegion(model.arm_base_xy, radius, reach.bearing_limit)
    boundary = setup.scenario.boundary
    world = World(
        list(base_obstacles(setup.scenario).values()),
        None if boundary is None else np.array(boundary),
    )
    check_targets(
        setup.scenario,
        BasePlacement(world, model.footprint, model.base_limits, p.placement),
        region,
    )
    context = MethodContext(
        world,
        model.footprint,
        model.base_limits,
        region,
        p.mission.base_rate_divider * setup.dt,
        p.placement,
        _matched(p.staa, p.mission.base_rate_divider, setup.dt),
    )
    return Executive(
        setup.scenario.model_copy(update={"grasp_failure": GraspFailure()}),
        model,
        new_method(setup.method, context),
        ExecutiveParameters(p.mission, p.reach, p.grasp, p.whole_body, p.solver),
        setup.dt,
    )


def _out_of_arms_reach(setup: Setup) -> str:
    """Which target the arm can't work at from any distance."""
    model, scenario = setup.model, setup.scenario
    for index, step in enumerate(scenario.task):
        if reach_of_step(model, scenario, index, setup.parameters.grasp) <= 0.0:
            height = grip_height(scenario, index)
            return (
                f"task[{index}]: the grip on {step.object!r} would be {height:.2f} m over the "
                "floor, too high or too low for the arm with its tool straight down"
            )
    return "the robot's hold_radius leaves no room to wait in"


def _matched(staa: StaaParameters, divider: int, dt: float) -> StaaParameters:
    """The local planner's parameters with the rates at which its commands are carried out."""
    period = divider * dt
    changed = {"command_period": period, "ramp_steps": divider}
    if period > staa.step:
        raise InputError(
            f"a base step of {period:g} s is longer than staa.step, {staa.step:g} s",
            "mission.base_rate_divider",
        )
    return staa.model_copy(update=changed)


def open_recording(setup: Setup, path: Path) -> RrdRecorder:
    """A recorder for a run.

    Raises:
        InputError: the file can't be written.
    """
    model = setup.model
    return RrdRecorder(
        path,
        scenario=setup.scenario,
        urdf_path=model.urdf_path,
        base_joints=BASE_JOINTS,
        arm_joints=model.arm_joints,
        finger_joints=model.finger_joints,
        base_kind=model.base_kind,
        base_limits=model.base_limits,
        footprint=model.footprint,
        q_lower=model.q_lower,
        q_upper=model.q_upper,
        v_limits=model.v_max,
        ring_radius=setup.parameters.placement.radius,
        reach_radius=model.description.reach.grasp_range,
        title=f"{setup.scenario.name}, {setup.method}, failure delay {setup.failure.delay:g} s",
    )


def _plant(setup: Setup) -> SimulatedPlant:
    return make_plant(
        setup.plant,
        setup.scenario,
        setup.model,
        control_period=setup.dt,
        seed=setup.seed,
        parameters=setup.parameters.physics,
        failure=setup.failure,
    )


def _loop(
    setup: Setup,
    executive: Executive,
    plant: SimulatedPlant,
    audit: Audit,
    recorder: Recorders,
    log: RunLog,
    progress: Progress | None,
) -> None:
    """Step until the task is done and the last object is at rest, or the run has failed."""
    while log.failure_reason is None and not _settled(executive, plant):
        truth = plant.truth()
        report = executive.step(*plant.sense())
        log.add(truth, report)
        recorder.step(truth, report)
        plant.step(report.command, audit.observe)
        clear = audit.clearances()
        recorder.scalars(truth.time, {"base": clear.base, "arm": clear.arm})
        log.watch_releases(plant, _SETTLE)
        log.failure_reason = _failure_reason(setup, executive, plant)
        if progress is not None:
            progress(report)


def _pass_on(events: Iterable[Event], recorder: Recorders) -> None:
    """Events of the plant, which a recorder is told once the run is over."""
    for event in events:
        recorder.event(event)


def _settled(executive: Executive, plant: SimulatedPlant) -> bool:
    if not executive.done:
        return False
    last = plant.releases[-1].time if plant.releases else plant.time
    return plant.time >= last + _SETTLE


def _failure_reason(setup: Setup, executive: Executive, plant: SimulatedPlant) -> str | None:
    truth = plant.truth()
    if truth.time > setup.scenario.time_limit and not executive.done:
        done, count = executive.steps_done, len(setup.scenario.task)
        return (
            f"the task was not done within {setup.scenario.time_limit:g} s: "
            f"step {done + 1} of {count} was at {executive.stage!r}"
        )
    lowest = min(support.top for support in setup.scenario.supports)
    for name, T_world_object in truth.objects.items():
        if name != truth.held and T_world_object[2, 3] < lowest - _FALLEN:
            return f"{name} fell down"
    return None


def _failure(scenario: Scenario, delay: float | None) -> GraspFailure:
    if delay is None:
        return scenario.grasp_failure
    if not (math.isfinite(delay) and 0.0 <= delay <= 600.0):
        raise InputError(f"{delay} is no delay; legal: 0 to 600 s", "failure delay")
    return scenario.grasp_failure.model_copy(update={"delay": float(delay)})


def _metadata(setup: Setup) -> dict[str, str]:
    """What a trace carries so that its run can be repeated."""
    return {"configuration": json.dumps(_configuration(setup))}


def _configuration(setup: Setup) -> dict[str, Any]:
    return {
        "scenario": setup.scenario.model_dump(mode="json"),
        "robot": setup.model.description.model_dump(mode="json"),
        "method": setup.method,
        "plant": setup.plant,
        "failure": setup.failure.model_dump(mode="json"),
        "seed": setup.seed,
        "parameters": setup.parameters.model_dump(mode="json"),
        "versions": {"python": platform.python_version(), **_versions()},
    }


def _versions() -> dict[str, str]:
    found = {}
    for name in _VERSIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
