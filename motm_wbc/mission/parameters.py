"""Every number that the mission uses."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from motm_wbc.scene.files import Data

Gain = Annotated[float, Field(gt=0.0, le=100.0)]
Speed = Annotated[float, Field(gt=0.0, le=10.0)]
Distance = Annotated[float, Field(gt=0.0, le=1.0)]
Angle = Annotated[float, Field(gt=0.0, le=3.2)]
Time = Annotated[float, Field(ge=0.0, le=10.0)]


class ReachParameters(Data):
    """How the tool travels to its target and follows it."""

    form: Literal["cylinder", "quintic"] = "cylinder"
    """`cylinder`: in cylinder coordinates of the arm's base; `quintic`: straight (MotM)."""
    gain: Gain = 7.0
    """Share of the remaining distance covered per second [1/s]."""
    servo_gain: Gain = 9.0
    """The same, within `servo_distance` of the target [1/s]."""
    servo_distance: Distance = 0.10
    """Below this distance the tool is servoed in world axes (MotM) [m]."""
    speed: Speed = 0.8
    """Largest correction of the tool's position [m/s]."""
    bearing_rate: Speed = 2.0
    """Largest correction of its bearing about the arm's base [rad/s]."""
    acceleration: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0
    """Largest change of the tool's velocity relative to the base [m/s^2]."""
    turn_gain: Gain = 6.0
    """Share of the remaining rotation covered per second [1/s]."""
    turn_rate: Speed = 2.0
    """Largest rotation of the tool [rad/s]."""
    lead: Annotated[float, Field(ge=1.0, le=5.0)] = 1.6
    """The reach starts this many times its own duration before the object is in range."""
    shortest: Time = 0.4
    """Least duration that a reach is taken to need [s]."""
    typical_speed: Speed = 0.5
    """Radial speed by which the duration is estimated [m/s]."""
    typical_bearing_rate: Speed = 1.2
    """Rate of bearing by which the duration is estimated [rad/s]."""
    arrival_gain: Gain = 0.5
    """MotM's k_A: its reach starts when the time to range is below d/(k_A v)."""


class GraspParameters(Data):
    """Hovering, descending, closing, trying again, releasing."""

    hover: Distance = 0.06
    """Height above the grasp that the tool keeps until it is aligned [m]."""
    align_distance: Distance = 0.008
    """The tool descends once it is this close beside the grasp [m]."""
    align_angle: Angle = 0.10
    """... and this well turned [rad]."""
    lost_distance: Distance = 0.013
    """A descending or trying tool that is this far beside rises and hovers again [m]: the
    open fingers clear a 5 cm cube by 15 mm."""
    descent_speed: Speed = 0.35
    """Largest speed of descending and lifting [m/s]."""
    attempt_distance: Distance = 0.008
    """The fingers close when the tool is this close to the grasp [m]."""
    attempt_angle: Angle = 0.12
    """... this well turned [rad]."""
    attempt_speed: Speed = 0.05
    """... and this slow relative to the object [m/s]."""
    attempt_period: Time = 0.5
    """Least time from the start of an attempt to the start of the next [s]."""
    patience: Time = 0.12
    """A closing gripper that feels nothing this long after its closing time opens again [s]."""
    typical_time: Time = 0.8
    """From coming into range to the end of a first attempt that holds, to plan by [s]."""
    slip_time: Time = 0.15
    """A hand that has felt nothing for this long has lost what it carried [s]."""
    lift: Distance = 0.05
    """The object is lifted straight up by this much before it is carried off [m]."""
    release_distance: Distance = 0.012
    """The fingers open when the object is this close to its place [m]."""
    release_speed: Speed = 0.10
    """... and this slow [m/s]."""
    release_height: Distance = 0.004
    """Height above the support from which the object is let go [m]."""
    opened_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.6
    """The fingers count as open at this share of the way to their full width."""
    retreat: Distance = 0.10
    """After the release the tool goes straight up by this much [m]."""
    carry_radius: Distance = 0.45
    """Distance from the arm's base at which an object is carried [m]."""
    carry_clearance: Distance = 0.12
    """Height above the task's highest support at which its underside is carried [m]."""


class MissionParameters(Data):
    """The mission's rates."""

    base_rate_divider: Annotated[int, Field(ge=1, le=100)] = 6
    """Control steps from one base step to the next (6 at 120 Hz: 20 Hz)."""
