"""Collision shapes of a URDF as convex point sets that contain them, link by link."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.arm_tree import origin_pose

_SIDES = 24  # of the prism that stands for a cylinder; it is 0.9 % wider


def collision_hulls(urdf_path: Path) -> Mapping[str, tuple[Array, ...]]:
    """Corners of the convex shapes that each link's collision shapes lie in.

    A box is its own corners, a mesh its convex hull; cylinders and spheres become
    polyhedra about them.

    Args:
        urdf_path: a URDF whose meshes have absolute paths.

    Returns:
        Link name -> arrays (n, 3) in the link frame [m], one a collision element; links
        without any are left out.

    Raises:
        InputError: a shape is of no known kind, or its mesh can't be read.
    """
    hulls = {}
    for link in ElementTree.parse(urdf_path).getroot().iter("link"):
        shapes = tuple(_hull(shape, urdf_path) for shape in link.iter("collision"))
        if shapes:
            hulls[link.attrib["name"]] = shapes
    return hulls


def _hull(collision: ElementTree.Element, urdf_path: Path) -> Array:
    geometry = collision.find("geometry")
    shape = geometry[0] if geometry is not None and len(geometry) else None
    maker = _MAKERS.get(shape.tag) if shape is not None else None
    if shape is None or maker is None:
        kind = "nothing" if shape is None else shape.tag
        raise InputError(f"collision shape {kind!r}; legal: {', '.join(_MAKERS)}", str(urdf_path))
    T_link_shape = origin_pose(collision)
    corners = maker(shape.attrib, urdf_path)
    return np.asarray(corners @ T_link_shape[:3, :3].T + T_link_shape[:3, 3])


def _numbers(text: str) -> Array:
    return np.array([float(part) for part in text.split()])


def prism(outline: Array, bottom: float, top: float) -> Array:
    """(2 n, 3) corners of the upright prism over an outline (n, 2) [m]."""
    return np.vstack(
        [np.column_stack([outline, np.full(len(outline), level)]) for level in (bottom, top)]
    )


def _box(attributes: Mapping[str, str], _: Path) -> Array:
    length, width, height = _numbers(attributes["size"])
    return prism(polygons.rectangle(length, width), -0.5 * height, 0.5 * height)


def _cylinder(attributes: Mapping[str, str], _: Path) -> Array:
    half = 0.5 * float(attributes["length"])
    return prism(polygons.disc(float(attributes["radius"]), _SIDES), -half, half)


def _sphere(attributes: Mapping[str, str], _: Path) -> Array:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    inner = float(np.min(np.einsum("ij,ij->i", ball.face_normals, ball.triangles[:, 0])))
    return np.asarray(ball.vertices, dtype=float) * (float(attributes["radius"]) / inner)


def _mesh(attributes: Mapping[str, str], urdf_path: Path) -> Array:
    import trimesh

    name = attributes["filename"].removeprefix("file://")
    try:
        mesh = trimesh.load_mesh(urdf_path.parent / name)
    except (OSError, ValueError) as error:
        raise InputError(f"mesh {name} can't be read: {error}", str(urdf_path)) from None
    scale = _numbers(attributes.get("scale", "1 1 1"))
    return np.asarray(mesh.convex_hull.vertices, dtype=float) * scale


_MAKERS: Mapping[str, Callable[[Mapping[str, str], Path], Array]] = {
    "box": _box,
    "cylinder": _cylinder,
    "sphere": _sphere,
    "mesh": _mesh,
}
