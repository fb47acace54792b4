"""The world as the Timed Elastic Band needs it; what stands still is prepared once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.footprint_check import EdgeMap, Outline, edge_map, grown_radius
from motm_wbc.basenav.obstacle import Solid
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.teb_obstacles import Parts, pack_parts
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array


@dataclass(frozen=True)
class Scene:
    """A world, prepared.

    Attributes:
        still: what stands still.
        boundary: outline of the floor, or None.
        edges: of what stands still, for the hard check.
        standing: convex parts of what stands still.
        moving: convex parts of what moves.
        parts: both.
    """

    still: tuple[Solid, ...]
    boundary: Array | None
    edges: EdgeMap
    standing: Parts
    moving: Parts
    parts: Parts


def scene_of(world: World, outline: Outline, margin: float, last: Scene | None = None) -> Scene:
    """Prepare a world; what stands still as in the last one is taken over from it.

    Args:
        world: the obstacles.
        outline: the footprint.
        margin: largest one that is asked for [m].
        last: the scene of one step ago.
    """
    still = tuple(solid for solid in world.solids if not solid.moves)
    moving = pack_parts([solid for solid in world.solids if solid.moves], None)
    if last is not None and _is_same(still, world.boundary, last):
        return Scene(
            last.still, last.boundary, last.edges, last.standing, moving,
            _both(last.standing, moving),
        )  # fmt: skip
    edges = edge_map(still_world(world).rings, world.bounded, grown_radius(outline, margin))
    standing = pack_parts(still, world.boundary)
    return Scene(still, world.boundary, edges, standing, moving, _both(standing, moving))


def still_world(world: World) -> World:
    """The world without what moves."""
    return world.still() if world.velocities.any() else world


def planner_of_still(planner: GlobalPlanner, world: World) -> GlobalPlanner:
    """A global planner like the given one, in a world without what moves.

    What moves is avoided by the band, in time; where it is now says little of where it will
    be when the base comes there.
    """
    speeds = planner.speeds
    return GlobalPlanner(
        still_world(world),
        speeds.forward,
        speeds.turning,
        planner.inflated.radius,
        speeds.backward,
    )


def _is_same(still: tuple[Solid, ...], boundary: Array | None, last: Scene) -> bool:
    """Whether these are the solids of a scene that stand still, and its boundary."""
    if boundary is None or last.boundary is None:
        if boundary is not last.boundary:
            return False
    elif not np.array_equal(boundary, last.boundary):
        return False
    return len(still) == len(last.still) and all(map(_is_where_it_was, still, last.still))


def _is_where_it_was(new: Solid, old: Solid) -> bool:
    """Whether a solid has not changed: a world that moves makes all of them anew."""
    if new.form is old.form:
        return np.array_equal(new.pose, old.pose)
    return len(new.rings) == len(old.rings) and all(map(np.array_equal, new.rings, old.rings))


def _both(first: Parts, second: Parts) -> Parts:
    return Parts(
        np.vstack([first.sides, second.sides]),
        np.concatenate([first.starts, first.starts[-1] + second.starts[1:]]),
        np.vstack([first.boxes, second.boxes]),
        np.vstack([first.velocities, second.velocities]),
    )
