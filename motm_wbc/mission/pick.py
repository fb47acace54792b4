"""Picking: reach, hover, descend, close, and again until a grasp holds."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event
from motm_wbc.kinematics.rotations import rotation_error
from motm_wbc.mission.orientation import top_down, yaw_of
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.stages import Moment, Outcome, Stage, ToolOrder, is_due, rest_order
from motm_wbc.mission.tool_yaw import YawRange, choose_yaw, yaw_on_the_way

_NEAR = 0.15  # [m] beside the object within which lowered fingers could push it


class PickMachine:
    """Stages of picking one object; one instance for one pick step."""

    def __init__(
        self,
        name: str,
        *,
        grasp_height: float,
        yaws: Sequence[float],
        yaw_range: YawRange,
        open_width: float,
        opened_width: float,
        closing_time: float,
        grasp: GraspParameters,
        reach: ReachParameters,
    ) -> None:
        """Set up.

        Args:
            name: of the object.
            grasp_height: of the grasp above the object's centre [m].
            yaws: of the grip frame relative to the object that fit; none: any.
            yaw_range: what the arm can hold.
            open_width: of the gripper [m].
            opened_width: from which on it counts as open [m].
            closing_time: what closing on the object takes [s].
            grasp: distances and times.
            reach: speeds.
        """
        self.name = name
        self.stage = Stage.TRAVEL
        self.attempts = 0
        self.first_attempt: float | None = None
        self.failed = False
        self._grasp_height = grasp_height
        self._yaws = yaws
        self._yaw_range = yaw_range
        self._open_width = open_width
        self._opened_width = opened_width
        self._closing_time = closing_time
        self._p = grasp
        self._reach = reach
        self._yaw: float | None = None
        self._attempt_start = -math.inf

    def update(self, now: Moment, sweep: Array) -> Outcome:
        """Advance to this moment and say what the arm shall do.

        Args:
            now: the moment, with the grip frame as its tool frame.
            sweep: (k,) world bearings of the object along the pass [rad].
        """
        events = self._advance(now, sweep)
        if self.stage is Stage.TRAVEL:
            return Outcome(rest_order(self._open_width), self.stage, events)
        return Outcome(self._order(now), self.stage, events)

    def _advance(self, now: Moment, sweep: Array) -> tuple[Event, ...]:
        if self.stage is Stage.TRAVEL and is_due(now):
            self._choose(now, sweep)
            self.stage = Stage.REACH
        elif self.stage is Stage.REACH:
            if self._aligned(now, self._p.align_distance, self._p.align_angle):
                self.stage = Stage.DESCEND
        elif self.stage in (Stage.DESCEND, Stage.REOPEN):
            return self._try(now, sweep)
        elif self.stage is Stage.CLOSE:
            return self._judge(now)
        return ()

    def _try(self, now: Moment, sweep: Array) -> tuple[Event, ...]:
        """Start an attempt when everything is still, or go back to hovering when it is lost."""
        if self.stage is Stage.REOPEN and now.gripper_width < self._opened_width:
            return ()
        if self._beside(now) > self._p.lost_distance:
            self.stage = Stage.REACH
            self._choose(now, sweep)
            return ()
        self.stage = Stage.DESCEND
        ready = (
            float(np.linalg.norm(self._offset(now))) <= self._p.attempt_distance
            and self._angle(now) <= self._p.attempt_angle
            and float(np.linalg.norm(now.tool_velocity)) <= self._p.attempt_speed
            and now.time - self._attempt_start >= self._p.attempt_period - 1e-9
        )
        if not ready:
            return ()
        self.stage = Stage.CLOSE
        self.attempts += 1
        self._attempt_start = now.time
        if self.first_attempt is None:
            self.first_attempt = now.time
        return (Event(now.time, "attempt", f"attempt {self.attempts} on {self.name}"),)

    def _judge(self, now: Moment) -> tuple[Event, ...]:
        elapsed = now.time - self._attempt_start
        if now.fingers_loaded and elapsed >= self._closing_time - 1e-9:
            self.stage = Stage.DONE
            return (Event(now.time, "grasped", f"{self.name} is held"),)
        if elapsed > self._closing_time + self._p.patience:
            self.stage = Stage.REOPEN
            self.failed = True
            text = f"attempt {self.attempts} on {self.name} closed on nothing"
            return (Event(now.time, "missed", text, "warn"),)
        return ()

    def _choose(self, now: Moment, sweep: Array) -> None:
        object_yaw = math.atan2(now.T_world_object[1, 0], now.T_world_object[0, 0])
        current = yaw_of(now.T_world_tool[:3, :3])
        choices = [object_yaw + yaw for yaw in self._yaws]
        self._yaw = choose_yaw(choices, sweep, self._yaw_range, current)

    def _turning_to(self, now: Moment, yaw: float) -> float:
        current = yaw_of(now.T_world_tool[:3, :3])
        return yaw_on_the_way(yaw, current, now.target_bearing, now.tool_bearing, self._yaw_range)

    def _grasp_point(self, now: Moment) -> Array:
        return np.asarray(now.T_world_object[:3, 3] + np.array([0.0, 0.0, self._grasp_height]))

    def _offset(self, now: Moment) -> Array:
        return np.asarray(now.tool_position - self._grasp_point(now))

    def _beside(self, now: Moment) -> float:
        offset = self._offset(now)
        return math.hypot(offset[0], offset[1])

    def _angle(self, now: Moment) -> float:
        assert self._yaw is not None
        error = rotation_error(top_down(self._yaw), now.T_world_tool[:3, :3])
        return float(np.linalg.norm(error))

    def _is_low_beside(self, now: Moment) -> bool:
        """The fingers are down beside the object: they rise before they go sideways."""
        low = self._offset(now)[2] < 0.5 * self._p.hover
        return low and self._p.lost_distance < self._beside(now) < _NEAR

    def _aligned(self, now: Moment, distance: float, angle: float) -> bool:
        return self._beside(now) <= distance and self._angle(now) <= angle

    def _order(self, now: Moment) -> ToolOrder:
        hovering = self.stage is Stage.REACH
        point = self._grasp_point(now)
        hover = point + np.array([0.0, 0.0, self._p.hover])
        if self._is_low_beside(now):
            hover[:2] = now.tool_position[:2]
        target = np.eye(4)
        assert self._yaw is not None
        target[:3, :3] = top_down(self._yaw)
        target[:3, 3] = point
        closing = self.stage in (Stage.CLOSE, Stage.DONE)
        return ToolOrder(
            point=hover if hovering else point,
            cylinder=None,
            yaw=self._turning_to(now, self._yaw),
            climb=self._reach.speed if hovering else self._p.descent_speed,
            gripper_width=0.0 if closing else self._open_width,
            T_world_target=target,
        )
