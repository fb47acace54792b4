"""Robots: from a robot file to poses, Jacobians by inputs, manipulability and capsules."""

from motm_wbc.kinematics.card import summarise
from motm_wbc.kinematics.configuration import Configuration
from motm_wbc.kinematics.description import Part, RobotDescription
from motm_wbc.kinematics.inverse import IkResult, solve_ik
from motm_wbc.kinematics.loading import load_description, load_robot
from motm_wbc.kinematics.model import Box, Capsules, Posture, RobotModel

__all__ = [
    "Box",
    "Capsules",
    "Configuration",
    "IkResult",
    "Part",
    "Posture",
    "RobotDescription",
    "RobotModel",
    "load_description",
    "load_robot",
    "solve_ik",
    "summarise",
]
