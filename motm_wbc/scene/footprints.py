"""What stands in the base's way: the outlines of a scene's solids on the floor."""

from __future__ import annotations

from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.scenario import Scenario


def base_obstacles(scenario: Scenario) -> dict[str, Array]:
    """Name -> (n, 2) counter-clockwise outline [m] of everything that stands on the floor."""
    return {solid.name: solid.footprint() for solid in (*scenario.supports, *scenario.obstacles)}
