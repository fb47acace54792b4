"""How long a grasp pose is held while the base drives past it.

Navigation leads the base: straight by the object at a constant speed, or round it. The tool
holds a pose that stands in the world, straight down, and may turn about the vertical. The
start and the arm's branch come from `longest_hold`, by one rule for all speeds and heights.
The plant is kinematic; the robot keeps off itself and its base.

    python benchmarks/drive_past.py [--picture FILE]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motm_wbc import load_robot
from motm_wbc.geometry import se2
from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics import RobotModel
from motm_wbc.kinematics.branches import Hold, longest_hold
from motm_wbc.kinematics.rotations import pose
from motm_wbc.qp import (
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
    WholeBodyParameters,
)

DT = 1.0 / 120.0
LATERAL = 0.6
"""Distance of the object from the track, or from the base's origin on the circle [m]."""
HEIGHTS = (0.425, 0.525, 0.625, 0.725)
"""Heights of the tool [m]: a cube of 5 cm on tables of 0.4 to 0.7 m."""
SPEEDS = (0.25, 0.5, 0.75, 1.0)
HELD = 0.01
"""Position error below which the pose counts as held [m]."""
UPRIGHT = 0.05
"""Tilt below which it counts as held in the strict sense as well [rad]."""
YAW_FREE = (1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
GAIN = 5.0
"""Speed per pose error [1/s]: what is off is made good in a fifth of a second."""

_SPACING = 0.01  # [m] of the base's way between the poses that the hold is sought on
_BEYOND = 0.75  # [m] of the track before and behind the object
_LONGER = 0.25  # [m] that is driven on after the foreseen end of the hold
_DOWN = np.diag([1.0, -1.0, -1.0])


_DEFAULT = WholeBodyParameters()


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What a drive looked like, one entry a control step.

    Attributes:
        foreseen: the joint path that was found beforehand.
        planning_time: wall time of that search [s].
        base: (n, 3) base poses.
        travel: (n,) way of the base since the start [m].
        error: (n,) distance of the tool from its place [m].
        tilt: (n,) angle of the approach axis from the vertical [rad].
        q: (n, n_arm) joint positions [rad or m].
        arm: (n, n_arm) commanded joint velocities [rad/s or m/s].
        scale: (n,) factor on what navigation asked for.
        clearance: (n,) least distance of the robot from itself and its base [m].
        rungs: names of the rungs that answered.
    """

    foreseen: Hold
    planning_time: float
    base: Array
    travel: Array
    error: Array
    tilt: Array
    q: Array
    arm: Array
    scale: Array
    clearance: Array
    rungs: frozenset[str]

    def held(self, strict: bool = False) -> slice:
        """The longest run of steps in which the pose is held, `strict`: upright as well."""
        good = self.error < HELD
        if strict:
            good &= self.tilt < UPRIGHT
        ends = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(int), [0]))))
        if len(ends) == 0:
            return slice(0, 0)
        runs = ends.reshape(-1, 2)
        best = int(np.argmax(self.travel[runs[:, 1] - 1] - self.travel[runs[:, 0]]))
        return slice(int(runs[best, 0]), int(runs[best, 1]))

    def travel_held(self, strict: bool = False) -> float:
        """Way of the base over which the pose is held [m]."""
        run = self.travel[self.held(strict)]
        return float(run[-1] - run[0]) if len(run) else 0.0

    def median_error(self) -> float:
        """Median distance of the tool from its place while it is held [m]."""
        return float(np.median(self.error[self.held()]))


def fast_enough(model: RobotModel, v: float) -> RobotModel:
    """The robot with a base that may drive at `v` [m/s]."""
    limits = model.base_limits
    return replace(model, base_limits=replace(limits, v_max=max(v, limits.v_max)))


def base_way(start: Array, inputs: tuple[float, float], duration: float, dt: float) -> Array:
    """(n, 3) base poses, `dt` [s] apart, at constant inputs v [m/s], omega [rad/s]."""
    v, omega = inputs
    times = np.arange(round(duration / dt) + 1) * dt
    return np.array([se2.integrate_twist(start, v, 0.0, omega, t) for t in times])


def drive(
    model: RobotModel,
    T_world_target: Array,
    start: Array,
    inputs: tuple[float, float],
    length: float,
    axis_weights: tuple[float, ...] = YAW_FREE,
    parameters: WholeBodyParameters = _DEFAULT,
    solver: str = "daqp",
) -> Track:
    """Drive along an arc and hold a pose as long as it goes.

    The robot is put where the foreseen hold begins, base and arm at the speeds it has there.

    Args:
        model: the robot.
        T_world_target: (4, 4) pose of the tool that is held.
        start: (3,) where the base's way begins.
        inputs: speed [m/s] and turn rate [rad/s] of the base, constant.
        length: of the base's way [m].
        axis_weights: (6,) axes of the world in which the pose counts; the tool points down.
        parameters: of the controller.
        solver: of the controller.

    Raises:
        ValueError: the arm can't hold the pose anywhere on the way.
    """
    model = fast_enough(model, inputs[0])
    dt = _SPACING / inputs[0]
    way = base_way(start, inputs, length / inputs[0], dt)
    begun = time.perf_counter()
    hold = longest_hold(model, T_world_target, way, dt, axis_weights)
    planning_time = time.perf_counter() - begun
    if hold is None:
        raise ValueError("the arm can't hold the pose anywhere on the base's way")
    steps = round((_SPACING * len(hold.q) + _LONGER) / inputs[0] / DT)
    lead = base_inputs(model, inputs)
    controller = WholeBodyController(model, DT, parameters, solver)
    wanted = model.posture
    posture = PostureTask(wanted.value, wanted.weight, wanted.lower, wanted.upper)
    tool = ToolTask(T_world_target=T_world_target, gain=GAIN, weights=np.array(axis_weights))
    last = lead, (hold.q[min(1, len(hold.q) - 1)] - hold.q[0]) / dt
    table, rungs = _hold_while_driving(
        controller, (way[hold.first], hold.q[0], last), tool, posture, steps
    )
    n = model.n_arm
    return Track(
        foreseen=hold,
        planning_time=planning_time,
        base=table[:, :3],
        travel=table[:, 3],
        error=table[:, 4],
        tilt=table[:, 5],
        q=table[:, 8 : 8 + n],
        arm=table[:, 8 + n :],
        scale=table[:, 6],
        clearance=table[:, 7],
        rungs=rungs,
    )


def _hold_while_driving(
    controller: WholeBodyController,
    start: tuple[Array, Array, tuple[Array, Array]],
    tool: ToolTask,
    posture: PostureTask,
    steps: int,
) -> tuple[Array, frozenset[str]]:
    """One row a step, in the order of `Track`'s arrays, and the rungs; from base, q and inputs."""
    model, T_world_target = controller.model, tool.T_world_target
    assert T_world_target is not None
    base, q, last = start
    lead, travel = last[0], 0.0
    rows, rungs = [], set()
    for _ in range(steps):
        T_world_tool = model.configuration(base, q).T_world_tool
        result = controller.step(
            base_pose=base,
            q=q,
            previous=last,
            tools=(tool,),
            base=NavigatedBase(lead),
            posture=posture,
        )
        rungs.add(result.rung)
        error = float(np.linalg.norm(T_world_tool[:3, 3] - T_world_target[:3, 3]))
        tilt = math.acos(min(float(T_world_tool[:3, 2] @ T_world_target[:3, 2]), 1.0))
        rows.append((*base, travel, error, tilt, result.scale, result.clearance, *q, *result.arm))
        last = result.base, result.arm
        travel += abs(float(result.base[0])) * DT
        base = se2.integrate_twist(base, float(result.base[0]), 0.0, float(result.base[-1]), DT)
        q = q + result.arm * DT
    return np.array(rows), frozenset(rungs)


def base_inputs(model: RobotModel, inputs: tuple[float, float]) -> Array:
    """(n_base,) inputs of the base at a speed [m/s] and turn rate [rad/s]."""
    v, omega = inputs
    if model.base_kind is BaseKind.DIFFERENTIAL:
        return np.array([v, omega])
    return np.array([v, 0.0, omega])


def drive_past(
    model: RobotModel,
    v: float,
    height: float,
    side: int = 1,
    parameters: WholeBodyParameters = _DEFAULT,
    solver: str = "daqp",
) -> Track:
    """Straight past an object at `v` [m/s], to the left (1) or right (-1) of the track."""
    target = pose(_DOWN, (0.0, side * LATERAL, height))
    start = np.array([-model.arm_base_xy[0] - _BEYOND, 0.0, 0.0])
    length = 2.0 * _BEYOND
    return drive(model, target, start, (v, 0.0), length, parameters=parameters, solver=solver)


def drive_round(
    model: RobotModel,
    v: float,
    height: float,
    side: int = 1,
    yaw_free: bool = True,
) -> Track:
    """Half a circle about an object at `v` [m/s], which is to the left (1) or right (-1).

    With `yaw_free` the tool may turn with the base. Else it stands still in the world, in
    the yaw that the home posture has at the middle of the way.
    """
    centre = np.array([0.0, side * LATERAL])
    start = np.array([0.0, 0.0, 0.0])
    omega = side * v / LATERAL
    half = se2.integrate_twist(start, v, 0.0, omega, 0.5 * math.pi / abs(omega))
    home = model.home.copy()
    home[0] += side * 0.5 * math.pi
    R = model.configuration(half, home).T_world_tool[:3, :3]
    yaw = math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    R_world_target = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
    target = pose(R_world_target, (*centre, height))
    axes = YAW_FREE if yaw_free else (1.0,) * 6
    length = math.pi * LATERAL
    return drive(model, target, start, (v, omega), length, axes)


def write_picture(
    model: RobotModel, tracks: Sequence[tuple[float, Track]], height: float, file: Path
) -> None:
    """Error and use of the joints' speeds over the place on the track, at several speeds.

    Args:
        model: the robot.
        tracks: speed [m/s] and drive.
        height: of the tool [m].
        file: is written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (errors, speeds) = plt.subplots(2, 1, figsize=(8.0, 6.5), sharex=True)
    for (v, track), colour in zip(tracks, ("C0", "C1", "C2", "C3"), strict=True):
        beside = track.base[:, 0] + model.arm_base_xy[0]
        run = track.held()
        label = f"{v:g} m/s: {track.travel_held():.2f} m"
        errors.semilogy(beside, 1e3 * np.maximum(track.error, 1e-6), colour, lw=0.8, alpha=0.5)
        errors.semilogy(beside[run], 1e3 * np.maximum(track.error[run], 1e-6), colour, label=label)
        speeds.plot(beside[run], np.max(np.abs(track.arm[run]) / model.v_max, axis=1), colour)
    errors.axhline(1e3 * HELD, color="black", lw=0.8, ls="--")
    errors.set(ylabel="tool's position error [mm]", ylim=(1e-3, 1e3))
    errors.set_title(f"Pose held at a height of {height:g} m, {LATERAL:g} m beside the track")
    errors.legend(title="speed and travel held", loc="upper left")
    speeds.axhline(1.0, color="black", lw=0.8, ls="--")
    speeds.set(xlabel="arm's base axis along the track, object at 0 [m]")
    speeds.set(ylabel="fastest joint's speed / its limit")
    for axes in (errors, speeds):
        axes.grid(alpha=0.3)
    figure.tight_layout()
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)
    plt.close(figure)


def _row(name: str, v: float, height: float, track: Track) -> str:
    foreseen = _SPACING * (len(track.foreseen.q) - 1)
    run = track.held()
    return (
        f"{name:12s} {v:5.2f} {height:7.3f} {foreseen:9.2f} {track.travel_held():6.3f} "
        f"{track.travel_held(strict=True):7.3f} {1e3 * track.median_error():8.3f} "
        f"{np.max(track.tilt[run], initial=0.0):6.3f} {np.min(track.scale):6.2f} "
        f"{np.min(track.clearance):6.3f} {1e3 * track.planning_time:8.0f}  "
        f"{', '.join(sorted(track.rungs))}"
    )


def main() -> None:
    """Print the table and, if asked, write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, default=None)
    picture: Path | None = parser.parse_args().picture
    model = load_robot("frankie")
    print(
        "way            m/s  height  foreseen   held upright   median   tilt  scale  clear"
        " planning  rungs\n"
        "                         m         m      m       m       mm    rad             m"
        "       ms"
    )
    for height in HEIGHTS:
        tracks = [(v, drive_past(model, v, height)) for v in SPEEDS]
        for v, track in tracks:
            print(_row("straight", v, height, track))
        if picture is not None and height == HEIGHTS[2]:
            write_picture(model, tracks, height, picture)
    for side, way in ((1, "left"), (-1, "right")):
        for yaw_free, name in ((True, "round"), (False, "yaw kept")):
            track = drive_round(model, 0.5, HEIGHTS[2], side, yaw_free)
            print(_row(f"{name} {way}", 0.5, HEIGHTS[2], track))


if __name__ == "__main__":
    main()
