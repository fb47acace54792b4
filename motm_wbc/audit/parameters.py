"""The numbers of the audit."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from motm_wbc.scene.files import Data


class AuditParameters(Data):
    """What counts as contact, and how often distances are measured."""

    clearance_rate: Annotated[float, Field(gt=0.0, le=1000.0)] = 20.0
    """Measurements of the clearances per second of simulated time."""
    skin: Annotated[float, Field(ge=0.0, le=0.02)] = 0.001
    """The robot's shapes are grown by this before contact is looked for [m]: a physics engine
    that pushes bodies apart would hide from the audit what its contacts prevent."""
    lift: Annotated[float, Field(ge=0.0, le=0.1)] = 0.01
    """A held object may touch a support while its bottom is this near to the top [m]."""
    episode_gap: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    """Contacts of one pair with less time than this between them are one episode [s]."""
