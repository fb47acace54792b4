"""The scene as the whole-body controller sees it at one instant."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import WorldState
from motm_wbc.qp import Body, HeldObject, moved_bodies, shapes_from_scene
from motm_wbc.scene.scenario import Scenario
from motm_wbc.scene.solids import Object

_STILL = 1e-5  # [m] and [rad]


class SceneBodies:
    """All solids of a scenario, moved to where they are seen."""

    def __init__(self, scenario: Scenario) -> None:
        """Set up from the scenario."""
        self._scenario = scenario
        self._standing = shapes_from_scene(scenario)
        self._last = {body.name: body for body in self._standing}

    def at(self, world: WorldState, held: str | None) -> tuple[Body, ...]:
        """The bodies now, without the one that is held.

        A body that has hardly moved stays the same instance, so that what the controller has
        prepared for it stays valid.
        """
        for body in moved_bodies(self._standing, world.objects, world.moving):
            if not _is_there(self._last[body.name], body):
                self._last[body.name] = body
        return tuple(body for body in self._last.values() if body.name != held)

    def held(self, name: str | None, T_tool_held: Array | None, touch: bool) -> HeldObject | None:
        """The object in the hand, as a part of it.

        Args:
            name: of the object; None for an empty hand.
            T_tool_held: (4, 4) its pose in the tool frame.
            touch: it may touch supports now.
        """
        if name is None or T_tool_held is None:
            return None
        return HeldObject(name, _box(self._scenario.object(name)), T_tool_held, touch)


def _is_there(last: Body, now: Body) -> bool:
    """Whether two bodies of one name stand within a hundredth of a millimetre of each other."""
    apart = np.abs(now.pose - last.pose).max()
    heights = max(abs(now.bottom - last.bottom), abs(now.top - last.top))
    same = bool(np.array_equal(now.velocity, last.velocity))
    return same and max(float(apart), heights) <= _STILL


def _box(thing: Object) -> Array:
    """(3,) extents of the box about an object, in the object's axes [m]."""
    outline = thing.outline_in_body()
    half = np.abs(outline).max(axis=0)
    return np.array([*(2.0 * half), thing.top])
