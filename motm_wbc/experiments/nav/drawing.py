"""A drive as a picture: map, global path, way, footprint, and speeds over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURES = (".png", ".svg", ".pdf")
_SHOWN = 25  # footprints along the way
_BLOCKED, _MOVING, _FLOOR = "#9aa3ad", "#d9894f", "#ffffff"
_WAY, _PATH, _GOAL = "#1668b8", "#57a869", "#b8338a"


def draw_drive(
    path: Path, world: World, footprint: Array, limits: BaseLimits, goal: Array, result: DriveResult
) -> None:
    """Write a picture of a drive.

    Args:
        path: of the picture; its ending says the format (.png, .svg, .pdf).
        world: at time 0; what moves is drawn there and where it was at the end.
        footprint: (n, 2) [m].
        limits: drawn beside the speeds.
        goal: (3,) pose.
        result: of the drive.

    Raises:
        InputError: the file can't be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, width_ratios=[3, 2])
    plan, speed, turning = (
        figure.add_subplot(cell) for cell in (grid[:, 0], grid[0, 1], grid[1, 1])
    )
    _draw_world(plan, world, float(result.trajectory[-1, 0]))
    _draw_way(plan, footprint, goal, result)
    times, v, omega = result.trajectory[:, 0], result.trajectory[:, 4], result.trajectory[:, 5]
    _draw_curve(speed, times, v, (-limits.v_reverse, limits.v_max), "speed [m/s]")
    _draw_curve(turning, times, omega, (-limits.omega_max, limits.omega_max), "turn rate [rad/s]")
    turning.set_xlabel("time [s]")
    said = "goal reached" if result.success else f"failed: {result.failure_reason}"
    plan.set_title(f"{said}, {result.trajectory[-1, 0]:.2f} s, {result.path_length_m:.2f} m")
    try:
        figure.savefig(path, dpi=110)
    except (OSError, ValueError) as error:
        raise InputError(f"can't be written: {error}", str(path)) from None


def _draw_world(axes: Axes, world: World, end: float) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Curve

    if world.boundary is not None:
        axes.fill(*world.boundary.T, facecolor=_FLOOR, edgecolor="black", linewidth=1.5)
    for faded, shown in ((True, world.after(end)), (False, world)):
        for solid in shown.solids:
            if faded and not solid.moves:
                continue
            rings = [Curve(np.vstack([ring, ring[:1]]), closed=True) for ring in solid.rings]
            axes.add_patch(
                PathPatch(
                    Curve.make_compound_path(*rings),
                    facecolor=_MOVING if solid.moves else _BLOCKED,
                    edgecolor="none",
                    alpha=0.35 if faded else 1.0,
                )
            )
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _draw_way(axes: Axes, footprint: Array, goal: Array, result: DriveResult) -> None:
    rows = result.trajectory
    for row in rows[np.linspace(0, len(rows) - 1, _SHOWN).astype(int)]:
        axes.fill(
            *polygons.place(footprint, row[1:4]).T,
            facecolor="none",
            edgecolor=_WAY,
            alpha=0.4,
            linewidth=0.8,
        )
    if result.global_path is not None:
        axes.plot(*result.global_path.T, "--", color=_PATH, label="global path")
    axes.plot(rows[:, 1], rows[:, 2], color=_WAY, label="way driven")
    axes.fill(
        *polygons.place(footprint, goal).T,
        facecolor="none",
        edgecolor=_GOAL,
        linewidth=1.6,
        label="goal",
    )
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, fontsize="small")


def _draw_curve(
    axes: Axes, times: Array, values: Array, limits: tuple[float, float], name: str
) -> None:
    axes.plot(times, values, color=_WAY)
    for height in limits:
        axes.axhline(height, color="#a04040", linewidth=0.8, linestyle=":")
    axes.set_ylabel(name)
    axes.grid(alpha=0.3)
