"""Plants: a robot and its world, simulated; grasp physics, failure injection and sensing."""

from motm_wbc.simulation.factory import available_plants, default_plant, make_plant
from motm_wbc.simulation.grasp import Attempt, Release
from motm_wbc.simulation.parameters import PhysicsParameters
from motm_wbc.simulation.plant import SimulatedPlant

__all__ = [
    "Attempt",
    "PhysicsParameters",
    "Release",
    "SimulatedPlant",
    "available_plants",
    "default_plant",
    "make_plant",
]
