"""The audit: every run checked for contact, independently of all that controls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import fcl
import numpy as np

from motm_wbc.audit.broad_phase import Mask, SpherePairs, squared_gaps
from motm_wbc.audit.episodes import Episode, EpisodeLog
from motm_wbc.audit.parameters import AuditParameters
from motm_wbc.audit.robot import RobotBodies
from motm_wbc.audit.rules import checked_pairs, may_rest
from motm_wbc.audit.scene import SceneBodies, SceneBody
from motm_wbc.geometry.arrays import Array
from motm_wbc.interfaces import GroundTruth
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.scene.scenario import Scenario

_FLOOR = "floor"


@dataclass(frozen=True, slots=True)
class Clearances:
    """Distances at one instant, to supports and obstacles; zero in contact.

    Attributes:
        time: [s].
        base: of the base's body [m].
        arm: of arm, hand and fingers, and of a held object to obstacles [m].
    """

    time: float
    base: float
    arm: float


@dataclass(frozen=True, slots=True)
class AuditResult:
    """What the audit found in a run.

    Attributes:
        collisions: number of episodes of contact.
        episodes: the episodes, by their start.
        min_base_clearance_m: least distance of the base to supports and obstacles [m].
        min_arm_clearance_m: the same of arm, hand, fingers and held object [m].
    """

    collisions: int
    episodes: tuple[Episode, ...]
    min_base_clearance_m: float
    min_arm_clearance_m: float


class Audit:
    """Looks for contact at every physics step and measures distances now and then.

    Its shapes contain the robot's collision meshes. It shares the footprint and the classes
    of pairs with what controls the robot, and no code that judges them.

    Args:
        model: the robot.
        scenario: the world.
        parameters: what counts as contact.
    """

    def __init__(
        self, model: RobotModel, scenario: Scenario, parameters: AuditParameters | None = None
    ) -> None:
        self._parameters = parameters or AuditParameters()
        self._model = model
        self._robot = RobotBodies(model, self._parameters.skin)
        self._scene = SceneBodies(scenario)
        self._masks = {
            held: checked_pairs(self._robot, self._scene, held)
            for held in (None, *(thing.name for thing in scenario.objects))
        }
        roles = [body.role for body in self._scene.bodies]
        self._is_standing = np.array([role is not SolidRole.OBJECT for role in roles])
        self._is_support = np.array([role is SolidRole.SUPPORT for role in roles])
        self._margin = 2.0 * self._parameters.skin
        self._self_pairs = SpherePairs(self._robot.self_pairs, self._robot.radii, self._margin)
        # The last row is the held object; without one no pair of that row is checked.
        self._centres = np.zeros((len(self._robot.bodies) + 1, 3))
        self._radii = np.append(self._robot.radii, 0.0)
        self._limits = {held: self._limit(held) for held in self._masks}
        self._log = EpisodeLog(self._parameters.episode_gap)
        self._samples = 0
        self._latest = Clearances(0.0, math.inf, math.inf)
        self._least_base = math.inf
        self._least_arm = math.inf

    def observe(self, truth: GroundTruth) -> None:
        """Take the state after a physics step."""
        at = self._model.configuration(truth.base_pose, truth.q, truth.gripper_width)
        self._scene.update(truth)
        held = None if truth.held is None else self._body(truth.held)
        self._place_spheres(at, held)
        squared = squared_gaps(self._centres, self._scene.lower, self._scene.upper)
        near = squared <= self._limits[truth.held]
        if near.any():
            self._check_scene(at, held, near, truth.time)
        self._check_robot(at, truth.time)
        self._check_floor(at, held, truth.time)
        if truth.time >= self._samples / self._parameters.clearance_rate - 1e-9:
            self._samples = math.floor(truth.time * self._parameters.clearance_rate + 1e-6) + 1
            gaps = np.sqrt(squared) - self._radii[:, None]
            self._measure(at, held, gaps, self._masks[truth.held], truth.time)

    def result(self) -> AuditResult:
        """What was found so far."""
        episodes = self._log.episodes()
        return AuditResult(len(episodes), episodes, self._least_base, self._least_arm)

    def clearances(self) -> Clearances:
        """The latest measurement."""
        return self._latest

    def _limit(self, held: str | None) -> Array:
        """(p + 1, s) squared gaps up to which a pair is looked at; below zero: never."""
        radii = self._radii.copy()
        if held is not None:
            radii[-1] = self._body(held).sphere.radius
        return np.where(self._masks[held], ((radii + self._margin) ** 2)[:, None], -1.0)

    def _body(self, name: str) -> SceneBody:
        return self._scene.bodies[self._scene.index[name]]

    def _place_spheres(self, at: Configuration, held: SceneBody | None) -> None:
        """Spheres about the robot's bodies and, last, the held object (or nothing)."""
        self._centres[:-1] = self._robot.centres(at)
        self._radii[-1] = 0.0
        if held is not None:
            self._centres[-1] = held.centre()
            self._radii[-1] = held.sphere.radius

    def _check_scene(
        self, at: Configuration, held: SceneBody | None, near: Mask, time: float
    ) -> None:
        for i, j in zip(*(side.tolist() for side in near.nonzero()), strict=True):
            solid = self._scene.bodies[j]
            if i < len(self._robot.bodies):
                name, bodies = self._robot.bodies[i].name, [self._robot.bodies[i].grown(at)]
            else:
                assert held is not None
                name, bodies = held.name, held.pieces
                is_support = solid.role is SolidRole.SUPPORT
                if is_support and may_rest(held, solid, self._parameters.lift):
                    continue
            depth = _depth(bodies, solid.pieces)
            if depth is not None:
                self._log.touch(name, solid.name, time, depth)

    def _check_robot(self, at: Configuration, time: float) -> None:
        for i, j in self._self_pairs.near(self._centres):
            first, second = self._robot.bodies[i], self._robot.bodies[j]
            depth = _depth([first.grown(at)], [second.grown(at)])
            if depth is not None:
                self._log.touch(first.name, second.name, time, depth)

    def _check_floor(self, at: Configuration, held: SceneBody | None, time: float) -> None:
        """The floor, a half-space: its contact is the lowest corner, no shape is needed."""
        if held is not None and held.lowest() < 0.0:
            self._log.touch(held.name, _FLOOR, time, -held.lowest())
        low = self._centres[:-1, 2] <= self._radii[:-1]
        for i in low.nonzero()[0].tolist():
            body = self._robot.bodies[i]
            if body.level == 0:
                continue  # the base and what is fixed to it stand on the floor
            lowest = body.lowest(at)
            if lowest < 0.0:
                self._log.touch(body.name, _FLOOR, time, -lowest)

    def _measure(
        self, at: Configuration, held: SceneBody | None, gaps: Array, mask: Mask, time: float
    ) -> None:
        standing = mask & self._is_standing
        standing[-1] &= ~self._is_support
        base = self._least(at, held, gaps, standing, range(1))
        arm = self._least(at, held, gaps, standing, range(1, len(gaps)))
        self._latest = Clearances(time, base, arm)
        self._least_base = min(self._least_base, base)
        self._least_arm = min(self._least_arm, arm)

    def _least(
        self, at: Configuration, held: SceneBody | None, gaps: Array, mask: Mask, rows: range
    ) -> float:
        """Least distance of some bodies to the scene; the nearest bounds are looked at first."""
        least = math.inf
        columns = range(len(self._scene.bodies))
        candidates = [(float(gaps[i, j]), i, j) for i in rows for j in columns if mask[i, j]]
        for bound, i, j in sorted(candidates):
            if bound >= least:
                break
            if i < len(self._robot.bodies):
                bodies = [self._robot.bodies[i].exact(at)]
            else:
                assert held is not None
                bodies = held.pieces
            least = min(least, _distance(bodies, self._scene.bodies[j].pieces))
        return least


def _depth(
    first: Iterable[fcl.CollisionObject], second: Iterable[fcl.CollisionObject]
) -> float | None:
    """Largest penetration [m] of any two pieces, or None if none touch."""
    deepest: float | None = None
    for a in first:
        for b in second:
            if not fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()):
                continue
            result = fcl.CollisionResult()
            fcl.collide(a, b, fcl.CollisionRequest(enable_contact=True), result)
            depths = [abs(contact.penetration_depth) for contact in result.contacts]
            deepest = max([*depths, deepest or 0.0])
    return deepest


def _distance(first: Iterable[fcl.CollisionObject], second: Iterable[fcl.CollisionObject]) -> float:
    """Least distance [m] of any two pieces, zero if they touch."""
    request = fcl.DistanceRequest()
    return min(
        max(0.0, float(fcl.distance(a, b, request, fcl.DistanceResult())))
        for a in first
        for b in second
    )
