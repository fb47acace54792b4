import numpy as np
import pytest

from benchmarks.random_states import UNDECIDED, margin, run
from motm_wbc.qp.problem import QpProblem

VIOLATION = {"daqp": 1e-8, "osqp": 1e-4}
both = pytest.mark.parametrize("solver", ["daqp", "osqp"])


def check(report, states):
    assert report.states == states
    # neither kind is rare, or the states would prove nothing
    assert report.feasible >= 0.3 * states and report.infeasible >= 0.1 * states
    assert report.undecided <= 0.02 * states
    assert {"full", "no_acceleration", "soft_collision"} <= set(report.rungs)
    assert report.lower_rung == 0
    assert report.full_without_ground == 0
    assert report.rungs["brake"] == 0
    assert report.unnamed == 0
    assert report.violation <= VIOLATION[report.solver]
    assert report.hard_violation <= 1e-9
    assert report.fallbacks <= 0.02 * states


@both
def test_random_states_are_answered_by_the_highest_rung_there_is(solver):
    check(run(solver, 1000), 1000)


@pytest.mark.slow
@both
def test_twenty_thousand_random_states(solver):
    report = run(solver, 20_000, seed=1)
    check(report, 20_000)
    assert np.quantile(report.infeasible_times, 0.99) <= 1e-3


def test_the_margin_is_the_least_violation():
    problem = QpProblem.empty(2, 2)
    problem.box_lower[:], problem.box_upper[:] = -1.0, 1.0
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(-1.0)
    problem.A[0], problem.bound[0] = (2.0, 0.0), -2.0 + 1e-3
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(-0.25e-3)
    problem.bound[0] = -2.0 - 1e-3
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(0.25e-3)
    problem.bound[0] = -2.0
    assert abs(margin(problem, problem.box_lower, problem.box_upper)) < UNDECIDED


def test_a_variable_that_is_fixed_is_no_matter_of_doubt():
    problem = QpProblem.empty(2, 1)
    problem.box_lower[:], problem.box_upper[:] = (0.5, -1.0), (0.5, 1.0)
    problem.A[0], problem.bound[0] = (1.0, 0.0), 0.6
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(-0.1)
    problem.bound[0] = 0.4
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(0.1)


def test_crossed_bounds_are_infeasible():
    problem = QpProblem.empty(2, 1)
    problem.box_lower[:], problem.box_upper[:] = (0.5, -1.0), (0.4, 1.0)
    assert margin(problem, problem.box_lower, problem.box_upper) == pytest.approx(0.05)
