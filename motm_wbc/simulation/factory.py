"""Plants by name; the physics engine is imported when it is asked for."""

from __future__ import annotations

import importlib.util

from motm_wbc.errors import Unavailable, UnknownName
from motm_wbc.kinematics.model import RobotModel
from motm_wbc.scene.scenario import GraspFailure, Scenario
from motm_wbc.simulation.parameters import PhysicsParameters
from motm_wbc.simulation.plant import PlantSetup, SimulatedPlant

_KINDS = ("bullet", "kinematic")


def _has_pybullet() -> bool:
    return importlib.util.find_spec("pybullet") is not None


def available_plants() -> tuple[str, ...]:
    """Names of the plants that can run here, the default one first."""
    return _KINDS if _has_pybullet() else ("kinematic",)


def default_plant() -> str:
    """`bullet` where pybullet can be imported, else `kinematic`."""
    return available_plants()[0]


def make_plant(
    kind: str,
    scenario: Scenario,
    model: RobotModel,
    *,
    control_period: float = 1.0 / 120.0,
    seed: int = 0,
    parameters: PhysicsParameters | None = None,
    failure: GraspFailure | None = None,
) -> SimulatedPlant:
    """A simulated robot in its world, at the start of the run.

    Args:
        kind: `bullet` (rigid-body physics, needs pybullet) or `kinematic`.
        scenario: the world.
        model: the robot.
        control_period: time between commands [s].
        seed: of noise and random failures; 0 is the nominal run, without noise.
        parameters: numbers of the physics; None: the defaults.
        failure: which grasp attempts fail; None: what the scenario says.

    Raises:
        UnknownName: there is no such plant.
        Unavailable: pybullet can't be imported here.
        InputError: an argument is not legal.
    """
    if kind not in _KINDS:
        raise UnknownName("plant", kind, _KINDS)
    setup = PlantSetup(
        scenario,
        model,
        control_period,
        seed,
        parameters or PhysicsParameters(),
        failure or scenario.grasp_failure,
    )
    if kind == "kinematic":
        from motm_wbc.simulation.kinematic import KinematicPlant

        return KinematicPlant(setup)
    if not _has_pybullet():
        raise Unavailable(
            "pybullet can't be imported (it has wheels up to Python 3.11); legal: kinematic",
            "plant 'bullet'",
        )
    from motm_wbc.simulation.bullet import BulletPlant

    return BulletPlant(setup)
