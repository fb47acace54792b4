"""Which pairs are dampened, how near each may come and how fast it may approach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from motm_wbc.geometry.arrays import Array, IntArray
from motm_wbc.kinematics import Part, RobotModel
from motm_wbc.kinematics.pairs import classify
from motm_wbc.kinematics.parameters import PairClass
from motm_wbc.qp.bodies import Body
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.segments import RobotSegments
from motm_wbc.qp.shapes import BASE


def approach_speed(pair: PairClass, model: RobotModel, parameters: WholeBodyParameters) -> float:
    """Approach speed at the influence distance that the arm can still brake from [m/s].

    A damper takes speed away at the rate xi/(d_i - d_s); acceleration limits can follow if
    that is at most a_max/v_max, of the slowest joint.
    """
    rate = float(np.min(model.a_max / model.v_max))
    return min(parameters.damper_speed, (pair.influence - pair.safe) * rate)


def reach(pair: PairClass, model: RobotModel, parameters: WholeBodyParameters) -> float:
    """Distance within which pairs of a class are looked at [m].

    At the influence distance a slow class would stop a quick approach at once. So its line
    goes on beyond, until it allows `noticed_speed`. The base must be able to stop, too.
    """
    rate = approach_speed(pair, model, parameters) / (pair.influence - pair.safe)
    braking = 0.5 * model.base_limits.v_max**2 / model.base_limits.a_max
    return max(pair.influence, pair.safe + max(parameters.noticed_speed / rate, braking))


class Dampers(NamedTuple):
    """Distances and approach speeds of pairs; one entry a pair, in any shape.

    Attributes:
        safe: d_s, distance that is kept [m].
        rate: xi/(d_i - d_s), allowed approach speed per distance beyond d_s [1/s].
        reach: distance within which the pair counts [m]; -inf where contact is allowed, or
            none is possible.
    """

    safe: Array
    rate: Array
    reach: Array

    @classmethod
    def of(
        cls,
        classes: Sequence[PairClass | None],
        model: RobotModel,
        parameters: WholeBodyParameters,
    ) -> Dampers:
        """Dampers (m,) of the given classes."""
        values = np.empty((3, len(classes)))
        for index, pair in enumerate(classes):
            if pair is None:
                values[:, index] = 0.0, 0.0, -np.inf
            else:
                speed = approach_speed(pair, model, parameters)
                rate = speed / (pair.influence - pair.safe)
                values[:, index] = pair.safe, rate, reach(pair, model, parameters)
        return cls(*values)

    def reshape(self, *shape: int) -> Dampers:
        """The same entries in another shape."""
        return Dampers(
            self.safe.reshape(shape), self.rate.reshape(shape), self.reach.reshape(shape)
        )


def scene_dampers(
    segments: RobotSegments,
    owner: IntArray,
    bodies: Sequence[Body],
    target: str | None,
    model: RobotModel,
    parameters: WholeBodyParameters,
) -> Dampers:
    """Dampers (k, s) of each segment of the robot, the base last, and each part of the scene.

    Args:
        segments: the robot's.
        owner: (s,) index into `bodies`, or `BASE` for the robot's own base.
        bodies: the solids of the scene.
        target: name of the object to be grasped, or just released.
        model: the robot.
        parameters: of the controller.
    """
    held = segments.held
    near_base = set(model.base_pairs)
    classes: list[PairClass | None] = []
    for index, part in enumerate(segments.parts):
        for body_index in owner.tolist():
            if body_index == BASE:
                own = index in near_base or part is Part.HELD
                classes.append(parameters.pairs.arm_base if own else None)
                continue
            body = bodies[body_index]
            classes.append(
                classify(
                    part,
                    body.role,
                    is_target=body.name == target,
                    is_held=held is not None and body.name == held.name,
                    contact_allowed=held is not None and held.contact_allowed,
                    classes=parameters.pairs,
                )
            )
    for body_index in owner.tolist():
        is_held = held is not None and body_index != BASE and bodies[body_index].name == held.name
        own = body_index == BASE or is_held
        classes.append(None if own else parameters.pairs.base_scene)
    return Dampers.of(classes, model, parameters).reshape(len(segments.names), len(owner))


def self_pairs(segments: RobotSegments, model: RobotModel) -> IntArray:
    """(p, 2) segments of the robot that must keep apart from each other.

    A held object keeps apart from the capsules that the hand keeps apart from.
    """
    pairs = [tuple(pair) for pair in model.self_pairs]
    hand = {i for i, part in enumerate(segments.parts) if part in (Part.HAND, Part.FINGER)}
    partners = sorted(
        {j for pair in pairs for i, j in (pair, pair[::-1]) if i in hand and j not in hand}
    )
    held = [i for i, part in enumerate(segments.parts) if part is Part.HELD]
    pairs += [(i, j) for i in held for j in partners]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)
