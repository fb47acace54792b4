"""From where the tool shall be to the twist that takes it there.

Far from its target the tool travels in cylinder coordinates of the arm's base, with the
target's own rates in that moving frame fed forward; near it, it is servoed in world axes
(MotM's position-based servoing). MotM's straight quintic reach is the other form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.rotations import rotation_error
from motm_wbc.mission.arrival import Arrival
from motm_wbc.mission.cylinder import (
    CylinderPoint,
    arm_base_position,
    as_cylinder,
    carried_velocity,
    relative_velocity,
)
from motm_wbc.mission.parameters import ReachParameters
from motm_wbc.mission.quintic import quintic_coefficients, quintic_state

_BRAKING_SHARE = 0.6  # of the acceleration limit: three coordinates share it
_SHORT_RADIUS = 0.2  # [m] below which the arm's bearing brakes no faster
_LONGEST_REACH = 5.0  # [s] the search for the least duration ends here


@dataclass(frozen=True, slots=True)
class ToolMotion:
    """The tool and the base that carries it, at one instant.

    Attributes:
        T_world_tool: (4, 4).
        base_pose: (3,).
        base_twist: (3,) v_x, v_y, omega in the base frame, as commanded for this step.
    """

    T_world_tool: Array
    base_pose: Array
    base_twist: Array

    @property
    def position(self) -> Array:
        """(3,) tool origin in the world [m]."""
        return np.asarray(self.T_world_tool[:3, 3])


class ToolReference:
    """Makes the tool's twist; remembers its last velocity, to keep it continuous."""

    def __init__(self, parameters: ReachParameters, arm_xy: Array, dt: float) -> None:
        """Set up.

        Args:
            parameters: gains and limits.
            arm_xy: (2,) the arm's base axis in the base frame [m].
            dt: control step [s].
        """
        self._p = parameters
        self._arm_xy = arm_xy
        self._dt = dt
        self._relative = np.zeros(3)
        self._quintic: Array | None = None  # position, velocity, acceleration in the base

    def reset(self) -> None:
        """Forget the last step: the tool has been moved by something else."""
        self._relative = np.zeros(3)
        self._quintic = None

    def toward_cylinder(self, target: CylinderPoint, tool: ToolMotion) -> Array:
        """(3,) world velocity toward a point that moves with the arm's base [m/s]."""
        self._quintic = None
        now = as_cylinder(tool.position, np.zeros(3), tool.base_pose, np.zeros(3), self._arm_xy)
        centre = arm_base_position(tool.base_pose, self._arm_xy)
        xy = tool.position[:2]
        p = self._p
        braking, radius = _BRAKING_SHARE * p.acceleration, max(now.radius, _SHORT_RADIUS)
        wanted = relative_velocity(
            xy,
            centre,
            approach_speed(target.radius - now.radius, p.gain, p.speed, braking),
            approach_speed(target.bearing - now.bearing, p.gain, p.bearing_rate, braking / radius),
            approach_speed(target.height - now.height, p.gain, p.speed, braking),
        )
        forward = relative_velocity(
            xy, centre, target.radius_rate, target.bearing_rate, target.height_rate
        )
        carried = carried_velocity(tool.position, tool.base_pose, tool.base_twist)
        return np.asarray(carried + self._smooth(forward + wanted, tool))

    def toward_point(
        self,
        point: Array,
        velocity: Array,
        tool: ToolMotion,
        climb: float,
        reach: float,
        arrival: Arrival | None,
    ) -> Array:
        """(3,) world velocity toward a point of the world [m/s].

        Args:
            point: (3,) where the tool shall be [m].
            velocity: (3,) the point's own velocity [m/s].
            tool: the tool now.
            climb: largest vertical correction [m/s].
            reach: the tool is not sent further from the arm's base axis [m].
            arrival: when and from where the point comes into range; None if it is.
        """
        error = point - tool.position
        in_reach = self._radius_of(point, tool) <= reach
        if in_reach and np.linalg.norm(error) < self._p.servo_distance:
            self._quintic = None
            carried = carried_velocity(tool.position, tool.base_pose, tool.base_twist)
            seen = velocity + self._servo(error, climb) - carried
            return np.asarray(carried + self._smooth(seen, tool))
        if self._p.form == "quintic":
            return self._quintic_velocity(point, velocity, tool, arrival)
        target = as_cylinder(point, velocity, tool.base_pose, tool.base_twist, self._arm_xy)
        return self.toward_cylinder(_within_reach(target, reach), tool)

    def turning(self, R_target: Array, R_tool: Array) -> Array:
        """(3,) angular velocity toward an orientation at rest, world axes [rad/s]."""
        error = rotation_error(R_target, R_tool)
        rate = self._p.turn_gain * error
        size = float(np.linalg.norm(rate))
        return np.asarray(rate * min(1.0, self._p.turn_rate / max(size, 1e-9)))

    def _radius_of(self, point: Array, tool: ToolMotion) -> float:
        centre = arm_base_position(tool.base_pose, self._arm_xy)
        return math.hypot(point[0] - centre[0], point[1] - centre[1])

    def _servo(self, error: Array, climb: float) -> Array:
        p = self._p
        braking = _BRAKING_SHARE * p.acceleration
        beside = math.hypot(error[0], error[1])
        level = approach_speed(beside, p.servo_gain, p.speed, braking) / max(beside, 1e-9)
        rise = approach_speed(error[2], p.servo_gain, climb, braking)
        return np.array([level * error[0], level * error[1], rise])

    def _smooth(self, wanted: Array, tool: ToolMotion) -> Array:
        """The velocity relative to the base, its change held to the acceleration limit.

        Kept along the radius, across it and upward: turning about the arm's base at a steady
        rate is no change, so that it leaves the limit to the approach.
        """
        centre = arm_base_position(tool.base_pose, self._arm_xy)
        radial = tool.position[:2] - centre
        ex, ey = radial / max(float(np.hypot(*radial)), 1e-9)
        R = np.array([[ex, ey, 0.0], [-ey, ex, 0.0], [0.0, 0.0, 1.0]])
        change = R @ wanted - self._relative
        size = float(np.linalg.norm(change))
        allowed = self._p.acceleration * self._dt
        self._relative = self._relative + change * min(1.0, allowed / max(size, 1e-9))
        return np.asarray(R.T @ self._relative)

    def _quintic_velocity(
        self, point: Array, velocity: Array, tool: ToolMotion, arrival: Arrival | None
    ) -> Array:
        """World velocity along a quintic in the base frame (MotM, arm controller).

        It starts from the *reference's* position, velocity and acceleration: started from
        zero acceleration at each step, it would stall and then leap.
        """
        if self._quintic is None:
            self._quintic = np.zeros((3, 3))
            self._quintic[0] = _in_base(tool.position, tool.base_pose)
        final_pose = tool.base_pose if arrival is None else arrival.base_pose
        end = np.zeros((3, 3))
        end[0] = _in_base(point, final_pose)
        end[1] = _velocity_seen_from_base(end[0], velocity, final_pose, tool.base_twist)
        wait = 0.0 if arrival is None else arrival.time
        duration = max(wait, self._least_duration(self._quintic, end))
        reference = quintic_state(quintic_coefficients(self._quintic, end, duration), self._dt)
        self._quintic = reference
        lag = _to_world(reference[0], tool.base_pose) - tool.position
        carried = carried_velocity(tool.position, tool.base_pose, tool.base_twist)
        moved = _rotate(reference[1], tool.base_pose[2])
        return np.asarray(carried + moved + self._p.servo_gain * lag)

    def _least_duration(self, start: Array, end: Array) -> float:
        """Least time in which speed and acceleration limits are kept [s]."""
        away = float(np.linalg.norm(end[0] - start[0]))
        duration = max(2.0 * self._dt, away / self._p.speed)
        while duration < _LONGEST_REACH:
            coefficients = quintic_coefficients(start, end, duration)
            states = [quintic_state(coefficients, duration * k / 8.0) for k in range(1, 8)]
            speed = max(float(np.linalg.norm(state[1])) for state in states)
            acceleration = max(float(np.linalg.norm(state[2])) for state in states)
            if speed <= self._p.speed and acceleration <= self._p.acceleration:
                break
            duration *= 1.2
        return duration


def _within_reach(target: CylinderPoint, reach: float) -> CylinderPoint:
    if target.radius <= reach:
        return target
    return replace(target, radius=reach, radius_rate=0.0)


def approach_speed(error: float, gain: float, largest: float, braking: float) -> float:
    """Speed toward zero error from which `braking` suffices to stop there.

    Proportional near the end, v = gain e, and v^2 = 2 braking (|e| - e0/2) beyond
    e0 = braking/gain^2, where both have one value and one slope.
    """
    distance = abs(error)
    linear = braking / gain**2
    if distance <= linear:
        speed = gain * distance
    else:
        speed = math.sqrt(2.0 * braking * (distance - 0.5 * linear))
    return math.copysign(min(speed, largest), error)


def _in_base(point: Array, base_pose: Array) -> Array:
    return np.array([*se2.to_local(base_pose, point[:2]), point[2]])


def _to_world(point: Array, base_pose: Array) -> Array:
    return np.array([*se2.transform_points(base_pose, point[:2]), point[2]])


def _rotate(vector: Array, heading: float) -> Array:
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2]])


def _velocity_seen_from_base(
    point_in_base: Array, velocity: Array, base_pose: Array, base_twist: Array
) -> Array:
    """The point's velocity in the moving base: (-v + omega y, -omega x, 0) if it rests."""
    own = _rotate(velocity, -base_pose[2])
    x, y, _ = point_in_base
    vx, vy, omega = base_twist
    return np.asarray(own + np.array([-vx + omega * y, -vy - omega * x, 0.0]))
