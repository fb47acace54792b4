"""The Timed Elastic Band round a table, as its authors' package drives it.

A table of 1.2 x 0.7 m stands between start and goal, which are at rest, nose to the table and
away from it. Speed 1.0 m/s, 0.8 m/s^2, 1.5 rad/s, 2.0 rad/s^2; distance from obstacles 0.10 m;
footprint 0.68 x 0.47 m. The authors' package (C++) takes 2 to 11 ms a plan, 7.9 s to the goal,
keeps 0.10 m, holds the speed to 3 % and exceeds the acceleration by up to 30 %. Clearance is
measured by shapely, and how much a band exceeds its limits at every plan.

    python benchmarks/teb_table.py [--repeats N]
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from motm_wbc.basenav import GlobalPlanner, TebParameters, TimedElasticBand, World
from motm_wbc.basenav.local_planner import Goal, LocalPlan
from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseLimits

LIMITS = BaseLimits(v_max=1.0, v_reverse=0.2, omega_max=1.5, a_max=0.8, alpha_max=2.0)
FOOTPRINT = polygons.rectangle(0.68, 0.47)
TABLE = polygons.rectangle(1.2, 0.7)
DISTANCE = 0.10
"""From obstacles [m]."""
CASES = {
    "across, 3 m": ((0.0, 1.5, -math.pi / 2), (0.0, -1.5, -math.pi / 2)),
    "across, 4 m": ((0.0, 2.0, -math.pi / 2), (0.0, -2.0, -math.pi / 2)),
    "along, 5 m": ((-2.5, 0.0, 0.0), (2.5, 0.0, 0.0)),
}
"""Start and goal of each case."""
PERIOD = 0.05
STEPS = 6
"""Control steps of a period."""
LONGEST = 30.0
"""Time after which a run has failed [s]."""


@dataclass(frozen=True)
class Figures:
    """What one run shows.

    Attributes:
        time: to rest at the goal [s], infinite if it was not reached.
        clearance: least distance of the footprint from the table [m].
        plans: (n,) time of each plan [s].
        command_excess: largest excess of driven speeds and accelerations, share of the limit.
        speed_excess: the same of the bands' speeds.
        error: distance from the goal at the end [m].
    """

    time: float
    clearance: float
    plans: Array
    command_excess: float
    speed_excess: float
    error: float


def run(begin: tuple[float, float, float], end: tuple[float, float, float]) -> Figures:
    """Drive one case."""
    world = World([TABLE])
    planner = GlobalPlanner(
        world, LIMITS.v_max, LIMITS.omega_max, inflation=0.35, v_reverse=LIMITS.v_reverse
    )
    band = TimedElasticBand(world, FOOTPRINT, LIMITS, TebParameters(distance=DISTANCE), planner)
    goal, state = Goal(np.array(end), stop=True), np.array([*begin, 0.0, 0.0])
    states, plans, times, needed = [state], [], [], math.inf
    for period in range(round(LONGEST / PERIOD)):
        began = time.perf_counter()
        plans.append(band.plan(state[:3], float(state[3]), float(state[4]), goal))
        times.append(time.perf_counter() - began)
        states += driven(state, plans[-1].acceleration)
        state = states[-1]
        if is_there(state, goal):
            needed = PERIOD * (period + 1)
            break
    error = math.dist(state[:2], goal.pose[:2])
    return Figures(
        needed, clearance(states), np.array(times), excess(np.array(states)),
        max(speed_excess(plan) for plan in plans), error,
    )  # fmt: skip


def driven(state: Array, acceleration: tuple[float, float]) -> list[Array]:
    """States of a unicycle over a command period, its velocity raised at every control step."""
    states, dt = [], PERIOD / STEPS
    for _ in range(STEPS):
        v, omega = state[3] + acceleration[0] * dt, state[4] + acceleration[1] * dt
        state = np.array([*se2.integrate_twist(state[:3], v, 0.0, omega, dt), v, omega])
        states.append(state)
    return states


def is_there(state: Array, goal: Goal) -> bool:
    """At rest at the goal, within 0.10 m and 0.35 rad."""
    turned = abs(wrap(goal.pose[2] - state[2]))
    at_rest = bool(np.abs(state[3:]).max() < 1e-9)
    return at_rest and math.dist(state[:2], goal.pose[:2]) <= 0.10 and turned <= 0.35


def clearance(states: list[Array]) -> float:
    """Least distance of the footprint from the table [m]."""
    table = Polygon(TABLE)
    return min(float(Polygon(polygons.place(FOOTPRINT, s)).distance(table)) for s in states)


def excess(states: Array) -> float:
    """Largest share by which driven speeds and accelerations exceed their limits."""
    velocities = states[:, 3:]
    low = np.array([-LIMITS.v_reverse, -LIMITS.omega_max])
    high = np.array([LIMITS.v_max, LIMITS.omega_max])
    speeds = np.maximum(velocities - high, low - velocities) / high
    rates = np.abs(np.diff(velocities, axis=0)) * STEPS / PERIOD
    return float(max(speeds.max(), (rates / [LIMITS.a_max, LIMITS.alpha_max] - 1.0).max()))


def speed_excess(plan: LocalPlan) -> float:
    """Largest share by which a plan's forward speed exceeds its limit."""
    return float(plan.velocities[:, 0].max()) / LIMITS.v_max - 1.0


def main() -> None:
    """Print the figures of all cases."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=5, help="runs of each case (times only)")
    repeats = parser.parse_args().repeats
    for name, (begin, end) in CASES.items():
        runs = [run(begin, end) for _ in range(repeats)]
        plans = 1e3 * np.min([one.plans for one in runs], axis=0)
        one = runs[0]
        print(
            f"{name:12} {one.time:5.2f} s  clearance {one.clearance:.3f} m  plan median"
            f" {np.median(plans):.1f} ms, p99 {np.percentile(plans, 99):.1f} ms  driven beyond"
            f" limits {100.0 * one.command_excess:.2f} %  band's speed beyond its limit"
            f" {100.0 * one.speed_excess:.1f} %  at the goal {1e3 * one.error:.0f} mm"
        )


if __name__ == "__main__":
    main()
