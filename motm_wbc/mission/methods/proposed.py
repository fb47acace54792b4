"""The paper's method: every placement re-ranked at every base step, STAA* to the best one."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from motm_wbc.basenav.placement import REASONS, BasePlacement, PlacementResult
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.staa import Goal, StaaPlan, StaaStar
from motm_wbc.basenav.waiting import Wait
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import braking_arc, stopping_time
from motm_wbc.interfaces import BaseReport
from motm_wbc.mission.arrival import base_prediction
from motm_wbc.mission.methods.method import BaseDecision, BaseMoment, MethodContext


class Proposed:
    """Re-ranks all placements at each step, holds near the object while a grasp is pending.

    "Enabling Failure Recovery for On-The-Move Mobile Manipulation" (2023): the goal slides
    along the ring toward the next target and stops at its end while the grasp fails.
    """

    def __init__(self, context: MethodContext) -> None:
        """Build the placement module and the local planner."""
        self._context = context
        planner = GlobalPlanner(
            context.world,
            v_max=context.limits.v_max,
            omega_max=context.limits.omega_max,
            inflation=context.placement.inflation,
            v_reverse=context.limits.v_reverse,
        )
        self._placement = BasePlacement(
            context.world, context.footprint, context.limits, context.placement
        )
        self._local = StaaStar(
            context.world, context.footprint, context.limits, context.staa, planner
        )
        limits = context.limits
        # Accelerating from rest to full speed takes v/a and leads as far as half that time would.
        self._restart = 0.5 * limits.v_max / limits.a_max
        self._step_index = -1
        self._previous: Array | None = None

    def decide(self, now: BaseMoment) -> BaseDecision:
        """Rank, choose, and take the first acceleration of the local plan."""
        started = time.perf_counter()
        if now.step_index != self._step_index:
            self._step_index, self._previous = now.step_index, None
        if now.target is None:
            plan = self._local.brake(now.pose, now.v, now.omega)
            return self._decision(now, plan, None, started)
        ranking = self._rank(now, now.target)
        self._previous = ranking.goal
        plan = self._drive(now, now.target, ranking)
        return self._decision(now, plan, ranking, started)

    def _rank(self, now: BaseMoment, target: Array) -> PlacementResult:
        """All candidates, and "brake to a stop here" where that keeps the target in reach."""
        rest = braking_arc(now.pose, now.v, now.omega, self._context.limits)[-1]
        waits = self._context.region.contains(rest, target)
        return self._placement.evaluate(
            now.pose,
            target,
            now.next_target,
            previous=self._previous,
            stop_pose=rest if waits else None,
            stop_time=stopping_time(now.v, now.omega, self._context.limits),
            region=self._context.region,
            wait=Wait(now.wait, self._restart, now.attempts_fail),
        )

    def _drive(self, now: BaseMoment, target: Array, ranking: PlacementResult) -> StaaPlan:
        if ranking.stop_here or ranking.goal is None:
            return self._local.brake(now.pose, now.v, now.omega)
        held = self._context.region.contains(now.pose, target)
        return self._local.plan(
            now.pose,
            now.v,
            now.omega,
            Goal(ranking.goal, stop=self._has_to_wait(now, ranking)),
            keep_in=self._context.region if held else None,
            object_xy=target,
        )

    def _has_to_wait(self, now: BaseMoment, ranking: PlacementResult) -> bool:
        """Whether the base would be at its goal before the grasp: then it comes to rest there.

        Braking takes time as well; before its point the local planner drives on at speed.
        """
        if now.next_target is None or not self._context.placement.price_wait:
            return False
        braking = stopping_time(now.v, now.omega, self._context.limits)
        arrives = float(ranking.leg1[ranking.selected])
        return now.attempts_fail or now.wait + braking > arrives

    def _decision(
        self, now: BaseMoment, plan: StaaPlan, ranking: PlacementResult | None, started: float
    ) -> BaseDecision:
        path = np.empty((0, 2))
        if ranking is not None and ranking.path is not None and not ranking.stop_here:
            path = ranking.path.points
        prediction = base_prediction(now.pose, plan.poses, path, self._context.limits.v_max)
        last = prediction[-1:, 1:]
        if ranking is not None and ranking.goal is not None:
            last = ranking.goal[None, :]
        return BaseDecision(
            acceleration=np.array(plan.acceleration),
            prediction=prediction,
            pass_poses=np.vstack([prediction[:, 1:], last]),
            report=_report(plan, ranking, path, time.perf_counter() - started),
        )


def _report(
    plan: StaaPlan, ranking: PlacementResult | None, path: Array, compute_time: float
) -> BaseReport:
    report = BaseReport(
        goal=None,
        candidates=np.empty((0, 3)),
        costs=np.empty(0),
        rejections=np.empty(0, dtype=np.int64),
        reasons=REASONS,
        selected=-1,
        global_path=path,
        local_plan=plan.poses,
        braking=plan.braking,
        compute_time=compute_time,
        expansions=plan.expansions,
        clock_guard_fired=plan.clock_guard_fired,
        emergency=plan.emergency,
    )
    if ranking is None:
        return report
    return replace(
        report,
        goal=None if ranking.stop_here else ranking.goal,
        candidates=ranking.candidates,
        costs=ranking.costs,
        rejections=ranking.rejections,
        selected=ranking.selected,
    )
