"""The blueprint: which views a recording opens with, and where they look from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from motm_wbc.geometry.arrays import Array
from motm_wbc.recording import camera, overlay, plans, robot, solids, states, timeline
from motm_wbc.recording.series import Plot

LOG = "/log"
LEGEND = "/legend"
_ASPECTS = 1.6, 1.3  # of scene and plan; in a usual window they are wider: nothing is cut off
_ELEVATION, _TURN = math.radians(42.0), math.radians(20.0)
_SHORT_LEGEND = 4  # lines
_BACKGROUND = (24, 26, 32)
_GRID_COLOUR = (120, 130, 150, 60)
_ROOTS = (
    solids.ROOT,
    robot.ROOT,
    plans.ROOT,
    overlay.BASE,
    overlay.TARGET,
    overlay.TOOL_TARGET,
)


def blueprint(points: Array, panels: Sequence[Plot], hidden: Sequence[str]) -> Any:
    """Scene, plan and log at the left, curves and states at the right.

    Args:
        points: (n, 3) what the cameras shall show [m].
        panels: the panels of curves; those that share a `cell` share a place, as tabs.
        hidden: roots of entities that the scene doesn't show.
    """
    import rerun.blueprint as rrb

    slanted = camera.slanted(points, _ASPECTS[0], _ELEVATION, _TURN)
    overhead = camera.overhead(points, _ASPECTS[1])
    rows, shares = plot_rows(panels)
    # From above the robot's body would hide what is drawn on the floor.
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                spatial("Scene", slanted, hidden),
                rrb.Horizontal(
                    spatial("Plan", overhead, [robot.ROOT, solids.LABELS]),
                    rrb.Tabs(event_log(), rrb.TextDocumentView(origin=LEGEND, name="Legend")),
                    column_shares=[1, 1],
                ),
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                *rows,
                rrb.StateTimelineView(origin=states.ROOT, name="States"),
                row_shares=[*shares, 4],
            ),
            column_shares=[11, 9],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        time_panel(),
    )


def time_panel() -> Any:
    """The time line, folded; it plays."""
    import rerun.blueprint as rrb

    return rrb.TimePanel(
        state="collapsed", timeline=timeline.NAME, play_state="playing", loop_mode="all"
    )


def plot_rows(panels: Sequence[Plot]) -> tuple[list[Any], list[float]]:
    """Two places a row, and the rows' shares of the height: long legends need more."""
    import rerun.blueprint as rrb

    cells: dict[str, list[Plot]] = {}
    for panel in panels:
        cells.setdefault(panel.cell or panel.key, []).append(panel)
    places = list(cells.values())
    rows, shares = [], []
    for pair in (places[k : k + 2] for k in range(0, len(places), 2)):
        rows.append(rrb.Horizontal(*(_place(tabs) for tabs in pair)))
        longest = max(len(panel.names) for tabs in pair for panel in tabs)
        shares.append(4.0 if longest <= _SHORT_LEGEND else 6.0)
    return rows, shares


def _place(tabs: Sequence[Plot]) -> Any:
    import rerun.blueprint as rrb

    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop)
    views = [
        rrb.TimeSeriesView(origin=panel.path, name=panel.title, plot_legend=legend)
        for panel in tabs
    ]
    return rrb.Tabs(*views) if len(views) > 1 else views[0]


def event_log() -> Any:
    """The log: level and text, which has the time; the path is the same for all lines."""
    import rerun.blueprint as rrb
    from rerun.blueprint.encodings import TimelineColumn

    columns = rrb.TextLogColumns(
        timeline_columns=[TimelineColumn(timeline.NAME, visible=False)],
        text_log_columns=["LogLevel", "Body"],
    )
    return rrb.TextLogView(origin=LOG, name="Events", columns=columns)


def spatial(name: str, eye: camera.Camera, hidden: Sequence[str]) -> Any:
    """A view of the scene, without what is `hidden`."""
    import rerun as rr
    import rerun.blueprint as rrb

    # The trail is one short line a frame; the view gathers all up to the time cursor.
    history = rrb.VisibleTimeRanges(
        timeline=timeline.NAME,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    return rrb.Spatial3DView(
        origin="/",
        name=name,
        contents=[*(f"+ {root}/**" for root in _ROOTS), *(f"- {root}/**" for root in hidden)],
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye.position,
            look_target=eye.target,
            eye_up=eye.up,
        ),
        line_grid=rrb.LineGrid3D(
            visible=True,
            spacing=0.5,
            plane=rr.components.Plane3D.XY,
            stroke_width=1.0,
            color=_GRID_COLOUR,
        ),
        background=_BACKGROUND,
        overrides={overlay.TRAIL: history},
    )
