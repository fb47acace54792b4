"""Placing: lift, carry, reach, set down, let go, retreat."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import Event
from motm_wbc.mission.cylinder import CylinderPoint
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.stages import Moment, Outcome, Stage, ToolOrder, is_due

_TOUCHING_LIFT = 0.01  # [m] of lift up to which an object may touch the support it leaves


_GRIPPING = 0.0  # [m] commanded width while an object is held: the force holds it
_HOLDING = (Stage.LIFT, Stage.TRAVEL, Stage.REACH, Stage.DESCEND)


class PlaceMachine:
    """Stages of placing the held object; one instance for one place step."""

    def __init__(
        self,
        name: str,
        T_world_drop: Array,
        T_grip_object: Array,
        *,
        closed_width: float,
        open_width: float,
        grasp: GraspParameters,
        reach: ReachParameters,
    ) -> None:
        """Set up.

        Args:
            name: of the object.
            T_world_drop: (4, 4) where the object's centre shall be.
            T_grip_object: (4, 4) the object in the grip frame.
            closed_width: of the gripper about the object [m].
            open_width: of the open gripper [m].
            grasp: distances and times.
            reach: speeds.
        """
        self.name = name
        self.stage = Stage.LIFT
        self._drop = T_world_drop
        self._T_grip_object = T_grip_object
        self._closed_width = closed_width
        self._open_width = open_width
        self._p = grasp
        self._reach = reach
        self._felt = math.inf
        self._start: Array | None = None
        self._retreat_from: Array | None = None

    @property
    def released(self) -> bool:
        """The fingers have opened over the drop."""
        return self.stage in (Stage.RETREAT, Stage.DONE)

    def update(self, now: Moment, carry: CylinderPoint) -> Outcome:
        """Advance to this moment and say what the arm shall do.

        Args:
            now: the moment, with the grip frame as its tool frame.
            carry: where the tool carries the object, in the moving arm's coordinates.
        """
        events = self._advance(now)
        return Outcome(self._order(now, carry), self.stage, events)

    def _advance(self, now: Moment) -> tuple[Event, ...]:
        if self._start is None:
            self._start = now.tool_position.copy()
            self._felt = now.time
        if self.stage in _HOLDING and self._has_slipped(now):
            self.stage = Stage.LOST
            return (Event(now.time, "lost", f"{self.name} slipped out of the hand", "warn"),)
        if self.stage is Stage.LIFT:
            if now.tool_position[2] - self._start[2] >= self._p.lift:
                self.stage = Stage.TRAVEL
        elif self.stage is Stage.TRAVEL and is_due(now):
            self.stage = Stage.REACH
        elif self.stage in (Stage.REACH, Stage.DESCEND):
            return self._lower(now)
        elif self.stage is Stage.RELEASE:
            return self._open(now)
        elif self.stage is Stage.RETREAT:
            assert self._retreat_from is not None
            if now.tool_position[2] - self._retreat_from[2] >= 0.9 * self._p.retreat:
                self.stage = Stage.DONE
        return ()

    def _has_slipped(self, now: Moment) -> bool:
        """The fingers have felt nothing for a while, though they should hold the object."""
        if now.fingers_loaded:
            self._felt = now.time
        return now.time - self._felt > self._p.slip_time

    def _lower(self, now: Moment) -> tuple[Event, ...]:
        offset = now.tool_position - self._release_point(now)
        beside = math.hypot(offset[0], offset[1])
        if self.stage is Stage.REACH:
            if beside <= self._p.align_distance:
                self.stage = Stage.DESCEND
            return ()
        if beside > self._p.lost_distance:
            self.stage = Stage.REACH
            return ()
        still = float(np.linalg.norm(now.tool_velocity)) <= self._p.release_speed
        if float(np.linalg.norm(offset)) <= self._p.release_distance and still:
            self.stage = Stage.RELEASE
            return (Event(now.time, "release", f"{self.name} is let go"),)
        return ()

    def _open(self, now: Moment) -> tuple[Event, ...]:
        opened = self._closed_width + self._p.opened_share * (self._open_width - self._closed_width)
        if now.gripper_width < opened:
            return ()
        self.stage = Stage.RETREAT
        self._retreat_from = now.tool_position.copy()
        return (Event(now.time, "dropped", f"{self.name} stands at its place"),)

    def _release_point(self, now: Moment) -> Array:
        """(3,) where the tool is when the object stands just over its place.

        The object keeps the yaw that it has in the hand.
        """
        R_world_grip = now.T_world_tool[:3, :3]
        above = np.array([0.0, 0.0, self._p.release_height])
        return np.asarray(self._drop[:3, 3] + above - R_world_grip @ self._T_grip_object[:3, 3])

    def _order(self, now: Moment, carry: CylinderPoint) -> ToolOrder:
        assert self._start is not None
        target = self._drop.copy()
        lifted = now.tool_position[2] - self._start[2]
        touching = self.stage is Stage.LIFT and lifted < _TOUCHING_LIFT
        point: Array | None = self._release_point(now)
        cylinder = None
        climb, width = self._p.descent_speed, _GRIPPING
        up = np.array([0.0, 0.0, 1.0])
        if self.stage is Stage.LIFT:
            point = self._start + (self._p.lift + _TOUCHING_LIFT) * up
        elif self.stage is Stage.TRAVEL:
            point, cylinder = None, carry
        elif self.stage is Stage.REACH:
            assert point is not None
            point = point + self._p.hover * up
            climb = self._reach.speed
        elif self.stage in (Stage.DESCEND, Stage.RELEASE):
            touching = True
        if self.stage in (Stage.RELEASE, Stage.RETREAT, Stage.DONE, Stage.LOST):
            width = self._open_width
        if self.stage in (Stage.RETREAT, Stage.DONE):
            assert self._retreat_from is not None
            point = self._retreat_from + self._p.retreat * up
        return ToolOrder(point, cylinder, None, climb, width, target, touching)
