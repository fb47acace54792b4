import numpy as np
import pytest

from motm_wbc.qp.ladder import Ladder
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem
from motm_wbc.qp.solvers import make_solver

PARAMETERS = WholeBodyParameters(collision_rows=2)
JOINTS = ("shoulder", "elbow")


def problem(rows=(), *, wide=1.0, narrow=0.1, f=(0.0, 0.0, 0.0)):
    """One base variable in [0, 1], two joints: narrow bounds are accelerations, wide are hard."""
    A, bound = np.zeros((2, 3)), np.full(2, np.inf)
    for slot, (row, limit) in enumerate(rows):
        A[slot], bound[slot] = row, limit
    return QpProblem(
        H=np.eye(3),
        f=np.array(f, dtype=float),
        A=A,
        bound=bound,
        lower=np.array([0.0, -narrow, -narrow]),
        upper=np.array([1.0, narrow, narrow]),
        hard_lower=np.array([0.0, -wide, -wide]),
        hard_upper=np.array([1.0, wide, wide]),
    )


def solve(case, solver="osqp"):
    ladder = Ladder(make_solver(solver, 3, 2, PARAMETERS), JOINTS, PARAMETERS)
    return ladder.solve(case, lambda slot: f"pair{slot}")


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
def test_a_feasible_step_is_full(solver):
    answer = solve(problem([([1, 1, 0], -0.05)], f=(-1, 0, 0)), solver)
    assert (answer.rung, answer.reason, answer.solver_fallback) == ("full", "", False)
    # of 1/2 |x|^2 - s with s + shoulder <= -0.05: s = 0.05 is held by shoulder = -0.1
    np.testing.assert_allclose(answer.x, [0.05, -0.1, 0.0], atol=1e-4)


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
def test_acceleration_gives_way_first_no_more_than_needed(solver):
    answer = solve(problem([([0, 1, 0], -0.4)]), solver)
    assert answer.rung == "no_acceleration"
    np.testing.assert_allclose(answer.x, [0.0, -0.4, 0.0], atol=1e-6)
    assert answer.reason == ("gave way: acceleration of shoulder by 0.3 rad/s; held against pair0")


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
def test_collision_rows_give_way_next_and_hard_limits_never(solver):
    answer = solve(problem([([0, 1, 0], -3.0), ([0, 0, -1], 0.05)]), solver)
    assert answer.rung == "soft_collision"
    np.testing.assert_allclose(answer.x[1], -1.0, atol=1e-9)
    assert answer.reason.startswith("gave way: pair0 by 2 m/s; acceleration of shoulder by 0.9")
    assert answer.x[2] >= -0.05 - 1e-6  # the row that can be kept is kept


def test_two_rows_that_contradict_each_other_share_the_excess():
    answer = solve(problem([([0, 1, 0], -0.3), ([0, -1, 0], -0.3)]))
    assert answer.rung == "soft_collision"
    assert "pair0" in answer.reason and "pair1" in answer.reason
    assert abs(answer.x[1]) <= 0.3 + 1e-6


def test_a_failing_solver_is_replaced_and_counted():
    class Broken:
        def solve(self, case):
            return np.full(3, np.nan)

    answer = Ladder(Broken(), JOINTS, PARAMETERS).solve(problem(f=(-1, 0, 0)), str)
    assert answer.rung == "full" and answer.solver_fallback
    np.testing.assert_allclose(answer.x, [1.0, 0.0, 0.0], atol=1e-9)


def test_an_answer_that_breaks_a_row_is_not_taken():
    class Wrong:
        def solve(self, case):
            return np.array([1.0, 0.0, 0.0])

    answer = Ladder(Wrong(), JOINTS, PARAMETERS).solve(problem([([1, 0, 0], 0.5)]), str)
    assert answer.solver_fallback and answer.x[0] <= 0.5 + 1e-6


def test_without_any_answer_it_says_brake():
    bad = problem()
    bad.H[0, 0] = np.nan
    answer = solve(bad, "daqp")
    assert answer.x is None and answer.rung == "brake"
