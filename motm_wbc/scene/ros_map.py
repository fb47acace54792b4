"""Maps of ROS: an occupancy grid as a `.yaml` and an image, as map_server reads them.

A pixel of shade s in 0..1 (white 1) is occupied to p = 1 - s, or p = s where `negate` is
set; p > occupied_thresh is occupied, p < free_thresh free. What is between is unknown in
mode `trinary`, and occupied in part in mode `scale`, where transparent pixels are unknown.
Here only free and occupied matter: what is neither counts as `unknown` says. The origin is
the pose of the lower left pixel's lower left corner; unlike in many programs, its yaw counts.
Outside of the image nothing is known, so its rectangle is the boundary.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, ConfigDict, Field, model_validator

from motm_wbc.errors import InputError
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.files import parse, read_text
from motm_wbc.scene.floor_map import FloorMap, MapArea, Unknown
from motm_wbc.scene.grid_outline import Mask, cell_regions

Levels: TypeAlias = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
_TOLERANCE = 1.42  # cells: the corners of a straight wall lie in a strip of at most sqrt(2)
_SIXTEEN_BITS = ("I", "I;16", "I;16B")


class RosMapFile(BaseModel):
    """Keys of the `.yaml`; others are left alone."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    image: str
    """Name of the image, beside the file or absolute."""
    resolution: Annotated[float, Field(gt=0.0, le=10.0)]
    """Side of a pixel [m]."""
    origin: tuple[float, float, float]
    """x [m], y [m], yaw [rad] of the lower left corner."""
    negate: bool = False
    """White is occupied instead of black."""
    occupied_thresh: Share = 0.65
    """Above it a pixel is occupied."""
    free_thresh: Share = 0.196
    """Below it a pixel is free."""
    mode: Literal["trinary", "scale"] = "trinary"
    """What a pixel between the two is."""

    @model_validator(mode="after")
    def _fits_together(self) -> RosMapFile:
        if self.free_thresh > self.occupied_thresh:
            raise ValueError("free_thresh must not be greater than occupied_thresh")
        return self


def read_ros_map(path: Path, unknown: Unknown = "blocked") -> FloorMap:
    """Read a map.

    The polygons contain the blocked cells and lie at most 1.42 cells outside of them.

    Args:
        path: of the `.yaml`.
        unknown: what cells count as that are neither free nor occupied.

    Raises:
        InputError: the file or its image can't be used.
    """
    try:
        content = yaml.safe_load(read_text(path))
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(f"is not valid YAML: {error}", str(path)) from None
    if not isinstance(content, dict):
        raise InputError("must have the keys image, resolution and origin", str(path))
    file = parse(RosMapFile, content, str(path))
    occupied, free = _classified(file, path.parent / file.image)
    blocked = occupied if unknown == "free" else ~free
    if blocked.all():
        raise InputError("has no free cell", str(path))
    columns, rows = blocked.shape
    corners = np.array([[0.0, 0.0], [columns, 0.0], [columns, rows], [0.0, rows]])
    things = tuple(
        MapArea(
            f"{path}: area {index}",
            _placed(file, region.outline),
            tuple(_placed(file, hole) for hole in region.holes),
        )
        for index, region in enumerate(cell_regions(blocked, _TOLERANCE))
    )
    return FloorMap(things, _placed(file, corners))


def _placed(file: RosMapFile, cells: Array) -> Array:
    """Points in cells, in world axes [m]."""
    return se2.transform_points(np.array(file.origin), file.resolution * cells)


def _classified(file: RosMapFile, image: Path) -> tuple[Mask, Mask]:
    """(columns, rows) each, row 0 the lowest: what is occupied, and what is free."""
    levels, opaque = _levels(image)
    white = 65535 if levels.dtype.itemsize > 1 else 255
    shades = np.arange(white + 1)
    occupancy = (shades if file.negate else white - shades) / white
    occupied = (occupancy > file.occupied_thresh)[levels]
    free = (occupancy < file.free_thresh)[levels]
    if file.mode == "scale":
        occupied, free = occupied & opaque, free & opaque
    return occupied[::-1].T, free[::-1].T


def _levels(path: Path) -> tuple[Levels, Mask]:
    """Grey levels of 8 or 16 bits, and which pixels are opaque; row 0 the uppermost.

    Raises:
        InputError: there is no such image, or it can't be read.
    """
    try:
        with warnings.catch_warnings():  # a large image is legal, as far as Pillow opens it
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            opened = Image.open(path)
        with opened as image:
            if image.mode in _SIXTEEN_BITS:
                deep = np.asarray(image).astype(np.uint16)
                return deep, np.ones(deep.shape, dtype=bool)
            pixels = np.asarray(image.convert("LA"))
    except FileNotFoundError:
        raise InputError("no such image", str(path)) from None
    except (OSError, ValueError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise InputError(f"can't be read as an image: {error}", str(path)) from None
    return pixels[..., 0], np.asarray(pixels[..., 1] == 255)
