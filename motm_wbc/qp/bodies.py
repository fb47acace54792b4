"""Named solids of the world, as the collision rows need them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.convex_parts import convex_parts
from motm_wbc.interfaces import MovingBody
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.scene.scenario import Scenario
from motm_wbc.scene.solids import Obstacle, Solid


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """An upright solid.

    Attributes:
        name: unique among the bodies.
        role: support, obstacle or object.
        outlines: convex counter-clockwise outlines (n_i, 2) in the body's frame that
            together are the solid's [m]; empty for a cylinder.
        radius: of a cylinder [m]; None for all else.
        bottom: height of the lower face in the world [m].
        top: height of the upper face in the world [m].
        pose: (3,) x [m], y [m], yaw [rad] in the world.
        velocity: (3,) in world axes [m/s, m/s, rad/s].
    """

    name: str
    role: SolidRole
    outlines: tuple[Array, ...]
    radius: float | None
    bottom: float
    top: float
    pose: Array
    velocity: Array


def body_from_solid(solid: Solid, role: SolidRole, bottom: float = 0.0) -> Body:
    """A solid of the scene where its file puts it, on the height `bottom` [m]."""
    outlines = () if solid.radius is not None else tuple(convex_parts(solid.outline_in_body()))
    velocity = solid.velocity if isinstance(solid, Obstacle) else (0.0, 0.0, 0.0)
    return Body(
        name=solid.name,
        role=role,
        outlines=outlines,
        radius=solid.radius,
        bottom=bottom,
        top=bottom + solid.top,
        pose=solid.pose,
        velocity=np.array(velocity),
    )


def shapes_from_scene(scenario: Scenario) -> tuple[Body, ...]:
    """All solids of a scenario as they are at its start: supports, obstacles, objects."""
    return (
        *(body_from_solid(solid, SolidRole.SUPPORT) for solid in scenario.supports),
        *(body_from_solid(solid, SolidRole.OBSTACLE) for solid in scenario.obstacles),
        *(
            body_from_solid(thing, SolidRole.OBJECT, scenario.support(thing.on).top)
            for thing in scenario.objects
        ),
    )


def moved_bodies(
    bodies: Sequence[Body],
    objects: Mapping[str, Array],
    moving: Mapping[str, MovingBody],
    without: str | None = None,
) -> tuple[Body, ...]:
    """The bodies where sensing sees them now. Those that did not move stay the same instances.

    Args:
        bodies: all bodies, from `shapes_from_scene`.
        objects: name -> T_world_object (4, 4); a tilted object counts as the upright solid
            of the height it takes.
        moving: name -> pose and velocity of each moving solid.
        without: a body to leave out, for example the object that is held.
    """
    return tuple(
        _moved(body, objects.get(body.name), moving.get(body.name))
        for body in bodies
        if body.name != without
    )


def _moved(body: Body, T_world_object: Array | None, motion: MovingBody | None) -> Body:
    if motion is not None:
        return replace(body, pose=motion.pose, velocity=motion.velocity)
    if T_world_object is None:
        return body
    half = 0.5 * _height_of_tilted(body, T_world_object)
    pose = np.array(
        [*T_world_object[:2, 3], math.atan2(T_world_object[1, 0], T_world_object[0, 0])]
    )
    bottom, top = float(T_world_object[2, 3]) - half, float(T_world_object[2, 3]) + half
    if np.array_equal(pose, body.pose) and (bottom, top) == (body.bottom, body.top):
        return body
    return replace(body, pose=pose, bottom=bottom, top=top)


def _height_of_tilted(body: Body, T_world_object: Array) -> float:
    """Vertical extent [m] of a body whose upright height is top - bottom."""
    lean = np.abs(T_world_object[2, :3])
    height = float(lean[2]) * (body.top - body.bottom)
    if body.radius is not None:
        return height + 2.0 * body.radius * math.hypot(lean[0], lean[1])
    corners = np.concatenate(body.outlines)
    return height + float(lean[:2] @ np.ptp(corners, axis=0))
