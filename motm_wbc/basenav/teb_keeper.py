"""The band that is kept from step to step, and when it is made anew."""

from __future__ import annotations

import math
from typing import NamedTuple

from motm_wbc.basenav.footprint_check import Outline
from motm_wbc.basenav.local_planner import Goal
from motm_wbc.basenav.planner import GlobalPlanner, Path
from motm_wbc.basenav.teb_band import Band, band_along, gone_along, joined, with_goal
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.teb_safety import State, free_time
from motm_wbc.basenav.teb_solver import optimised
from motm_wbc.basenav.teb_terms import Ends, terms_of
from motm_wbc.basenav.teb_world import Scene
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

_SOON = 2.0  # [s] before which a band must be free; what it touches later, it may yet avoid
_LOST = 0.3  # [m] that the base may be off its band
_PATIENCE = 20  # commands refused in a row after which the band is given up
_SLOW = 1.3  # times as long as the global path: a new band is tried
_WORTH = 0.8  # share of its duration for which a band is changed


class Found(NamedTuple):
    """A band, optimised.

    Attributes:
        band: it.
        free: time for which it touches nothing that stands still [s], infinite if nowhere.
        whole: it ends at the goal.
    """

    band: Band
    free: float
    whole: bool


class _Task(NamedTuple):
    """What a band is sought for: state and goal, the world, the margin that can be kept."""

    state: State
    goal: Goal
    scene: Scene
    room: float
    planner: GlobalPlanner


class BandKeeper:
    """Optimises the last step's band, or one along the global path where that is no good."""

    def __init__(
        self, limits: BaseLimits, parameters: TebParameters, footprint: Array, outline: Outline
    ) -> None:
        """Begin without a band.

        Args:
            limits: of the base.
            parameters: of the planner.
            footprint: (m, 4) corners and normals of the footprint.
            outline: the same as half-planes.
        """
        self._limits, self._parameters = limits, parameters
        self._footprint, self._outline = footprint, outline
        self._terms = terms_of(limits, parameters)
        self._found: Found | None = None
        self._goal: Goal | None = None
        self._refused = 0  # commands in a row

    def forget(self) -> None:
        """Begin without a band again."""
        self._found, self._goal, self._refused = None, None, 0

    def note(self, *, obeyed: bool) -> None:
        """Learn whether the last band's command could be given out."""
        self._refused = 0 if obeyed else self._refused + 1
        if self._refused >= _PATIENCE:
            self.forget()

    def best(
        self, state: State, goal: Goal, scene: Scene, room: float, planner: GlobalPlanner
    ) -> tuple[Found | None, bool]:
        """The band kept from the last step, or one made anew; whether it is new.

        A new one is looked for if the last one meets something soon, or takes much longer
        than the global path; one in the other gear if that meets something soon as well.

        Args:
            state: of the base.
            goal: checked.
            scene: the world.
            room: distance that the band shall keep [m].
            planner: whose path new bands begin as.
        """
        task = _Task(state, goal, scene, room, planner)
        begun = self._kept(task)
        kept = self._optimised(*begun, task) if begun else None
        self._found, self._goal = self._chosen(kept, task), goal
        return self._found, self._found is not kept

    def _chosen(self, kept: Found | None, task: _Task) -> Found | None:
        """The band kept, or a better one along the global path."""
        route = task.planner.route(task.state.pose, task.goal.pose)
        if route is None:
            return kept
        slow = kept is not None and kept.band.duration > _SLOW * (route.time + _SOON)
        if kept is not None and kept.free >= _SOON and not slow:
            return kept
        best = kept
        for backward in self._gears(route):
            begun = self._along(route, backward, task.state.pose, task.goal.pose)
            fresh = self._optimised(*begun, task)
            if best is None or _is_better(fresh, best):
                best = fresh
            if best.free >= _SOON:
                break
        return best

    def _kept(self, task: _Task) -> tuple[Band, bool] | None:
        """The last band from here on, led to the goal; whether it ends there."""
        p, found, last, goal = self._parameters, self._found, self._goal, task.goal.pose
        if found is None or last is None or self._leaps(last.pose, goal):
            return None
        band, away = gone_along(*found.band, task.state.pose, self._outline.radius)
        if away > _LOST:
            return None
        if found.whole:
            return with_goal(band, goal), True
        if band.duration > 0.5 * p.horizon:
            return band, False
        end = band.poses[-1]
        route = task.planner.route(end, goal)
        if route is None:
            return None
        tail, whole = self._along(route, route.backward, end, goal)
        return joined(band, tail), whole

    def _leaps(self, before: Array, goal: Array) -> bool:
        """Whether the goal has moved too far for the band to be led there."""
        p = self._parameters
        turned = abs(wrap(goal[2] - before[2]))
        return math.dist(goal[:2], before[:2]) > p.restart_distance or turned > p.restart_angle

    def _gears(self, route: Path) -> tuple[bool, ...]:
        """In which a path can be driven, its own first."""
        if self._limits.v_reverse == 0.0:
            return (False,)
        return route.backward, not route.backward

    def _along(self, route: Path, backward: bool, begin: Array, goal: Array) -> tuple[Band, bool]:
        """A band along a path, within the horizon; whether it ends at the goal."""
        p = self._parameters
        return band_along(route.points, backward, begin, goal, self._limits, p.interval, p.horizon)

    def _optimised(self, band: Band, whole: bool, task: _Task) -> Found:
        state, scene = task.state, task.scene
        ends = Ends(state.v, state.omega, task.goal.stop and whole)
        band = optimised(
            band,
            self._terms,
            ends,
            self._footprint,
            scene.parts,
            self._outline.radius,
            self._parameters,
        )
        return Found(band, free_time(scene.edges, self._outline, task.room, *band), whole)


def _is_better(fresh: Found, kept: Found) -> bool:
    """Whether a band is worth changing to: nothing soon in the way, or clearly sooner there."""
    if min(fresh.free, _SOON) != min(kept.free, _SOON):
        return fresh.free > kept.free
    return math.isinf(fresh.free) and fresh.band.duration < _WORTH * kept.band.duration
