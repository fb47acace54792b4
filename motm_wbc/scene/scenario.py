"""A scenario: where the robot starts, what stands there, and what shall be done."""

from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from shapely.geometry import Point as ShapelyPoint
from shapely.geometry import Polygon

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.files import Data, parse, read_toml
from motm_wbc.scene.finder import find_scenario
from motm_wbc.scene.solids import Name, Object, Obstacle, Point, Support, require_simple


class Start(Data):
    """Where the robot stands when the run begins."""

    pose: tuple[float, float, float]
    """x [m], y [m], heading [rad] of the base."""

    @model_validator(mode="after")
    def _is_in_radians(self) -> Start:
        if abs(self.pose[2]) > math.tau:
            raise ValueError(f"the heading is in radians, at most one turn (got {self.pose[2]})")
        return self


class Step(Data):
    """One step of the task: `pick` an object, or `place` the one that is held."""

    pick: Name | None = None
    """Object to be picked."""
    place: Name | None = None
    """Object to be placed: the one that the last pick took."""
    at: Point | None = None
    """Where the object shall stand [m]; needed with `place`."""
    on: Name | None = None
    """Support that `at` lies on; needed with `place`."""

    @model_validator(mode="after")
    def _is_one_step(self) -> Step:
        if (self.pick is None) == (self.place is None):
            raise ValueError("a step has either 'pick' or 'place'")
        if self.place is not None and (self.at is None or self.on is None):
            raise ValueError("a place step needs 'at' and 'on'")
        if self.pick is not None and (self.at is not None or self.on is not None):
            raise ValueError("'at' and 'on' belong to a place step")
        return self

    @property
    def object(self) -> str:
        """Name of the object that the step handles."""
        name = self.pick or self.place
        assert name is not None
        return name


class Sensing(Data):
    """Noise and delay of what the robot is told. All zero: it is told the truth."""

    delay: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0
    """Age of every sample when the controller gets it [s]; it is not compensated."""
    object_position_noise: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0
    """Standard deviation of a seen object's position, each axis [m]."""
    base_position_noise: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0
    """Standard deviation of the base's position, each axis [m]."""
    base_heading_noise: Annotated[float, Field(ge=0.0, le=0.1)] = 0.0
    """Standard deviation of the base's heading [rad]."""


class GraspFailure(Data):
    """When grasp attempts fail. Only a simulated plant may read this."""

    delay: Annotated[float, Field(ge=0.0, le=600.0)] = 0.0
    """Every attempt that starts less than this after the first one fails [s]."""
    probability: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Chance that an attempt fails, each by itself, after `delay` has passed."""


class Scenario(Data):
    """A scenario file's content."""

    name: Name
    description: str = ""
    """One line for listings."""
    start: Start
    supports: tuple[Support, ...] = Field(min_length=1)
    """Tables and trays."""
    obstacles: tuple[Obstacle, ...] = ()
    objects: tuple[Object, ...] = Field(min_length=1)
    task: tuple[Step, ...] = Field(min_length=1)
    """Steps in order, any number: pick, place, pick, place, ..."""
    boundary: tuple[Point, ...] | None = None
    """Outline that the base must stay inside of [m]; none: open floor."""
    sensing: Sensing = Sensing()
    grasp_failure: GraspFailure = GraspFailure()
    time_limit: Annotated[float, Field(gt=0.0, le=3600.0)] = 90.0
    """Simulated time after which the task counts as failed [s]."""

    @model_validator(mode="after")
    def _names_are_known(self) -> Scenario:
        solids = [*self.supports, *self.obstacles, *self.objects]
        names = [solid.name for solid in solids]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two solids are named {name!r}; names must differ")
        supports = {support.name for support in self.supports}
        for thing in self.objects:
            _require(thing.on, supports, f"support of object {thing.name!r}")
        held: str | None = None
        objects = {thing.name for thing in self.objects}
        for index, step in enumerate(self.task):
            where = f"task[{index}]"
            _require(step.object, objects, f"object in {where}")
            if step.on is not None:
                _require(step.on, supports, f"support in {where}")
            if step.pick is not None and held is not None:
                raise ValueError(f"{where} picks {step.pick!r} while {held!r} is held")
            if step.place is not None and step.place != held:
                raise ValueError(
                    f"{where} places {step.place!r}, but the gripper holds {held or 'nothing'}"
                )
            held = step.pick
        if held is not None:
            raise ValueError(f"the task ends with {held!r} in the gripper; place it somewhere")
        return self

    @model_validator(mode="after")
    def _boundary_is_simple(self) -> Scenario:
        if self.boundary is not None:
            require_simple(self.boundary, "boundary")
        return self

    @model_validator(mode="after")
    def _objects_are_apart(self) -> Scenario:
        for first, second in combinations(self.objects, 2):
            if first.on != second.on:
                continue
            shared = Polygon(first.footprint()).intersection(Polygon(second.footprint()))
            if shared.area > 1e-9:
                raise ValueError(f"objects {first.name!r} and {second.name!r} overlap")
        return self

    @model_validator(mode="after")
    def _things_stand_on_their_supports(self) -> Scenario:
        for thing in self.objects:
            if not _covers(self.support(thing.on), thing.position):
                raise ValueError(
                    f"object {thing.name!r} at {thing.position} is not over "
                    f"its support {thing.on!r}"
                )
        for index, step in enumerate(self.task):
            if step.on is None or step.at is None:
                continue
            if not _covers(self.support(step.on), step.at):
                raise ValueError(
                    f"task[{index}]: 'at' {step.at} is not over the support {step.on!r}"
                )
        return self

    def support(self, name: str) -> Support:
        """The support of that name."""
        return next(support for support in self.supports if support.name == name)

    def object(self, name: str) -> Object:
        """The object of that name."""
        return next(thing for thing in self.objects if thing.name == name)

    @property
    def start_pose(self) -> Array:
        """(3,) base pose at the start."""
        return np.array(self.start.pose)

    def T_world_object(self, name: str) -> Array:
        """(4, 4) pose of an object's centre at the start."""
        thing = self.object(name)
        return upright_pose(
            np.array([*thing.position, self.support(thing.on).top + 0.5 * thing.top]),
            thing.yaw,
        )

    def T_world_drop(self, step: Step) -> Array:
        """(4, 4) pose that the object's centre shall have after a place step."""
        assert step.at is not None and step.on is not None
        height = self.support(step.on).top + 0.5 * self.object(step.object).top
        return upright_pose(np.array([*step.at, height]), 0.0)


def upright_pose(position: Array, yaw: float) -> Array:
    """(4, 4) pose with the given position (3,) [m], turned by `yaw` [rad] about z."""
    c, s = math.cos(yaw), math.sin(yaw)
    pose = np.eye(4)
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[:3, 3] = position
    return pose


def load_scenario(name: str | Path) -> Scenario:
    """Read a scenario.

    Args:
        name: a name from the shipped `scenarios/`, or a path to a TOML file.

    Raises:
        InputError: file not found, not valid, or its content makes no sense.
    """
    path = find_scenario(name)
    return parse(Scenario, read_toml(path), str(path))


def _require(name: str, known: set[str], kind: str) -> None:
    if name not in known:
        raise ValueError(str(UnknownName(kind, name, known)))


def _covers(support: Support, point: Point) -> bool:
    return bool(Polygon(support.footprint()).covers(ShapelyPoint(point)))
