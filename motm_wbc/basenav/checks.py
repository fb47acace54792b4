"""Arguments that come from outside: refused in one line that names what is wrong, or given back."""

from __future__ import annotations

import math
import textwrap
from numbers import Real
from typing import TypeAlias

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

PoseLike: TypeAlias = Array | tuple[float, float, float | None]
"""x, y [m] and heading [rad]; None or NaN: free."""

FARTHEST = 1e7
"""No coordinate may be larger [m]: beyond, doubles are coarser than what counts as touching."""
_LARGEST_BASE = 10.0  # [m] from its origin: what is larger was not meant to be in metres
_SLOWEST, _FASTEST = 1e-3, 100.0  # [m/s, rad/s, m/s^2, rad/s^2]: bound the time of checks
_LEAST_BASE = 1e-6  # [m^2]
_BULGE = 1e-9  # [m^2] that a convex outline may lack to its hull, by rounding


def number(value: object, where: str) -> float:
    """A finite number.

    Args:
        value: as given.
        where: the argument's name in messages.

    Raises:
        InputError: it is not one.
    """
    found = _real(value)
    if not math.isfinite(found):
        raise InputError(f"must be a finite number, got {_said(value)}", where)
    return found


def positive(value: object, where: str) -> float:
    """A finite number > 0; see `number`."""
    found = _real(value)
    if not 0.0 < found < math.inf:
        raise InputError(f"must be a finite number > 0, got {_said(value)}", where)
    return found


def not_negative(value: object, where: str) -> float:
    """A finite number >= 0; see `number`."""
    found = _real(value)
    if not 0.0 <= found < math.inf:
        raise InputError(f"must be a finite number >= 0, got {_said(value)}", where)
    return found


def _said(value: object) -> str:
    """One line of it."""
    return textwrap.shorten(repr(value), 60)


def _real(value: object) -> float:
    """NaN: it is no real number, or too large a one."""
    try:
        return float(value) if isinstance(value, Real) else math.nan
    except OverflowError:
        return math.nan


def numbers(values: object, shape: tuple[int, ...], where: str) -> Array:
    """An array of one's own, of a shape; NaN and infinities are left in.

    Args:
        values: as given.
        shape: -1 stands for any length.
        where: the argument's name in messages.

    Raises:
        InputError: the values are not real numbers, or the shape is another one.
    """
    named = "(" + ", ".join("n" if length < 0 else str(length) for length in shape) + ")"
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biufO":
            raise TypeError
        array = np.array(given, dtype=float, order="C")
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"must be numbers, an array of shape {named}", where) from None
    fits = [want in (-1, got) for want, got in zip(shape, array.shape, strict=False)]
    if array.ndim != len(shape) or not all(fits):
        raise InputError(f"must have shape {named}, got {array.shape}", where)
    return array


def coordinates(values: object, shape: tuple[int, ...], where: str) -> Array:
    """Coordinates [m], finite and within `FARTHEST`; see `numbers`."""
    array = numbers(values, shape, where)
    if not np.isfinite(array).all():
        raise InputError("has a coordinate that is NaN or infinite", where)
    if np.abs(array).max(initial=0.0) > FARTHEST:
        raise InputError(f"has a coordinate beyond {FARTHEST:g} m", where)
    return array


def vector(values: object, size: int, where: str) -> Array:
    """A vector (size,) of finite numbers; see `numbers`."""
    array = numbers(values, (size,), where)
    if not np.isfinite(array).all():
        raise InputError(f"must be {size} finite numbers, got {array.tolist()}", where)
    return array


def pose_of(values: PoseLike, where: str) -> Array:
    """(3,) x, y [m] and heading [rad], NaN if it is free (None or NaN as given).

    Raises:
        InputError: the values are not three numbers, or the place is not finite or too far.
    """
    try:
        x, y, heading = values
    except (TypeError, ValueError):
        raise InputError("must be x, y and heading (None: free)", where) from None
    pose = numbers([x, y, math.nan if heading is None else heading], (3,), where)
    if not np.isfinite(pose[:2]).all() or np.isinf(pose[2]):
        raise InputError(f"must be finite numbers, got ({pose[0]:g}, {pose[1]:g})", where)
    if np.abs(pose[:2]).max() > FARTHEST:
        raise InputError(f"must lie within {FARTHEST:g} m, got ({pose[0]:g}, {pose[1]:g})", where)
    return pose


def footprint(points: object) -> Array:
    """The outline of a base, counter-clockwise.

    Args:
        points: (n, 2) convex, in the base frame, any winding [m].

    Raises:
        InputError: it is no convex polygon with an area, or as large as no base is.
    """
    outline = coordinates(points, (-1, 2), "footprint")
    if len(outline) < 3:
        raise InputError(f"must have three points at least, got {len(outline)}", "footprint")
    shape = Polygon(outline)
    if not shape.is_valid or shape.area < _LEAST_BASE:
        raise InputError("must be a simple polygon with an area", "footprint")
    if shape.convex_hull.area - shape.area > _BULGE * max(1.0, shape.area):
        raise InputError("must be convex", "footprint")
    farthest = float(np.hypot(outline[:, 0], outline[:, 1]).max())
    if farthest > _LARGEST_BASE:
        said = f"reaches {farthest:g} m from the base's origin, more than {_LARGEST_BASE:g} m"
        raise InputError(f"{said}: is it in metres?", "footprint")
    return polygons.counter_clockwise(outline)


def limits(values: BaseLimits) -> BaseLimits:
    """Limits of a base that can move and brake.

    Raises:
        InputError: one is no number within 0.001 and 100; `v_reverse` may be 0 as well.
    """
    for name in ("v_max", "omega_max", "a_max", "alpha_max", "v_reverse"):
        value = getattr(values, name)
        found = _real(value)
        if not (_SLOWEST <= found <= _FASTEST or (name == "v_reverse" and found == 0.0)):
            message = f"must be a number within {_SLOWEST:g} and {_FASTEST:g}, got {_said(value)}"
            raise InputError(message, name)
    return values


def checked_velocity(value: object, where: str) -> Array:
    """(2,) velocity of an obstacle [m/s].

    Raises:
        InputError: it is not two finite numbers, or faster than anything on a floor.
    """
    found = vector(value, 2, where)
    if np.hypot(*found) > _FASTEST:
        raise InputError(f"must not be above {_FASTEST:g} m/s, got {_said(value)}", where)
    return found
