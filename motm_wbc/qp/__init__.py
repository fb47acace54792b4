"""The whole-body velocity QP: tasks, limits, collision rows, and what to do when infeasible."""

from motm_wbc.qp.bodies import Body, body_from_solid, moved_bodies, shapes_from_scene
from motm_wbc.qp.controller import WholeBodyController
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.result import WholeBodyResult
from motm_wbc.qp.tasks import (
    FreeBase,
    HeldObject,
    LinearTask,
    NavigatedBase,
    PostureTask,
    ToolTask,
)

__all__ = [
    "Body",
    "FreeBase",
    "HeldObject",
    "LinearTask",
    "NavigatedBase",
    "PostureTask",
    "ToolTask",
    "WholeBodyController",
    "WholeBodyParameters",
    "WholeBodyResult",
    "body_from_solid",
    "moved_bodies",
    "shapes_from_scene",
]
