"""Parameters of the local planner."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from motm_wbc.scene.files import Data

_MOST_CELLS = 2000  # along a side of the window: bounds memory and time
Odd = Annotated[int, Field(ge=3, le=31)]


class StaaParameters(Data):
    """Modified STAA* (STAA*, "Aborting A*"; changes for pose goals after FR)."""

    linear_actions: Odd = 3
    """Accelerations along the heading, evenly over ±a_max; odd, so that zero is one."""
    angular_actions: Odd = 5
    """Angular accelerations, evenly over ±alpha_max; odd."""
    step: Annotated[float, Field(gt=0.0, le=2.0)] = 0.3
    """Duration of a node's action [s]."""
    checks: Annotated[int, Field(ge=1, le=20)] = 3
    """Poses of a step at which the footprint is checked; the arc is exact between them."""
    expansions: Annotated[int, Field(ge=1, le=100_000)] = 300
    """Nodes expanded before the search is aborted."""
    wide_expansions: Annotated[int, Field(ge=1, le=1_000_000)] = 20_000
    """Nodes expanded at most by the search of a base that stands because it is stuck."""
    wide_step: Annotated[int, Field(ge=1, le=100_000)] = 600
    """How many of them in a command period."""
    wide_gain: Annotated[float, Field(gt=0.0, le=60.0)] = 2.0
    """What counts as a way out: it reaches the goal, or its cost-to-go is by so much less than
    the least that a usual search finds [s]."""
    clock_guard: Annotated[float, Field(gt=0.0, le=10.0)] = 0.036
    """Processor time after which the search is aborted all the same, and says so [s]. Not wall
    time: how busy a machine is must not change a run."""
    heuristic_weight: Annotated[float, Field(ge=1.0, le=10.0)] = 1.3
    """Weight of the cost-to-go in the order of expansion."""
    cell: Annotated[float, Field(ge=0.005, le=1.0)] = 0.05
    """Cell of the closed set and of the proximity grid [m]."""
    headings: Annotated[int, Field(ge=4, le=720)] = 31
    """Headings that the closed set tells apart."""
    window: Annotated[float, Field(gt=0.0, le=100.0)] = 8.0
    """Side of the square that the search is kept in, which turns with the base [m]."""
    window_ahead: Annotated[float, Field(ge=0.0, le=50.0)] = 2.0
    """How far ahead of the base the square's centre lies [m]."""
    local_target: Literal["exact", "window"] = "exact"
    """`exact`: cost-to-go of the goal itself; `window`: of the pose at which the global path
    leaves the square (the papers' form)."""
    proximity_weight: Annotated[float, Field(ge=0.0, le=100.0)] = 0.3
    """Cost of one step at nearness 1, as k = 1 [s]."""
    proximity_radius: Annotated[float, Field(gt=0.0, le=2.0)] = 0.25
    """Distance from an obstacle at which nearness has fallen to 0 [m]."""
    proximity_horizon: Annotated[float, Field(gt=0.0, le=60.0)] = 3.0
    """Time to the goal below which the proximity weight shrinks in proportion [s]."""
    proximity_floor: Annotated[float, Field(ge=0.0, le=1.0)] = 0.1
    """Least share of the proximity weight that remains at the goal."""
    moving_weight: Annotated[float, Field(ge=0.0, le=100.0)] = 0.2
    """Cost of one step next to an obstacle that moves; it falls to 0 within 1 m [s]."""
    standing: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    """How long the base must be able to stand, having braked after any command, before an
    obstacle that moves meets it [s]."""
    lasting: Annotated[float, Field(gt=0.0, le=60.0)] = 5.0
    """How long the base must be able to keep out of the way of what moves after any command,
    if it drives out of it [s]."""
    escape_horizon: Annotated[float, Field(gt=0.0, le=60.0)] = 10.0
    """How far ahead ways out are looked at [s]."""
    goal_distance: Annotated[float, Field(gt=0.0, le=1.0)] = 0.10
    """How near to the goal's position counts as there [m]."""
    goal_angle: Annotated[float, Field(gt=0.0, le=3.2)] = 0.35
    """How near to the goal's heading counts as there [rad]."""
    docking_accuracy: Annotated[float, Field(ge=0.0, le=100.0)] = 4.0
    """How many seconds one second's worth of remaining error at a stop is worth."""
    margin: Annotated[float, Field(ge=0.0, le=0.5)] = 0.02
    """Distance that the footprint keeps from obstacles [m]."""
    command_period: Annotated[float, Field(gt=0.0, le=1.0)] = 0.05
    """Time for which the answer is applied before the next one is there [s]; a run sets it
    from its own rates."""
    ramp_steps: Annotated[int, Field(ge=1, le=1000)] = 6
    """Control steps of a command period, in each of which the velocity is raised at the
    start; a run sets it from its own rates."""

    @model_validator(mode="after")
    def _fits_together(self) -> StaaParameters:
        for name in ("linear_actions", "angular_actions"):
            if getattr(self, name) % 2 == 0:
                raise ValueError(f"{name} must be odd, so that zero is among them")
        if self.command_period > self.step:
            raise ValueError("command_period must not be longer than step")
        if 0.5 * self.window <= self.window_ahead:
            raise ValueError("window_ahead must be less than half the window: the base is in it")
        if self.window > _MOST_CELLS * self.cell:
            raise ValueError(f"window must not have more than {_MOST_CELLS} cells along a side")
        return self
