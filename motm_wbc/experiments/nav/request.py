"""What a user asks of `motm nav`, checked: poses, footprint, limits, free start and goal."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.basenav.navigator import disc_radius
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.errors import InputError
from motm_wbc.experiments.nav.contacts import ContactAudit
from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.kinematics.loading import load_description

_FOOTPRINT = 0.01, 50.0  # [m]
_LIMIT = 1e-3, 100.0  # [m/s], [rad/s], [m/s^2], [rad/s^2]; slower, braking would take for ever


@dataclass(frozen=True, slots=True)
class Base:
    """A base without an arm.

    Attributes:
        footprint: (n, 2) convex outline in its frame [m].
        limits: speeds and accelerations.
    """

    footprint: Array
    limits: BaseLimits


def base_of(robot: str, footprint: str | None, changed: dict[str, float | None]) -> Base:
    """A robot's base, with a footprint and limits of the user's on top.

    Args:
        robot: its name or folder.
        footprint: `LENGTH,WIDTH` [m] of a rectangle about the origin; None: the robot's.
        changed: limits by name, None where the robot's holds.

    Raises:
        InputError: there is no such robot, or a number can't be used.
    """
    base = load_description(robot).base
    limits = base.limits()
    given = {name: value for name, value in changed.items() if value is not None}
    for name, value in given.items():
        if not (_LIMIT[0] <= value <= _LIMIT[1] or (value == 0.0 and name == "v_reverse")):
            legal = "{:g}..{:g}".format(*_LIMIT) + (" or 0" if name == "v_reverse" else "")
            raise InputError(f"must be in {legal}, got {value:g}", option(name))
    limits = dataclasses.replace(limits, **given)
    if footprint is None:
        return Base(base.footprint(), limits)
    length, width = numbers(footprint, ("LENGTH", "WIDTH"), "--footprint")
    if not all(_FOOTPRINT[0] <= side <= _FOOTPRINT[1] for side in (length, width)):
        raise InputError("must be two numbers in {:g}..{:g} m".format(*_FOOTPRINT), "--footprint")
    return Base(polygons.rectangle(length, width), limits)


def option(name: str) -> str:
    """The option that sets a limit."""
    return "--" + name.replace("_", "-")


def numbers(text: str, names: Sequence[str], where: str) -> list[float]:
    """Numbers separated by commas.

    Raises:
        InputError: there are more or fewer, or one is not finite.
    """
    wanted = ",".join(names)
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"must be {wanted}, got {text!r}", where) from None
    if len(values) != len(names) or not all(map(math.isfinite, values)):
        raise InputError(f"must be {wanted}, {len(names)} finite numbers, got {text!r}", where)
    return values


def pose(text: str, where: str, free_heading: bool = False) -> Array:
    """(3,) of `X,Y,HEADING`; with `free_heading` also of `X,Y`, its heading NaN.

    Raises:
        InputError: it has another form, or the heading looks like degrees.
    """
    if free_heading and text.count(",") == 1:
        return np.array([*numbers(text, ("X", "Y"), where), math.nan])
    if free_heading and text.count(",") != 2:
        raise InputError(f"must be X,Y or X,Y,HEADING, got {text!r}", where)
    x, y, heading = numbers(text, ("X", "Y", "HEADING"), where)
    if abs(heading) > math.tau + 1e-6:
        hint = f"{heading:g} degrees are {math.radians(heading):.4g}"
        raise InputError(f"the heading is in radians, {heading:g} is too large; {hint}", where)
    return np.array([x, y, heading])


def arriving(world: World, base: Base, start: Array, goal: Array) -> Array:
    """The goal, a free heading being that in which the global path arrives."""
    if not math.isnan(goal[2]):
        return goal
    limits = base.limits
    planner = GlobalPlanner(
        world, limits.v_max, limits.omega_max, disc_radius(base.footprint), limits.v_reverse
    )
    path = planner.route(start, goal)
    if path is None or len(path.points) < 2:
        return np.array([*goal[:2], start[2]])
    way = path.points[-1] - path.points[-2]
    return np.array([*goal[:2], math.atan2(*way[::-1]) + (math.pi if path.backward else 0.0)])


def check_free(world: World, base: Base, place: Array, where: str) -> None:
    """Refuse a pose at which the base would stand in something that doesn't move.

    Raises:
        InputError: it does, or it is not wholly on the floor.
    """
    if not ContactAudit(world.still(), base.footprint).look(0.0, place, 0.0, 0.0, 0.0):
        return
    x, y, heading = place
    at = f"at ({x:g}, {y:g}, {heading:.3g} rad) the base"
    if world.boundary is not None and not _stands_on(world.boundary, base, place):
        (x0, y0), (x1, y1) = world.boundary.min(axis=0), world.boundary.max(axis=0)
        legal = f"{x0:g}..{x1:g} m by {y0:g}..{y1:g} m"
        raise InputError(f"{at} is not wholly inside of the boundary (it spans {legal})", where)
    raise InputError(f"{at} is in collision", where)


def _stands_on(boundary: Array, base: Base, place: Array) -> bool:
    return bool(Polygon(boundary).covers(Polygon(polygons.place(base.footprint, place))))
