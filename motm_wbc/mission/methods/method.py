"""What a method is given, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from motm_wbc.basenav.parameters import PlacementParameters
from motm_wbc.basenav.reach import ReachRegion
from motm_wbc.basenav.staa_parameters import StaaParameters
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.interfaces import BaseReport


@dataclass(frozen=True, slots=True)
class MethodContext:
    """What does not change during a run.

    Attributes:
        world: obstacles for the base.
        footprint: (n, 2) outline of the base in its frame [m].
        limits: of the base.
        region: where the arm can hold an object.
        base_period: time from one base step to the next [s].
        placement: parameters of base placement.
        staa: parameters of the local planner.
    """

    world: World
    footprint: Array
    limits: BaseLimits
    region: ReachRegion
    base_period: float
    placement: PlacementParameters
    staa: StaaParameters


@dataclass(frozen=True, slots=True)
class BaseMoment:
    """What a method is told at a base step.

    Attributes:
        time: [s].
        pose: (3,) of the base.
        v: commanded speed along the heading [m/s].
        omega: commanded turn rate [rad/s].
        step_index: index of the task step at work; a change means that the target changed.
        target: (2,) where the present step acts [m]; None when the task is done.
        next_target: (2,) where the step after it acts, or None.
        wait: expected time from now until it is done [s]; see `motm_wbc.mission.patience`.
        attempts_fail: an attempt has failed, so that nothing is known of when one will hold.
    """

    time: float
    pose: Array
    v: float
    omega: float
    step_index: int
    target: Array | None
    next_target: Array | None
    wait: float
    attempts_fail: bool


@dataclass(frozen=True, slots=True)
class BaseDecision:
    """A method's answer.

    Attributes:
        acceleration: (2,) along the heading [m/s^2] and about the vertical [rad/s^2], until
            the next base step.
        prediction: (k, 4) time from now [s], x, y, heading along which the base will go.
        pass_poses: (m, 3) poses of the pass by the target, from where it comes into reach to
            where the base would wait: what the tool's yaw has to last for.
        report: for the recorder.
    """

    acceleration: Array
    prediction: Array
    pass_poses: Array
    report: BaseReport


class Method(Protocol):
    """A way to lead the base; a class with a constructor that takes the context."""

    def __init__(self, context: MethodContext) -> None:
        """Get ready for a run."""

    def decide(self, now: BaseMoment) -> BaseDecision:
        """Say what the base shall do until the next base step."""
