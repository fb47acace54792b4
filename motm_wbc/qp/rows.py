"""Collision rows: near pairs, turned into a fixed number of linear bounds of the inputs.

Each row is a velocity damper (Faverjon and Tournassoud, "A local based approach for path
planning of manipulators", 1987; Haviland and Corke, "NEO", RA-L 2021, eq. 14):

    n^T (J_a - J_b) x <= xi (d - d_s)/(d_i - d_s) + n^T v_other

with n the unit vector from the robot's point to the other body, d the signed distance. The
line goes on beyond d_i until it allows more than any motion has, so a row switches on
smoothly; inside d_s it leads out again, at a bounded speed.

What stands on the base and the arm can't pull back is led by the base's own brakes: its row
allows the largest speed from which the base can stop in time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array, BoolArray, IntArray
from motm_wbc.geometry.braking import stopping_speed
from motm_wbc.kinematics import Configuration, Part, RobotModel
from motm_wbc.qp.limits import BaseBounds
from motm_wbc.qp.nearby import NearPairs, Neighbourhood
from motm_wbc.qp.parameters import WholeBodyParameters

_FREE_JOINTS = 2  # with fewer joints the arm can't pull a link back while the base goes on
_BRAKES = 0.98  # share of the deceleration that is counted on: normals turn on the way
_SLOW = 1e-6  # [m/s] stands for a closing speed that is none


@dataclass(frozen=True, slots=True, eq=False)
class CollisionRows:
    """Linear bounds A x <= bound of the inputs x, in a fixed number of slots.

    Attributes:
        A: (k, n_base + n_arm); zero in a slot that is not in use.
        bound: (k,) [m/s]; infinite in a slot that is not in use.
        first: (k,) segment of the robot.
        second: (k,) the other body, as in `NearPairs`.
        clearance: smallest distance of any near pair [m], infinite if there is none.
        closest: the pair that has it, as (first, second), or None.
    """

    A: Array
    bound: Array
    first: IntArray
    second: IntArray
    clearance: float
    closest: tuple[int, int] | None


class RowBuilder:
    """Keeps each pair in one slot as long as it stays near, for the solver's warm start.

    Args:
        model: the robot.
        neighbourhood: what `build` takes its pairs from.
        dt: control step [s].
        parameters: of the controller.
    """

    def __init__(
        self,
        model: RobotModel,
        neighbourhood: Neighbourhood,
        dt: float,
        parameters: WholeBodyParameters,
    ) -> None:
        self._n_base = model.n_base
        self._inputs = model.n_base + model.n_arm
        self._base_change = BaseBounds(model.base_limits, model.n_base, dt).change
        self._dt = dt
        self._retreat = parameters.retreat_speed
        self._neighbourhood = neighbourhood
        self._count = parameters.collision_rows
        self._held_rows = parameters.held_rows
        self.renumber()

    def renumber(self) -> None:
        """Forget the slots; the numbers of pairs have changed."""
        self._slots: list[int] = [-1] * self._count
        segments, shapes = self._neighbourhood.segments, self._neighbourhood.shapes
        # rows of what moves the other body of a pair: the scene nothing, the base its inputs
        parts = np.zeros((len(shapes.owner), self._inputs))
        parts[0, : self._n_base] = 1.0
        self._moves_other = np.concatenate((parts, segments.moved_by))
        self._parts = len(shapes.owner)
        self._on_base = segments.moved_by[:, self._n_base :].sum(axis=1) < _FREE_JOINTS
        self._is_held = np.array([part is Part.HELD for part in segments.parts])

    def build(self, configuration: Configuration, lead: Array) -> CollisionRows:
        """The rows of the pairs that may approach least.

        Args:
            configuration: of the robot.
            lead: (n_base,) base inputs that are asked for, or were last.
        """
        near = self._neighbourhood.find(configuration)
        A = np.zeros((self._count, self._inputs))
        bound = np.full(self._count, np.inf)
        ends = np.zeros((2, self._count), dtype=np.intp)
        if len(near) == 0:
            self._slots = [-1] * self._count
            return CollisionRows(A, bound, ends[0], ends[1], np.inf, None)
        room = near.distance - near.dampers.safe
        allowed = np.maximum(near.dampers.rate * room, -self._retreat)
        fixed = self._on_base[near.first] & (near.second < self._parts)
        chosen = self._nearest(near, self._ranked(allowed, room, fixed))
        first, second = near.first[chosen], near.second[chosen]
        slots = self._assign(first * len(self._moves_other) + second)
        normal, point = near.normal[chosen], near.point[chosen]
        rates = self._jacobian_rows(configuration, normal, point, first, second)
        limit = allowed[chosen] + self._speed_of_other(normal, point, second)
        stuck = np.nonzero(fixed[chosen])[0]
        if stuck.size:
            stops = self._base_stops(rates[stuck], room[chosen][stuck], lead)
            stops += limit[stuck] - allowed[chosen][stuck]
            limit[stuck] = np.maximum(stops, 0.0)  # it stops; to flee is navigation's business
        A[slots], bound[slots] = rates, limit
        ends[0, slots], ends[1, slots] = first, second
        least = int(near.distance.argmin())
        closest = int(near.first[least]), int(near.second[least])
        return CollisionRows(A, bound, ends[0], ends[1], float(near.distance[least]), closest)

    def name(self, pair: tuple[int, int]) -> str:
        """Names of the two bodies of a pair."""
        return self._neighbourhood.name(*pair)

    def _nearest(self, near: NearPairs, allowed: Array) -> IntArray:
        order = np.argsort(allowed, kind="stable")
        if self._neighbourhood.segments.held is not None:
            order = order[self._not_too_many_of_held(near.first[order], near.second[order])]
        return order[: self._count]

    def _not_too_many_of_held(self, first: IntArray, second: IntArray) -> BoolArray:
        """Pairs to keep, of pairs from near to far: a box's edges would take all the slots."""
        keep = np.ones(len(first), dtype=bool)
        spent: dict[int, int] = {}
        for index in np.flatnonzero(self._is_held[first]).tolist():
            other = int(second[index])
            spent[other] = spent.get(other, 0) + 1
            keep[index] = spent[other] <= self._held_rows
        return keep

    def _ranked(self, allowed: Array, room: Array, fixed: BoolArray) -> Array:
        """(m,) speeds that pairs are ranked by: for those `fixed` to the base its brakes count."""
        if not fixed.any():
            return allowed
        brakes = float(self._base_change[0]) / self._dt
        return np.where(fixed, np.minimum(allowed, stopping_speed(room, brakes, self._dt)), allowed)

    def _base_stops(self, rates: Array, room: Array, lead: Array) -> Array:
        """(m,) speeds from which the base, braking on its arc, stops within `room` (m,) [m].

        Braking shrinks all inputs as one, so the closing speed falls as evenly as they do.
        """
        J = rates[:, : self._n_base]
        closing = J @ lead
        steps = max(float(np.max(np.abs(lead) / self._base_change)), 1.0)
        at_rest = np.abs(J) @ self._base_change  # nothing closes in: all that the brakes have
        deceleration = np.where(closing > _SLOW, closing / steps, at_rest + _SLOW) / self._dt
        return stopping_speed(room, _BRAKES * deceleration, self._dt)

    def _assign(self, numbers: IntArray) -> list[int]:
        """Slots of the pairs with these numbers: the old ones where they had one."""
        wanted = numbers.tolist()
        old = {number: slot for slot, number in enumerate(self._slots) if number >= 0}
        kept = {number: old[number] for number in wanted if number in old}
        taken = set(kept.values())
        free = iter([slot for slot in range(self._count) if slot not in taken])
        slots = [kept[number] if number in kept else next(free) for number in wanted]
        self._slots = [-1] * self._count
        for slot, number in zip(slots, wanted, strict=True):
            self._slots[slot] = number
        return slots

    def _jacobian_rows(
        self,
        configuration: Configuration,
        normal: Array,
        point: Array,
        first: IntArray,
        second: IntArray,
    ) -> Array:
        """(m, n_inputs) rates at which the pairs come nearer, for each input.

        n (v + w x p) = n v + w (p x n); both points of a pair lie on one line along n, so
        p x n is the same for both, and what moves both drops out.
        """
        moment = np.empty_like(point)
        moment[:, 0] = point[:, 1] * normal[:, 2] - point[:, 2] * normal[:, 1]
        moment[:, 1] = point[:, 2] * normal[:, 0] - point[:, 0] * normal[:, 2]
        moment[:, 2] = point[:, 0] * normal[:, 1] - point[:, 1] * normal[:, 0]
        J = configuration.J_world
        rates = normal @ J[:3] + moment @ J[3:]
        moved_by = self._neighbourhood.segments.moved_by
        return np.asarray(rates * (moved_by[first] - self._moves_other[second]))

    def _speed_of_other(self, normal: Array, point: Array, second: IntArray) -> Array:
        """(m,) speeds at which the other bodies move along n by themselves [m/s]."""
        shapes = self._neighbourhood.shapes
        if not shapes.velocity.any():
            return np.zeros(len(second))
        part = np.where(second < len(shapes.owner), second, 0)  # the robot's own: at rest
        velocity, arm = shapes.velocity[part], point[:, :2] - shapes.centre[part]
        along_x = velocity[:, 0] - velocity[:, 2] * arm[:, 1]
        along_y = velocity[:, 1] + velocity[:, 2] * arm[:, 0]
        return np.asarray(normal[:, 0] * along_x + normal[:, 1] * along_y)
