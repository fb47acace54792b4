"""What a recording's user may choose."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from motm_wbc.scene.files import Data


class RecordingParameters(Data):
    """Rates and budgets of a recording."""

    frame_period: Annotated[float, Field(gt=0.0, le=1.0)] = 0.05
    """Time between two states of the 3-D scene [s]; the series have every control step."""
    batch: Annotated[float, Field(gt=0.0, le=60.0)] = 5.0
    """Simulated time between two writes [s]: as much as a killed process may lose."""
    plan_lifetime: Annotated[float, Field(gt=0.0, le=10.0)] = 0.25
    """Age at which the base's last plan is taken off the scene if no newer one came [s]."""
    base_budget: Annotated[float, Field(gt=0.0, le=1.0)] = 0.05
    """Time that a base step may take, drawn beside its series [s]."""
    arm_budget: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0 / 120.0
    """Time that a control step may take, drawn beside its series [s]."""
