"""`motm nav`: a map and two poses in, a drive out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from motm_wbc.basenav.local_planners import LOCAL_PLANNERS
from motm_wbc.basenav.maps import load_world
from motm_wbc.basenav.navigator import fitting_inflation
from motm_wbc.errors import InputError, UnknownName
from motm_wbc.experiments.nav.drawing import PICTURES, draw_drive
from motm_wbc.experiments.nav.drive import drive
from motm_wbc.experiments.nav.recording import DriveTelling
from motm_wbc.experiments.nav.request import arriving, base_of, check_free, pose
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.experiments.parameters import make_parameters
from motm_wbc.scene.floor_map import Unknown

NOISE = 0.005, 0.005
"""Of what the navigator is told of its pose, for seeds other than 0 [m], [rad]."""
_UNKNOWN: dict[str, Unknown] = {"blocked": "blocked", "free": "free"}


@dataclass(frozen=True, slots=True)
class NavRequest:
    """The words of the command line; see `motm nav --help`."""

    map_file: Path
    start: str
    goal: str
    robot: str = "frankie"
    footprint: str | None = None
    limits: tuple[tuple[str, float | None], ...] = ()
    stop: bool = False
    planner: str = "staa"
    unknown: str = "blocked"
    seed: int = 0
    time_limit: float | None = None
    settings: Sequence[str] = ()
    record: Path | None = None
    draw: Path | None = None


def navigate(request: NavRequest) -> DriveResult:
    """Do what was asked.

    Raises:
        InputError: something given can't be used; nothing was driven.
    """
    _check(request)
    base = base_of(request.robot, request.footprint, dict(request.limits))
    begin = pose(request.start, "--start")
    asked = pose(request.goal, "--goal", free_heading=True)
    parameters = make_parameters("ours", request.settings)
    world = load_world(request.map_file, _UNKNOWN[request.unknown])
    ground = world.still()
    check_free(ground, base, begin, "--start")
    end = arriving(ground, base, begin, asked)
    check_free(ground, base, end, "--goal")
    margin = (parameters.teb if request.planner == "teb" else parameters.staa).margin
    inflation = fitting_inflation(ground, base.footprint, base.limits, begin, end, margin)
    telling = None
    if request.record is not None:
        telling = DriveTelling(
            request.record, world, base.footprint, base.limits, begin, end, inflation
        )
    result = None
    try:
        result = drive(
            world,
            base.footprint,
            base.limits,
            begin,
            end,
            stop=request.stop,
            planner=request.planner,
            staa=parameters.staa,
            teb=parameters.teb,
            inflation=inflation,
            time_limit=request.time_limit,
            noise=NOISE,
            seed=request.seed,
            observer=None if telling is None else telling.see,
        )
    finally:
        if telling is not None:
            telling.close(result)
    if request.draw is not None:
        draw_drive(request.draw, world, base.footprint, base.limits, end, result)
    return result


def _check(request: NavRequest) -> None:
    """What can be refused before anything is read."""
    if request.planner not in LOCAL_PLANNERS:
        raise UnknownName("local planner", request.planner, LOCAL_PLANNERS, "--planner")
    if request.unknown not in _UNKNOWN:
        raise UnknownName("meaning of unknown cells", request.unknown, _UNKNOWN, "--unknown")
    if request.seed < 0:
        raise InputError(f"must be 0 or more, got {request.seed}", "--seed")
    if request.time_limit is not None and not 0.0 < request.time_limit <= 3600.0:
        raise InputError(f"must be in 0..3600 s, got {request.time_limit:g}", "--time-limit")
    if request.draw is not None and request.draw.suffix.lower() not in PICTURES:
        raise InputError(f"must end in one of {', '.join(PICTURES)}", "--draw")
    for name, file in (("--record", request.record), ("--draw", request.draw)):
        if file is not None and not file.parent.is_dir():
            raise InputError(f"the folder {file.parent} does not exist", name)
