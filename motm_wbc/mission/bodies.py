"""The scene as the whole-body controller sees it at one instant."""

from __future__ import annotations

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import WorldState
from motm_wbc.qp import Body, HeldObject, moved_bodies, shapes_from_scene
from motm_wbc.scene.scenario import Scenario
from motm_wbc.scene.solids import Object


class SceneBodies:
    """All solids of a scenario, moved to where they are seen."""

    def __init__(self, scenario: Scenario) -> None:
        """Set up from the scenario."""
        self._scenario = scenario
        self._bodies = shapes_from_scene(scenario)

    def at(self, world: WorldState, held: str | None) -> tuple[Body, ...]:
        """The bodies now, without the one that is held."""
        self._bodies = moved_bodies(self._bodies, world.objects, world.moving)
        return tuple(body for body in self._bodies if body.name != held)

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


def _box(thing: Object) -> Array:
    """(3,) extents of the box about an object, in the object's axes [m]."""
    outline = thing.outline_in_body()
    half = np.abs(outline).max(axis=0)
    return np.array([*(2.0 * half), thing.top])
