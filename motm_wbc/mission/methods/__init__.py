"""How the base is led: one file a method, each with the protocol `Method`."""

from motm_wbc.mission.methods.method import BaseDecision, BaseMoment, Method, MethodContext
from motm_wbc.mission.methods.registry import method_names, new_method

__all__ = [
    "BaseDecision",
    "BaseMoment",
    "Method",
    "MethodContext",
    "method_names",
    "new_method",
]
