"""A control problem in a file, and a contestant's side of the benchmark.

Contestants that are other libraries import this module by itself, from environments of their
own: it needs Python 3.11 and numpy, and nothing of the package that it lies in.

A contestant is a process `python worker.py PROBLEM [ARGUMENT ...]`. Once it has built all that
it needs, it writes one line of JSON that says what it is. Then it answers each line on its
standard input by one line on its standard output:

    round       one control step for each state, in order: wall and CPU times, failures
    answers     the same, untimed: the joint velocities that it commands
    stop        nothing; it ends
"""

from __future__ import annotations

import gc
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

Array: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"
Names: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """One robot, one scene, and n states with what is asked in each.

    Joints are the base's x, y and yaw, then the arm's; nv of them. All frames are the URDF's
    links; the world's axes are those of the URDF's root.

    Attributes:
        name: of the problem.
        robot: robot file for `load_robot`; other libraries have `urdf`.
        urdf: text of a URDF without meshes, with nothing that moves but the nv joints.
        joints: (nv,) names in the order of all vectors.
        tool_link: link that the target is for.
        dt: control step [s].
        lower: (nv,) least positions [m, rad].
        upper: (nv,) largest positions [m, rad].
        v_max: (nv,) [m/s, rad/s].
        a_max: (nv,) [m/s^2, rad/s^2].
        q: (n, nv) positions [m, rad].
        v_previous: (n, nv) velocities that were commanded in the step before.
        inputs_previous: (n, n_base) the base's part of them as inputs in the base frame.
        twist: (n, 6) twist that is asked of the tool: linear, angular, in world axes.
        T_world_target: (n, 4, 4) where that twist takes the tool in one step.
        posture: (n_arm,) preferred positions [rad].
        posture_weights: (n_arm,) weight of each.
        posture_gain: speed toward them per distance [1/s].
        linear_weight: of the tool's linear velocity.
        angular_weight: of the tool's angular velocity.
        damping: weight of all velocities.
        rows: collision rows of one step; 0: no collisions at all.
        safe: distance to be kept [m].
        influence: distance from which on a pair counts [m].
        rate: allowed approach speed per distance beyond `safe` [1/s].
        capsule_names: (k,) names of the robot's capsules.
        capsule_links: (k,) links that they move with.
        capsule_ends: (k, 2, 3) ends of their segments in those links' frames [m].
        capsule_radii: (k,) [m].
        base_link: link of the base's box.
        base_box: (6,) its centre in that link's frame, then its size [m].
        boxes: (b, 6) centre in the world and size of each upright box of the scene [m].
        self_pairs: (p, 2) capsules that must keep apart; all keep off all boxes.
        base_pairs: (p,) capsules that must keep off the base's box.
    """

    name: str
    robot: str
    urdf: str
    joints: Names
    tool_link: str
    dt: float
    lower: Array
    upper: Array
    v_max: Array
    a_max: Array
    q: Array
    v_previous: Array
    inputs_previous: Array
    twist: Array
    T_world_target: Array
    posture: Array
    posture_weights: Array
    posture_gain: float
    linear_weight: float
    angular_weight: float
    damping: float
    rows: int
    safe: float
    influence: float
    rate: float
    capsule_names: Names
    capsule_links: Names
    capsule_ends: Array
    capsule_radii: Array
    base_link: str
    base_box: Array
    boxes: Array
    self_pairs: Array
    base_pairs: Array

    def __len__(self) -> int:
        return len(self.q)

    def save(self, path: Path) -> None:
        """Write the problem to a file that `load` reads."""
        values: dict[str, Any] = {field.name: getattr(self, field.name) for field in _FIELDS}
        np.savez(path, **values)

    @classmethod
    def load(cls, path: str | Path) -> Problem:
        """Read what `save` wrote."""
        with np.load(path, allow_pickle=False) as file:
            return cls(**{field.name: _plain(file[field.name]) for field in _FIELDS})

    def capsules(self) -> Iterator[tuple[str, str, Array, float]]:
        """Name, link, ends (2, 3) in the link's frame [m] and radius [m] of each capsule."""
        links, ends, radii = self.capsule_links, self.capsule_ends, self.capsule_radii
        return zip(self.capsule_names, links, ends, radii, strict=True)

    def pairs(self) -> list[tuple[str, str]]:
        """Names of all pairs that keep apart; a box of the scene is `box<i>`, the base `base`."""
        names = self.capsule_names
        own = [(names[i], names[j]) for i, j in self.self_pairs.astype(int).tolist()]
        base = [(names[i], "base") for i in self.base_pairs.astype(int).tolist()]
        scene = [(name, f"box{i}") for name in names for i in range(len(self.boxes))]
        return [*own, *base, *scene]


_FIELDS = fields(Problem)


def _plain(value: np.ndarray[Any, Any]) -> Any:
    if value.ndim == 0:
        return value.item()
    return tuple(value.tolist()) if value.dtype.kind == "U" else value


def capsule_frame(ends: Array) -> tuple[Array, float]:
    """A capsule as most libraries have it: along z of a frame of its own.

    Args:
        ends: (2, 3) of its segment [m].

    Returns:
        (4, 4) pose of the frame in the middle of the segment, and the segment's length [m].
    """
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    z = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2] = x, np.cross(z, x), z
    T[:3, 3] = 0.5 * (ends[0] + ends[1])
    return T, length


class Contestant(Protocol):
    """A controller with a problem of its own.

    Attributes:
        about: what it is, for the report: library, version, solver.
    """

    about: dict[str, Any]

    def step(self, k: int) -> Any:
        """Answer state k; this is what is timed. Raises what the library raises."""

    def velocities(self, k: int, answer: Any) -> Array:
        """(nv,) joint velocities that the answer to state k means [m/s, rad/s]."""


def serve(build: Callable[[Problem, Sequence[str]], Contestant]) -> None:
    """Be a contestant: build it from the command line's problem, then answer until told to stop.

    Args:
        build: makes it from the problem and the remaining arguments.
    """
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    contestant = build(problem := Problem.load(sys.argv[1]), sys.argv[2:])
    answers: dict[str, Callable[[], Any]] = {
        "round": lambda: timed_round(contestant, len(problem)),
        "answers": lambda: _answers(contestant, len(problem), len(problem.joints)),
    }
    print(json.dumps(contestant.about), file=out, flush=True)
    for line in sys.stdin:
        if line.strip() == "stop":
            break
        print(json.dumps(answers[line.strip()]()), file=out, flush=True)


def timed_round(contestant: Contestant, count: int) -> dict[str, Any]:
    """One step for each state: wall and CPU nanoseconds of each, and how many raised."""
    wall, cpu, failed = [0] * count, [0] * count, 0
    gc.collect()
    gc.disable()
    for k in range(count):
        cpu_start, start = time.process_time_ns(), time.perf_counter_ns()
        try:
            contestant.step(k)
        except Exception:  # whatever a library raises where it has no answer
            failed += 1
        wall[k] = time.perf_counter_ns() - start
        cpu[k] = time.process_time_ns() - cpu_start
    gc.enable()
    return {"wall": wall, "cpu": cpu, "failed": failed}


def _answers(contestant: Contestant, count: int, size: int) -> list[list[float]]:
    """Joint velocities for each state; not a number where the library raised."""
    return [_answer(contestant, k, size) for k in range(count)]


def _answer(contestant: Contestant, k: int, size: int) -> list[float]:
    try:
        answer = contestant.step(k)
    except Exception:
        return [math.nan] * size
    return [float(value) for value in contestant.velocities(k, answer)]


def fastest(make: Callable[[str], Contestant], solvers: Sequence[str], count: int) -> Contestant:
    """A contestant with the solver that takes the least median time, and answers (nearly) always.

    Args:
        make: a contestant with a solver.
        solvers: names to try.
        count: number of states.

    Returns:
        A fresh one with the fastest solver.
    """

    def cost(solver: str) -> tuple[float, float]:
        contestant = make(solver)
        timed_round(contestant, count)
        times = timed_round(contestant, count)
        return float(times["failed"] > 0.01 * count), float(np.median(times["wall"]))

    return make(min(solvers, key=cost))
