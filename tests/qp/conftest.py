"""A robot, solids, and a closed loop that integrates what the controller commands."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from motm_wbc.geometry import polygons, se2
from motm_wbc.geometry.base_motion import BaseKind
from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import (
    Body,
    FreeBase,
    NavigatedBase,
    PostureTask,
    ToolTask,
    WholeBodyController,
)

DT = 1.0 / 120.0


@pytest.fixture(scope="session")
def frankie():
    return load_robot("frankie")


@pytest.fixture
def box():
    def make(name, x, y, size, bottom=0.0, role=SolidRole.OBSTACLE, velocity=(0.0, 0.0, 0.0)):
        return Body(
            name=name,
            role=role,
            outlines=(polygons.rectangle(size[0], size[1]),),
            radius=None,
            bottom=bottom,
            top=bottom + size[2],
            pose=np.array([x, y, 0.0]),
            velocity=np.array(velocity, dtype=float),
        )

    return make


@pytest.fixture
def twist():
    """A tool task; rotation about the vertical is free."""

    def make(*values):
        return ToolTask(np.array(values, dtype=float), weights=np.array([1.0, 1, 1, 1, 1, 0]))

    return make


@dataclass
class Run:
    """Every step's result, and the states that the commands led to."""

    results: list = field(default_factory=list)
    base: list = field(default_factory=list)
    q: list = field(default_factory=list)

    @property
    def clearance(self):
        return np.array([result.clearance for result in self.results])

    @property
    def scale(self):
        return np.array([result.scale for result in self.results])

    @property
    def arm(self):
        return np.array([result.arm for result in self.results])

    @property
    def inputs(self):
        return np.array([result.base for result in self.results])

    @property
    def rungs(self):
        return Counter(result.rung for result in self.results)


@pytest.fixture
def closed_loop(frankie):
    """Run the controller against its own commands; limits are checked at every step."""
    posture = frankie.posture
    task = PostureTask(posture.value, posture.weight, posture.lower, posture.upper)

    def run(
        *, tool=None, drive=None, bodies=(), steps=600, follow=True, q=None, dt=DT,
        model=frankie, solver="osqp", posture=task, **more,
    ):  # fmt: skip
        controller = WholeBodyController(model, dt, solver=solver)
        limits = model.base_limits
        change = np.array([limits.a_max] * (model.n_base - 1) + [limits.alpha_max]) * dt
        pose, q = np.zeros(3), np.array(model.home if q is None else q, dtype=float)
        last = np.zeros(model.n_base), np.zeros(model.n_arm)
        record = Run([], [pose], [q])
        for k in range(steps):
            wish = np.zeros(model.n_base) if drive is None else np.asarray(drive, dtype=float)
            reference = last[0] + np.clip(wish - last[0], -change, change)
            asked = tool(model.configuration(pose, q)) if callable(tool) else tool
            result = controller.step(
                base_pose=pose,
                q=q,
                previous=last,
                tools=() if asked is None else (asked,),
                base=NavigatedBase(reference) if follow else FreeBase(),
                posture=posture if model is frankie else None,
                bodies=bodies(k * dt) if callable(bodies) else bodies,
                **more,
            )
            check_limits(model, result, last, change, dt)
            last = result.base, result.arm
            sideways = result.base[1] if model.base_kind is BaseKind.OMNIDIRECTIONAL else 0.0
            pose = se2.integrate_twist(pose, result.base[0], sideways, result.base[-1], dt)
            q = q + result.arm * dt
            assert (q >= model.q_lower).all() and (q <= model.q_upper).all()
            record.results.append(result)
            record.base.append(pose)
            record.q.append(q)
        return record

    return run


def check_limits(model, result, last, change, dt):
    """Speeds and accelerations, exact but for rounding."""
    limits = model.base_limits
    assert -limits.v_reverse - 1e-12 <= result.base[0] <= limits.v_max + 1e-12
    assert abs(result.base[-1]) <= limits.omega_max + 1e-12
    assert (np.abs(result.arm) <= model.v_max + 1e-12).all()
    assert (np.abs(result.base - last[0]) <= change * (1.0 + 1e-5)).all()
    if result.rung in ("full", "brake"):
        assert (np.abs(result.arm - last[1]) <= model.a_max * dt * (1.0 + 1e-9)).all()
