"""The command line `motm`.

Exit status: 0 task done, 1 task failed, 2 bad input (one line on stderr), 130 interrupted.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from motm_wbc._version import __version__
from motm_wbc.errors import InputError, MotmError, UnknownName

if TYPE_CHECKING:
    from collections.abc import Iterator

    from motm_wbc.experiments.nav.result import DriveResult
    from motm_wbc.experiments.result import RunResult
    from motm_wbc.interfaces import StepReport

# Typer brings its own copy of click in some versions; the base of its errors is public.
_USAGE_ERROR: Any = typer.BadParameter.__mro__[2]
OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    add_completion=False,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Mobile manipulation on the move, with failure recovery.",
)


def main() -> None:
    """Entry point: turns errors into one line and an exit status."""
    sys.exit(_status(lambda: app(standalone_mode=False)))


def _status(call: Callable[[], Any]) -> int:
    try:
        status = call()
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except _USAGE_ERROR as error:
        return _say(error.format_message(), BAD_INPUT)
    except MotmError as error:
        return _say(str(error), BAD_INPUT)
    except OSError as error:
        return _say(f"can't write the output: {error}", BAD_INPUT)
    if status == INTERRUPTED:  # typer's own answer to Ctrl-C
        return _say("interrupted", INTERRUPTED)
    return status if isinstance(status, int) else OK


def _say(message: str, status: int) -> int:
    line = " ".join(message.split())
    print(f"motm: {line}", file=sys.stderr)
    return status


def _version(wanted: bool) -> None:
    if wanted:
        print(f"motm {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Mobile manipulation on the move, with failure recovery."""
    if context.invoked_subcommand is None:
        print(context.get_help())
        raise typer.Exit(BAD_INPUT)


@app.command("run")
def run_command(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario, or a TOML file.")],
    robot: Annotated[str, typer.Option(help="Name of a shipped robot, or its folder.")] = "frankie",
    method: Annotated[str, typer.Option(help="How the base is led.")] = "proposed",
    failure_delay: Annotated[
        float | None,
        typer.Option(
            help="Grasps fail for this long after the first attempt [s]; default: as the "
            "scenario says, 0 in the shipped ones."
        ),
    ] = None,
    plant: Annotated[
        str | None, typer.Option(help="bullet or kinematic; default: bullet where it can run.")
    ] = None,
    seed: Annotated[int, typer.Option(help="0: the nominal run, without noise.")] = 0,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set a parameter.")
    ] = None,
    preset: Annotated[str, typer.Option(help="ours, or paper for its literal form.")] = "ours",
    record: Annotated[Path | None, typer.Option(help="Write a rerun recording (.rrd).")] = None,
    trace: Annotated[Path | None, typer.Option(help="Write the trace (.parquet).")] = None,
    view: Annotated[bool, typer.Option("--view", help="Open the viewer after the run.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> int:
    """Run a scenario once and print what came of it."""
    from motm_wbc.experiments.parameters import make_parameters
    from motm_wbc.experiments.run import run
    from motm_wbc.scene.scenario import load_scenario

    viewer = _viewer() if view else None
    if view and record is None:
        record = Path(tempfile.mkdtemp(prefix="motm-")) / "run.rrd"
    world = load_scenario(scenario)
    parameters = make_parameters(preset, settings or ())
    quiet = as_json or not sys.stderr.isatty()
    with _progress(quiet, world.time_limit) as progress:
        result = run(
            world,
            robot=robot,
            method=method,
            failure_delay=failure_delay,
            plant=plant,
            seed=seed,
            parameters=parameters,
            record=record,
            trace=trace,
            progress=progress,
        )
    if as_json:
        print(json.dumps(result.summary.as_dict()))
    else:
        _print_result(result, record)
    if viewer is not None:
        subprocess.Popen([viewer, str(record)])
    return OK if result.summary.success else FAILED


@app.command("nav")
def nav_command(
    map_file: Annotated[
        Path,
        typer.Argument(metavar="MAP", help="GeoJSON in metres, or the .yaml of a ROS map."),
    ],
    start: Annotated[str, typer.Option(metavar="X,Y,HEADING", help="[m], [m], [rad]")],
    goal: Annotated[
        str, typer.Option(metavar="X,Y[,HEADING]", help="Without a heading it is free.")
    ],
    robot: Annotated[str, typer.Option(help="Whose base it is: name or folder.")] = "frankie",
    footprint: Annotated[
        str | None,
        typer.Option(metavar="LENGTH,WIDTH", help="A rectangle about the base's origin [m]."),
    ] = None,
    v_max: Annotated[float | None, typer.Option(help="Speed [m/s].")] = None,
    v_reverse: Annotated[
        float | None, typer.Option(help="Speed in reverse [m/s]; 0: never.")
    ] = None,
    omega_max: Annotated[float | None, typer.Option(help="Turn rate [rad/s].")] = None,
    a_max: Annotated[float | None, typer.Option(help="Acceleration [m/s^2].")] = None,
    alpha_max: Annotated[float | None, typer.Option(help="Of turning [rad/s^2].")] = None,
    stop: Annotated[
        bool, typer.Option("--stop", help="Come to rest at the goal; else drive through it.")
    ] = False,
    planner: Annotated[str, typer.Option(help="Local planner: staa or teb.")] = "staa",
    unknown: Annotated[
        str, typer.Option(help="What unknown cells of a ROS map are: blocked or free.")
    ] = "blocked",
    seed: Annotated[
        int, typer.Option(help="0: exact poses; else of the noise on them, 5 mm and 5 mrad.")
    ] = 0,
    time_limit: Annotated[
        float | None, typer.Option(help="[s]; default: four times the least time, and 20 s.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set a parameter.")
    ] = None,
    record: Annotated[Path | None, typer.Option(help="Write a rerun recording (.rrd).")] = None,
    draw: Annotated[Path | None, typer.Option(help="Write a picture (.png, .svg, .pdf).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> int:
    """Drive a base through a map, without an arm."""
    from motm_wbc.experiments.nav.command import NavRequest, navigate

    limits = {
        "v_max": v_max,
        "v_reverse": v_reverse,
        "omega_max": omega_max,
        "a_max": a_max,
        "alpha_max": alpha_max,
    }
    result = navigate(
        NavRequest(
            map_file,
            start,
            goal,
            robot,
            footprint,
            tuple(limits.items()),
            stop,
            planner,
            unknown,
            seed,
            time_limit,
            settings or (),
            record,
            draw,
        )
    )
    if as_json:
        print(json.dumps(result.as_dict()))
    else:
        _print_drive(result, record)
    return OK if result.success else FAILED


@app.command("robots")
def robots_command() -> int:
    """List the shipped robots."""
    from motm_wbc.kinematics import load_description
    from motm_wbc.scene.finder import robot_names

    table = _listing("robot", "what it is", "licence of its model")
    for name in robot_names():
        description = load_description(name)
        table.add_row(name, description.description, description.license)
    Console().print(table)
    return OK


@app.command("scenarios")
def scenarios_command() -> int:
    """List the shipped scenarios."""
    from motm_wbc.scene.finder import scenario_names
    from motm_wbc.scene.scenario import load_scenario

    table = _listing("scenario", "what it is", "steps")
    for name in scenario_names():
        scenario = load_scenario(name)
        table.add_row(name, scenario.description, str(len(scenario.task)))
    Console().print(table)
    return OK


@app.command("check")
def check_command(
    file: Annotated[str, typer.Argument(help="A robot or scenario: name, file or folder.")],
    robot: Annotated[str, typer.Option(help="Robot that a scenario is checked with.")] = "frankie",
) -> int:
    """Read a robot or a scenario, build all of it, and print its card."""
    from motm_wbc.experiments.cards import card

    title, rows = card(file, robot)
    table = _listing(title, "")
    for key, value in rows:
        table.add_row(key, value)
    Console().print(table)
    return OK


@app.command("bench")
def bench_command(
    what: Annotated[
        str,
        typer.Argument(
            help="wholebody: a step of the whole-body controller; basenav: base navigation."
        ),
    ] = "wholebody",
    peers: Annotated[
        Path, typer.Option(help="Folder with the other libraries' environments.")
    ] = Path(".bench"),
    rounds: Annotated[int, typer.Option(min=1, help="Passes over each problem.")] = 10,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> int:
    """Time the controller, beside other libraries where they are installed; or navigation."""
    from motm_wbc.experiments.bench.basenav import bench_basenav
    from motm_wbc.experiments.bench.table import nav_rows, rows
    from motm_wbc.experiments.bench.wholebody import bench_wholebody

    if what not in ("wholebody", "basenav"):
        raise UnknownName("benchmark", what, ["basenav", "wholebody"])
    if what == "basenav":
        with Console(stderr=True).status("") as status:
            navigation = bench_basenav(scenes=rounds, progress=status.update)
        if as_json:
            print(json.dumps(navigation.figures))
            return OK
        table = _listing("one call", "median [us]", "p99 CPU [us]")
        for line in nav_rows(navigation):
            table.add_row(*line)
        Console().print(table)
        return OK
    with Console(stderr=True).status("") as status:
        result = bench_wholebody(peers, rounds=rounds, progress=status.update)
    for name, reason in result.missing.items():
        print(f"motm: left out: {name}: {reason}", file=sys.stderr)
    if as_json:
        print(json.dumps(result.as_dict()))
        return OK
    table = _listing("one step", "median [us]", "p99 CPU [us]", "solver")
    for row in rows(result):
        table.add_row(*row)
    Console().print(table)
    return OK


def _listing(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


@contextmanager
def _progress(quiet: bool, limit: float) -> Iterator[Callable[[StepReport], None] | None]:
    """A live line on a terminal: simulated time, what the robot is at, how fast it drives."""
    if quiet:
        yield None
        return
    console = Console(stderr=True)
    with console.status("setting up (the first run compiles, once)") as status:

        def show(report: StepReport) -> None:
            if report.base is not None:
                speed = float(report.command.base[0])
                status.update(
                    f"{report.time:5.1f} s of at most {limit:g} s · step {report.step_index + 1} "
                    f"· {report.stage} · base {speed:.2f} m/s"
                )

        yield show


def _print_result(result: RunResult, record: Path | None) -> None:
    s = result.summary
    table = _listing(f"{s.scenario}, {s.method}, {s.robot}", f"{s.plant} plant")
    table.add_row("result", "task done" if s.success else f"task failed: {s.failure_reason}")
    for label, value, unit in (
        ("task time", s.task_time_s, "s"),
        ("grasp attempts", s.grasp_attempts, ""),
        ("first attempt at", s.first_attempt_time_s, "s"),
        ("grasp holds at", s.grasp_time_s, "s"),
        ("base speed at the grasp", s.base_speed_at_grasp_m_s, "m/s"),
        ("object's error at the drop", s.object_error_at_drop_m, "m"),
        ("collisions", s.collisions, ""),
        ("least clearance, base", s.min_base_clearance_m, "m"),
        ("least clearance, arm", s.min_arm_clearance_m, "m"),
        ("base step, median", s.base_step_ms.median if s.base_step_ms else None, "ms"),
        ("arm step, median", s.arm_step_ms.median if s.arm_step_ms else None, "ms"),
        ("real-time factor", s.real_time_factor, ""),
    ):
        table.add_row(label, _figure(value, unit))
    for line in result.collisions:
        table.add_row("contact", line)
    if record is not None:
        table.add_row("recording", str(record))
    Console().print(table)


def _print_drive(r: DriveResult, record: Path | None) -> None:
    table = _listing("nav", "")
    table.add_row("result", "goal reached" if r.success else f"failed: {r.failure_reason}")
    for label, value, unit in (
        ("time", r.time_s, "s"),
        ("PathRTR of the global path, and v/a", r.lower_bound_s, "s"),
        ("collisions", r.collisions, ""),
        ("least clearance", r.min_clearance_m, "m"),
        ("length of the way", r.path_length_m, "m"),
        ("length of the global path", r.global_path_length_m, "m"),
        ("base step, median", r.step_ms.median if r.step_ms else None, "ms"),
        ("base step, p99", r.step_ms.p99 if r.step_ms else None, "ms"),
    ):
        table.add_row(label, _figure(value, unit))
    if record is not None:
        table.add_row("recording", str(record))
    Console().print(table)


def _figure(value: float | None, unit: str) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    shown = str(value) if isinstance(value, int) else f"{value:.3f}"
    return f"{shown} {unit}".rstrip()


def _viewer() -> str:
    """Path of the rerun viewer.

    Raises:
        InputError: there is none.
    """
    viewer = Path(sys.executable).with_name("rerun")
    if not viewer.exists():
        raise InputError("the rerun viewer is not installed beside this Python", "--view")
    return str(viewer)
