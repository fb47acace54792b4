"""The scene's solids, sent once, and the poses of those that move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import MovingBody
from motm_wbc.recording import colours, encoders
from motm_wbc.recording.timeline import Channel, TimeLine
from motm_wbc.scene.scenario import Scenario
from motm_wbc.scene.solids import Solid

ROOT = "/scene"
OBJECTS = f"{ROOT}/objects"
LABELS = f"{ROOT}/labels"


class SceneLayer:
    """Supports, obstacles and objects of a scenario."""

    def __init__(self, timeline: TimeLine, scenario: Scenario) -> None:
        """Send the solids' shapes."""
        self._objects: dict[str, Channel[Array]] = {}
        self._moving: dict[str, Channel[Array]] = {}
        self._places: dict[str, Array] = {}  # where each was seen last
        picked_from = {scenario.object(step.object).on for step in scenario.task}
        placed_on = {step.on for step in scenario.task if step.on is not None}
        for support in scenario.supports:
            colour = colours.OTHER_SUPPORT
            if support.name in placed_on:
                colour = colours.PLACE_SUPPORT
            elif support.name in picked_from:
                colour = colours.PICK_SUPPORT
            _send_resting(timeline, f"{ROOT}/{support.name}", support, colour)
        for obstacle in scenario.obstacles:
            path = f"{ROOT}/{obstacle.name}"
            if any(obstacle.velocity):
                timeline.static(path, shape(obstacle, colours.OBSTACLE))
                self._moving[obstacle.name] = timeline.channel(path, encoders.planar_poses)
                self._places[obstacle.name] = obstacle.pose
            else:
                _send_resting(timeline, path, obstacle, colours.OBSTACLE)
        for index, thing in enumerate(scenario.objects):
            path = f"{OBJECTS}/{thing.name}"
            colour = colours.OBJECTS[index % len(colours.OBJECTS)]
            timeline.static(path, shape(thing, colour, -0.5 * thing.top))
            self._objects[thing.name] = timeline.channel(path, encoders.poses)
            self._places[thing.name] = scenario.T_world_object(thing.name)
        _send_labels(timeline, scenario)
        _send_drops(timeline, scenario)
        _send_boundary(timeline, scenario)

    def add(
        self, time: float, objects: Mapping[str, Array], moving: Mapping[str, MovingBody]
    ) -> None:
        """Stamp all that can move at `time` [s].

        Args:
            time: instant of the frame [s].
            objects: name -> (4, 4) pose; those left out stay where they were.
            moving: name -> pose of a moving solid, likewise.
        """
        for name, pose in objects.items():
            self._places[name] = pose.copy()
        for name, body in moving.items():
            self._places[name] = body.pose.copy()
        for name, channel in (*self._objects.items(), *self._moving.items()):
            channel.add(time, self._places[name])


def shape(solid: Solid, colour: int, lift: float = 0.0) -> Any:
    """The solid as rerun draws it, in its own frame.

    Args:
        solid: box, cylinder or prism.
        colour: 0xRRGGBBAA.
        lift: height of its bottom above the frame's origin [m].
    """
    import rerun as rr

    middle = (0.0, 0.0, lift + 0.5 * solid.top)
    if solid.size is not None:
        return rr.Boxes3D(sizes=[solid.size], centers=[middle], colors=[colour], fill_mode="solid")
    if solid.radius is not None:
        return rr.Cylinders3D(
            lengths=[solid.top],
            radii=[solid.radius],
            centers=[middle],
            colors=[colour],
            fill_mode="solid",
        )
    vertices, _ = prism_mesh(solid.outline_in_body(), lift, lift + solid.top)
    return flat_shaded(vertices, colour)


def flat_shaded(vertices: Array, colour: int) -> Any:
    """A mesh of triangles (3 t, 3) [m] that share no corners, each with its own normal."""
    import rerun as rr

    corners = vertices.reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=np.arange(len(vertices)).reshape(-1, 3),
        vertex_normals=np.repeat(normals, 3, axis=0),
        albedo_factor=colour,
    )


def prism_mesh(
    outline: Array, bottom: float, top: float, holes: Sequence[Array] = ()
) -> tuple[Array, NDArray[np.intp]]:
    """Triangles of an upright prism, each with corners of its own, so that edges stay sharp.

    Args:
        outline: (n, 2) counter-clockwise simple polygon [m].
        bottom: height of the lower face [m].
        top: height of the upper face [m].
        holes: (n, 2) clockwise each [m].

    Returns:
        (3 t, 3) vertices [m] and (t, 3) indices, counter-clockwise seen from outside.
    """
    cover = shapely.constrained_delaunay_triangles(shapely.Polygon(outline, holes))
    caps = np.array([shapely.orient_polygons(part).exterior.coords[:3] for part in cover.geoms])
    upper = np.dstack([caps, np.full(caps.shape[:2], top)])
    lower = np.dstack([caps[:, ::-1], np.full(caps.shape[:2], bottom)])
    rings = [outline, *holes]
    here = np.concatenate(rings)
    there = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])

    def at(points: Array, height: float) -> Array:
        return np.column_stack([points, np.full(len(points), height)])

    first = np.stack([at(here, bottom), at(there, bottom), at(there, top)], axis=1)
    second = np.stack([at(here, bottom), at(there, top), at(here, top)], axis=1)
    vertices = np.concatenate([upper, lower, first, second]).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _send_resting(timeline: TimeLine, path: str, solid: Solid, colour: int) -> None:
    import rerun as rr

    x, y, yaw = solid.pose
    turn = rr.RotationAxisAngle(axis=(0.0, 0.0, 1.0), radians=yaw)
    timeline.static(
        path, shape(solid, colour), rr.Transform3D(translation=(x, y, 0.0), rotation=turn)
    )


def _send_labels(timeline: TimeLine, scenario: Scenario) -> None:
    """Names of what stands still, apart from the shapes, so that a view can do without them."""
    import rerun as rr

    resting = [solid for solid in scenario.obstacles if not any(solid.velocity)]
    named = [*scenario.supports, *resting]
    timeline.static(
        LABELS,
        rr.Points3D(
            [(*solid.footprint().mean(axis=0), 0.5 * solid.top) for solid in named],
            labels=[solid.name for solid in named],
            show_labels=True,
            colors=np.array([colours.LABEL], dtype=np.uint32),
            radii=[0.001],
        ),
    )


def _send_drops(timeline: TimeLine, scenario: Scenario) -> None:
    """A ring on the support where an object shall be put down."""
    import rerun as rr

    for index, step in enumerate(scenario.task):
        if step.at is None:
            continue
        pose = scenario.T_world_drop(step)
        half = 0.5 * scenario.object(step.object).top
        timeline.static(
            f"{ROOT}/drops/{index + 1}_{step.object}",
            rr.LineStrips3D(
                [ring(1.5 * half + 0.03, -half + 0.004) + pose[:3, 3]],
                colors=[colours.DROP],
                radii=[0.006],
            ),
        )


def _send_boundary(timeline: TimeLine, scenario: Scenario) -> None:
    import rerun as rr

    if scenario.boundary is not None:
        corners = np.array([*scenario.boundary, scenario.boundary[0]])
        line = np.column_stack([corners, np.full(len(corners), 0.01)])
        timeline.static(
            f"{ROOT}/boundary",
            rr.LineStrips3D([line], colors=[colours.OBSTACLE], radii=[0.015]),
        )


def ring(radius: float, height: float, sides: int = 72) -> Array:
    """(sides + 1, 3) closed circle about the vertical axis [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    return np.column_stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(sides + 1, height)]
    )
