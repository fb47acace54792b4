"""QP solvers behind one call, by name."""

from __future__ import annotations

from typing import Protocol

from motm_wbc.errors import UnknownName
from motm_wbc.geometry.arrays import Array
from motm_wbc.qp.daqp_solver import DaqpSolver
from motm_wbc.qp.osqp_solver import OsqpSolver
from motm_wbc.qp.other_solver import OtherSolver
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem


class QpSolver(Protocol):
    """Something that solves problems of one size."""

    def solve(self, problem: QpProblem) -> Array | None:
        """The optimum (n,), or None: infeasible, or failed. Never raises."""


def make_solver(name: str | QpSolver, n: int, k: int, parameters: WholeBodyParameters) -> QpSolver:
    """The solver of that name for n variables and k collision rows; a solver is its own.

    Raises:
        UnknownName: neither osqp nor daqp, nor a solver that qpsolvers finds installed.
    """
    if not isinstance(name, str):
        return name
    if name == "osqp":
        return OsqpSolver(n, k, parameters)
    if name == "daqp":
        return DaqpSolver()
    import qpsolvers

    if name not in qpsolvers.available_solvers:
        raise UnknownName("solver", name, {"osqp", "daqp", *qpsolvers.available_solvers})
    return OtherSolver(name)
