"""Parameters of base placement and of the global planner under it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from motm_wbc.scene.files import Data

Seconds = Annotated[float, Field(ge=0.0, le=60.0)]
Heading = Annotated[float, Field(ge=-math.tau, le=math.tau)]


_LEAST_GAP = 1e-3  # [rad]


def smallest_gap(headings: Sequence[float]) -> float:
    """Least angle between two neighbours of some headings on the circle [rad]."""
    turns = np.sort(np.remainder(headings, math.tau))
    return float(np.diff(np.append(turns, turns[0] + math.tau)).min())


class PlacementParameters(Data):
    """How the base's pose at an object is chosen (FR, section on base placement)."""

    count: Annotated[int, Field(ge=4, le=360)] = 36
    """Positions on the ring about the object."""
    headings: Annotated[tuple[Heading, ...], Field(min_length=1, max_length=16)] = (0.0, math.pi)
    """Headings of the candidates at each position, from the tangent that goes round the object
    counter-clockwise [rad]; as they are, the two tangential ones."""
    radius: Annotated[float, Field(gt=0.0, le=5.0)] = 0.6
    """Radius of the ring [m]."""
    weight: Annotated[float, Field(ge=1.0, le=10.0)] = 1.05
    """Weight w of the way on to the next target (RBC); above 1 it favours the candidate
    furthest along."""
    hold: bool = True
    """Hold on to the candidate chosen before, unless another one is cheaper by more than the
    hysteresis or lies nearer to the next target."""
    hysteresis: Seconds = 0.1
    """How much cheaper another candidate must be to replace one that is held [s]."""
    ties_to_next: bool = True
    """Of candidates that cost about the same take the one nearest to the next target."""
    tie_slack: Seconds = 0.15
    """Candidates within this of the cheapest cost about the same [s]."""
    price_wait: bool = True
    """While a grasp is pending, count the way to a candidate only as far as it takes longer
    than the wait that is expected."""
    stop_here: bool = True
    """Offer to brake and stay where the robot is, once the object is in reach."""
    inflation: Annotated[float, Field(ge=0.0, le=5.0)] = 0.30
    """Radius of the disc that the global planner plans for [m]."""
    footprint_margin: Annotated[float, Field(ge=0.0, le=1.0)] = 0.02
    """Distance that the true footprint keeps from obstacles at a candidate [m]."""
    next_ring: bool = True
    """The way on leads to the best free pose of the next target's own ring; else to the
    target itself, its support ignored."""

    @field_validator("headings")
    @classmethod
    def _differ(cls, headings: tuple[float, ...]) -> tuple[float, ...]:
        if smallest_gap(headings) < _LEAST_GAP:
            raise ValueError("two of them are the same")
        return headings

    @classmethod
    def paper(cls) -> PlacementParameters:
        """The paper's literal form: the lowest cost is the goal, and nothing else counts."""
        return cls(
            hold=False, ties_to_next=False, price_wait=False, stop_here=False, next_ring=False
        )
