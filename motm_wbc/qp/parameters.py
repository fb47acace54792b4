"""The numbers of this room, each in one place."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from motm_wbc.kinematics.parameters import PairClasses
from motm_wbc.scene.files import Data

Weight = Annotated[float, Field(ge=0.0, le=1e6)]
PositiveWeight = Annotated[float, Field(gt=0.0, le=1e6)]
Gain = Annotated[float, Field(ge=0.0, le=100.0)]


class HolisticParameters(Data):
    """Weights of the whole-body mode without navigation (Haviland et al., 2022)."""

    arm_weight: PositiveWeight = 0.01
    """Weight of the arm's velocities."""
    base_weight: PositiveWeight = 0.01
    """Weight of the base's inputs, divided by the position error [m]."""
    slack_weight: PositiveWeight = 1.0
    """Weight of the tool's slack, divided by the position error [m]."""
    manipulability_weight: Weight = 1.0
    """Weight of the manipulability's gradient."""
    yaw_weight: Weight = 0.5
    """Weight that turns the base toward the tool's bearing."""
    servo_gain: Annotated[float, Field(gt=0.0, le=100.0)] = 1.5
    """Position error = commanded speed / gain, where the task does not give it [1/s]."""
    least_error: Annotated[float, Field(ge=1e-3, le=1.0)] = 0.02
    """Position errors below count as this [m]: the weights are their inverse."""
    largest_error: Annotated[float, Field(ge=0.01, le=100.0)] = 2.0
    """Position errors above count as this [m]."""


class WholeBodyParameters(Data):
    """Weights, gains and safety of the whole-body controller.

    The cost of one step is in squared speeds: a weight of one makes 1 m/s (or 1 rad/s) of
    deviation cost one half.
    """

    linear_weight: PositiveWeight = 500.0
    """Weight of the tool's linear velocity; large beside all that the redundancy is for."""
    angular_weight: PositiveWeight = 50.0
    """Weight of the tool's angular velocity."""
    pose_speed: Annotated[float, Field(gt=0.0, le=10.0)] = 0.5
    """Largest speed that an error of a tool's position asks for [m/s]."""
    pose_turn_speed: Annotated[float, Field(gt=0.0, le=20.0)] = 1.5
    """Largest turn rate that an error of a tool's orientation asks for [rad/s]."""
    damping: PositiveWeight = 0.01
    """Weight of the arm's joint velocities (Holistic's)."""
    scale_weight: PositiveWeight = 1000.0
    """Pull of the factor that scales navigation's command toward one, per m/s of that command.
    It exceeds what the tool task can pull back (linear weight times slack), so that only
    limits and collision rows slow the base."""
    manipulability_weight: Weight = 0.02
    """Weight of the manipulability's gradient: a cost, never a constraint."""
    posture_weight: Weight = 1.0
    """Weight of the posture task; each joint's own weight multiplies it."""
    posture_gain: Gain = 2.0
    """Speed toward the preferred posture per distance from it [1/s]."""
    posture_speed: Annotated[float, Field(gt=0.0, le=10.0)] = 0.5
    """Largest speed that the posture task asks for [rad/s]."""
    preferred_bound_weight: Weight = 2.0
    """Weight of a preferred bound once a joint is beyond it."""
    preferred_bound_margin: Annotated[float, Field(gt=0.0, le=2.0)] = 0.2
    """Distance before a preferred bound over which its weight grows from zero [rad]."""
    holistic: HolisticParameters = HolisticParameters()
    """Weights of the mode in which the base's inputs are free."""

    pairs: PairClasses = PairClasses()
    """Safe and influence distances of each class of pairs."""
    damper_speed: Annotated[float, Field(gt=0.0, le=5.0)] = 1.0
    """Approach speed that is allowed at the influence distance [m/s] (NEO). It is lowered for
    each class to what the arm's accelerations can follow."""
    noticed_speed: Annotated[float, Field(gt=0.0, le=5.0)] = 2.0
    """Approach speed that must never meet a damper unprepared [m/s]: where a class allows less
    at its influence distance, its line goes on outward until it allows this."""
    retreat_speed: Annotated[float, Field(gt=0.0, le=5.0)] = 0.2
    """Largest speed with which a pair nearer than its safe distance is led apart [m/s]."""
    collision_rows: Annotated[int, Field(ge=1, le=100)] = 12
    """Pairs that the QP sees in one step: those nearest to what their rows allow."""
    held_rows: Annotated[int, Field(ge=1, le=20)] = 4
    """Of these, how many may be spent on the held object and one body: the corners of a face."""
    largest_age: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    """Age of a sensor sample above which the controller brakes [s]."""
    recovery_speed: Annotated[float, Field(gt=0.0, le=5.0)] = 0.2
    """Speed with which a joint outside its range is led back [rad/s]."""

    solver_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-5
    """Absolute tolerance of OSQP where its answer cannot be polished; the relative one is zero."""
    solver_iterations: Annotated[int, Field(ge=10, le=1000)] = 200
    """Iterations after which OSQP counts as failed."""
    solver_time_limit: Annotated[float, Field(gt=0.0, le=10.0)] = 0.01
    """Time of the processor after which a solver is not asked again [s]: daqp answers from
    then on. osqp and daqp count their iterations instead."""
    row_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-4
    """Largest violation of a collision row in an accepted answer [m/s]."""
    acceleration_penalty: PositiveWeight = 3000.0
    """Price of passing an acceleration limit, per rad/s, where not everything can be kept. Only
    its share of the next one counts."""
    collision_penalty: PositiveWeight = 30000.0
    """Price of passing a collision row, per m/s, where not everything can be kept."""
