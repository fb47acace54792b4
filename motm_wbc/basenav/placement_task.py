"""What is kept of one task of base placement: an object, and the next target after it."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.basenav.departure import departure_times, pull_out_limit
from motm_wbc.basenav.edge_patches import EdgePatches
from motm_wbc.basenav.footprint_check import EdgeMap, Outline
from motm_wbc.basenav.legs import FirstLeg, SecondLeg
from motm_wbc.basenav.ring import FREE, Ring
from motm_wbc.basenav.walls import Indices
from motm_wbc.basenav.world import World
from motm_wbc.geometry.arrays import Array

_STEP = 0.5  # [m] to which the room about the object is rounded up


@dataclass(frozen=True)
class Base:
    """What of the base a departure from rest depends on.

    Attributes:
        outline: footprint.
        margin: distance that it keeps [m].
        alpha_max: angular acceleration [rad/s^2].
    """

    outline: Outline
    margin: float
    alpha_max: float


class PlacementTask:
    """Candidates about an object, the ways to them and on from them.

    Attributes:
        ring: the candidates.
        first: the ways to them.
        second: the ways on; None if there is no next target, or no pose at it is free.
        onward_world: the world that they lead through.
        version: of the world that all this has been checked for.
    """

    onward_world: World
    version: int

    def __init__(
        self,
        ring: Ring,
        first: FirstLeg,
        second: SecondLeg | None,
        base: Base,
        has_next: bool,
    ) -> None:
        """A task; `has_next`: there is a next target."""
        self.ring, self.first, self.second = ring, first, second
        self._base = base
        self._no_way = np.full(len(ring.poses), math.inf if has_next else 0.0)
        self._starts: tuple[EdgeMap, Array, Array] | None = None

    def leads_to(self, poses: Array) -> bool:
        """Whether these (g, 3) are the next target's poses."""
        return self.second.leads_to(poses) if self.second is not None else len(poses) == 0

    def leg2(self) -> Array:
        """(m,) time from each candidate to the next target [s], zeros without one."""
        return self._no_way if self.second is None else self.second.times(self.onward_world)

    def standing_starts(self, edges_near: EdgePatches) -> Array:
        """(m,) what setting out from rest costs at each candidate beside driving through [s]."""
        leg2 = self.leg2()
        if self.second is None:
            return np.zeros(len(leg2))
        edges = self._edges(edges_near, self.ring.radius)
        if self._starts is None or self._starts[0] is not edges or self._starts[1] is not leg2:
            times = self._departures(edges, self.ring.poses, self.ring.rejections)
            leg2 = self.leg2()
            later = np.subtract(times, leg2, out=np.zeros(len(leg2)), where=np.isfinite(leg2))
            self._starts = edges, leg2, np.maximum(later, 0.0)
        return self._starts[2]

    def time_on(self, pose: Array, edges_near: EdgePatches) -> float:
        """Time from rest at a pose (3,) to the next target [s], infinite if there is no way."""
        if self.second is None:
            return float(self._no_way[0])
        self.leg2()
        edges = self._edges(edges_near, math.hypot(*(pose[:2] - self.ring.centre)))
        return float(self._departures(edges, pose[None], np.array([FREE]))[0])

    def _edges(self, edges_near: EdgePatches, apart: float) -> EdgeMap:
        """The world as far as a base that departs `apart` from the object [m] may get."""
        room = max(apart, self.ring.radius) + pull_out_limit(self._base.outline)
        return edges_near.about(self.ring.centre, _STEP * math.ceil(room / _STEP))

    def _departures(self, edges: EdgeMap, poses: Array, rejections: Indices) -> Array:
        """(k,) `departure_time` of each pose, where the way on is exact."""
        base, second = self._base, self.second
        if second is None:
            return np.full(len(poses), math.inf)
        apart = np.hypot(*(poses[:, :2] - self.ring.centre).T)
        for tried in itertools.count(1):
            times, ways = departure_times(
                second.field,
                second.routes,
                edges,
                base.outline,
                poses,
                rejections,
                base.margin,
                base.alpha_max,
            )
            if second.cover(self.onward_world, float((apart + ways).max()), tried):
                break
        return np.asarray(times)
