"""The numbers of the simulated physics."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from motm_wbc.scene.files import Data

Positive = Annotated[float, Field(gt=0.0)]


class PhysicsParameters(Data):
    """How the plants move the world; the robot's and the scene's own data come from their files."""

    physics_rate: Annotated[float, Field(ge=60.0, le=2000.0)] = 240.0
    """Physics steps per second of simulated time; rounded to whole steps a control period."""
    gravity: Annotated[float, Field(gt=0.0, le=30.0)] = 9.81
    """[m/s^2]."""
    close_speed_scale: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    """Factor on the speed at which the robot's file lets the fingers move."""
    attempt_radius: Annotated[float, Field(gt=0.0, le=0.05)] = 0.01
    """Distance from the tool to a grasp below which closing counts as an attempt [m]."""
    failed_clearance: Annotated[float, Field(gt=0.0, le=0.05)] = 0.01
    """A failing attempt leaves the fingers this much wider than the object [m]."""
    hold_radius: Annotated[float, Field(gt=0.0, le=0.05)] = 0.02
    """Distance from the tool to the grasp beyond which touching fingers don't hold [m]."""
    solver_iterations: Annotated[int, Field(ge=10, le=1000)] = 150
    """Iterations of the rigid-body solver in a physics step."""
    base_force: Positive = 20000.0
    """Largest force of the motors that move the base in the plane [N]; far above what the
    base's accelerations need, so that it follows its commands."""
    base_torque: Positive = 20000.0
    """Largest torque of the motor that turns the base [N m]."""
    contact_friction: Annotated[float, Field(gt=0.0, le=5.0)] = 1.0
    """Friction of fingers and supports; the object's own is multiplied with it."""
