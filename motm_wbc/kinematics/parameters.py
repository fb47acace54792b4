"""The numbers of this room, each in one place."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from motm_wbc.scene.files import Data

Distance = Annotated[float, Field(ge=0.0, le=2.0)]


class PairClass(Data):
    """How near two bodies may come, and from where on their approach is slowed."""

    name: str
    """For labels of rows and contacts."""
    safe: Distance
    """Distance that is kept [m]."""
    influence: Distance
    """Distance from which the approach is slowed [m]."""

    @model_validator(mode="after")
    def _slows_before_it_stops(self) -> PairClass:
        if self.influence <= self.safe:
            raise ValueError("'influence' must be larger than 'safe'")
        return self


class PairClasses(Data):
    """The classes of pairs; one distance for all would forbid to pick a cube off a table."""

    arm_scene: PairClass = PairClass(name="arm_scene", safe=0.05, influence=0.30)
    """Links of the arm and everything in the scene (NEO's distances)."""
    hand_support: PairClass = PairClass(name="hand_support", safe=0.005, influence=0.05)
    """Hand, fingers, a held object, and tables and trays."""
    hand_target: PairClass = PairClass(name="hand_target", safe=0.002, influence=0.01)
    """The palm and the object between the fingers."""
    hand_scene: PairClass = PairClass(name="hand_scene", safe=0.02, influence=0.10)
    """Hand, fingers, a held object, and obstacles and other objects."""
    arm_base: PairClass = PairClass(name="arm_base", safe=0.02, influence=0.10)
    """Arm, hand, fingers, a held object, and the base's body."""
    base_scene: PairClass = PairClass(name="base_scene", safe=0.05, influence=0.30)
    """The base's body and everything in the scene, where nobody navigates."""
    self_collision: PairClass = PairClass(name="self_collision", safe=0.01, influence=0.10)
    """Two capsules of the robot."""


class IkParameters(Data):
    """Inverse kinematics by damped least squares."""

    position_tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 1e-4
    """Position error at which the search ends [m]."""
    angle_tolerance: Annotated[float, Field(gt=0.0, le=0.5)] = 1e-3
    """Orientation error at which the search ends [rad]."""
    max_iterations: Annotated[int, Field(ge=1, le=1000)] = 60
    """Steps after which the search gives up."""
    damping: Annotated[float, Field(gt=0.0, le=1.0)] = 1e-6
    """Least damping of a step, added to the squared weighted error."""
    max_step: Annotated[float, Field(gt=0.0, le=3.0)] = 0.4
    """Largest change of a joint in a step [rad or m]."""
    stall: Annotated[float, Field(ge=0.0, le=0.1)] = 1e-4
    """Largest change of a joint in a step below which the search gives up [rad or m]."""
    length: Annotated[float, Field(gt=0.0, le=10.0)] = 0.3
    """Length that makes an angle comparable to a distance [m/rad]."""
    posture_gain: Annotated[float, Field(ge=0.0, le=1.0)] = 0.2
    """Share of the way to the preferred posture that a step goes, where the target allows."""
