"""Parameters of the Timed Elastic Band."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from motm_wbc.scene.files import Data

Weight = Annotated[float, Field(ge=0.0, le=1e6)]


class TebParameters(Data):
    """Timed Elastic Band (Rösmann et al., ROBOTIK 2012, ECMR 2013).

    Speeds and accelerations are weighed as shares of their limits, so that one set of weights
    fits all bases; distances are weighed in metres, as in the authors' package.
    """

    interval: Annotated[float, Field(ge=0.05, le=2.0)] = 0.3
    """Duration that the band's intervals are kept near to [s]."""
    interval_slack: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    """By how much an interval may differ before it is split or joined [s]."""
    outer_iterations: Annotated[int, Field(ge=1, le=20)] = 4
    """Rounds of resizing, finding near obstacles and optimising."""
    inner_iterations: Annotated[int, Field(ge=1, le=100)] = 10
    """Levenberg-Marquardt steps tried in a round; about half of them succeed."""
    obstacle_growth: Annotated[float, Field(ge=1.0, le=10.0)] = 2.0
    """Factor on the obstacle weight from round to round."""
    time_weight: Weight = 1.0
    """Of an interval's duration [1/s^2]."""
    rolling_weight: Weight = 1000.0
    """Of slipping sideways (the non-holonomic condition) [1/m^2]."""
    forward_weight: Weight = 1.0
    """Of way driven in reverse [1/m^2]."""
    speed_weight: Weight = 10.0
    """Of exceeding v_max or v_reverse, as a share of v_max."""
    turn_weight: Weight = 10.0
    """Of exceeding omega_max, as a share of it."""
    acceleration_weight: Weight = 10.0
    """Of exceeding a_max, as a share of it."""
    turn_acceleration_weight: Weight = 10.0
    """Of exceeding alpha_max, as a share of it."""
    obstacle_weight: Weight = 50.0
    """Of coming nearer than `distance`, in the first round [1/m^2]."""
    nearness_weight: Weight = 0.1
    """Of coming nearer than `nearness_distance` [1/m^2]."""
    distance: Annotated[float, Field(ge=0.0, le=2.0)] = 0.05
    """Distance that the footprint shall keep from obstacles [m]."""
    nearness_distance: Annotated[float, Field(ge=0.0, le=2.0)] = 0.25
    """Distance below which obstacles are better avoided [m]."""
    margin: Annotated[float, Field(ge=0.0, le=0.5)] = 0.02
    """Distance without which no command is given out [m]."""
    horizon: Annotated[float, Field(ge=2.0, le=120.0)] = 30.0
    """Duration of the longest band; a goal beyond it is approached part by part [s]."""
    restart_distance: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    """A goal that moves farther than this at once gets a new band [m]."""
    restart_angle: Annotated[float, Field(gt=0.0, le=3.2)] = 0.8
    """A goal that turns farther than this at once gets a new band [rad]."""
    goal_distance: Annotated[float, Field(gt=0.0, le=1.0)] = 0.10
    """How near to the goal's position counts as there [m]."""
    goal_angle: Annotated[float, Field(gt=0.0, le=3.2)] = 0.35
    """How near to the goal's heading counts as there [rad]."""
    docking_distance: Annotated[float, Field(gt=0.0, le=1.0)] = 0.02
    """A base that comes to rest so near to the goal brakes [m]."""
    docking_angle: Annotated[float, Field(gt=0.0, le=3.2)] = 0.05
    """The same of the heading [rad]."""
    command_period: Annotated[float, Field(gt=0.0, le=1.0)] = 0.05
    """Time for which the answer is applied before the next one is there [s]; a run sets it
    from its own rates."""
    ramp_steps: Annotated[int, Field(ge=1, le=1000)] = 6
    """Control steps of a command period, in each of which the velocity is raised at the
    start; a run sets it from its own rates."""

    @model_validator(mode="after")
    def _fits_together(self) -> TebParameters:
        if self.interval_slack >= self.interval:
            raise ValueError("interval_slack must be less than interval")
        if self.horizon < 10.0 * self.interval:
            raise ValueError("horizon must be at least ten intervals")
        return self
