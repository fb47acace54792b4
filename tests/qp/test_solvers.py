import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.errors import UnknownName
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import QpProblem
from motm_wbc.qp.solvers import make_solver

N, K = 8, 12
PARAMETERS = WholeBodyParameters()


def random_problem(seed, *, feasible=True):
    """The sizes and weights of a real step: small damping, stiff tool task, some rows in use."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(6, N)) * 0.5
    weights = np.array([50.0] * 3 + [5.0] * 3)
    H = J.T @ (weights[:, None] * J) + np.diag([30.0] + [0.02] * (N - 1))
    f = -J.T @ (weights * rng.normal(size=6) * 0.3)
    centre = rng.uniform(-1, 1, N)
    lower, upper = centre - rng.uniform(0.01, 0.2, N), centre + rng.uniform(0.01, 0.2, N)
    A, bound = rng.normal(size=(K, N)) * 0.5, np.full(K, np.inf)
    used = rng.permutation(K)[: rng.integers(0, K + 1)]
    bound[used] = A[used] @ rng.uniform(lower, upper) + rng.uniform(0, 0.1, len(used))
    if not feasible:
        bound[used[:1] if len(used) else 0] = -50.0
    A[np.isinf(bound)] = 0.0
    return QpProblem(H, f, A, bound, lower, upper, lower, upper)


def reference(problem):
    used = np.isfinite(problem.bound)
    return qpsolvers.solve_qp(
        problem.H,
        problem.f,
        problem.A[used] if used.any() else None,
        problem.bound[used] if used.any() else None,
        lb=problem.lower,
        ub=problem.upper,
        solver="daqp",
    )


@pytest.mark.parametrize("name", ["osqp", "daqp"])
def test_random_problems_have_the_reference_optimum_on_one_workspace(name):
    solver = make_solver(name, N, K, PARAMETERS)
    solved = 0
    for seed in range(400):
        problem = random_problem(seed)
        x = solver.solve(problem)
        if x is None:
            continue
        solved += 1
        expected = reference(problem)
        assert cost(problem, problem.clip(x)) == pytest.approx(cost(problem, expected), abs=1e-3)
        assert problem.excess(problem.clip(x)) <= 1e-4
    assert solved >= 396  # what OSQP leaves, daqp answers


def cost(problem, x):
    return 0.5 * x @ problem.H @ x + problem.f @ x


def test_osqp_and_daqp_agree_to_1e_4():
    osqp, daqp = (make_solver(name, N, K, PARAMETERS) for name in ("osqp", "daqp"))
    worst, compared = 0.0, 0
    for seed in range(300):
        problem = random_problem(1000 + seed)
        first, second = osqp.solve(problem), daqp.solve(problem)
        assert second is not None
        if first is not None:
            compared += 1
            # in the metric of the cost: a flat direction is worth nothing
            gap = problem.clip(first) - second
            worst = max(worst, float(gap @ problem.H @ gap))
    assert compared >= 297
    assert worst <= 1e-4


@pytest.mark.parametrize("name", ["osqp", "daqp"])
def test_an_infeasible_problem_is_none_and_leaves_no_trace(name):
    solver, fresh = make_solver(name, N, K, PARAMETERS), make_solver(name, N, K, PARAMETERS)
    seeds = [seed for seed in range(40) if np.isfinite(random_problem(seed).bound).any()][:15]
    for seed in seeds:
        assert solver.solve(random_problem(seed, feasible=False)) is None
        after, alone = solver.solve(random_problem(seed)), fresh.solve(random_problem(seed))
        assert after is not None and alone is not None
        np.testing.assert_allclose(after, alone, atol=2e-3)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_equal_bounds_are_legal(seed):
    problem = random_problem(seed)
    fixed = QpProblem(
        problem.H, problem.f, 0 * problem.A, np.full(K, np.inf), problem.lower, problem.lower,
        problem.lower, problem.lower,
    )  # fmt: skip
    for name in ("osqp", "daqp"):
        x = make_solver(name, N, K, PARAMETERS).solve(fixed)
        np.testing.assert_allclose(x, problem.lower, atol=1e-4)


def test_warm_start_pays():
    solver = make_solver("osqp", N, K, PARAMETERS)
    problem = random_problem(7)
    solver.solve(problem)
    first = solver._solver._solver.info.iter
    solver.solve(problem)
    assert solver._solver._solver.info.iter < first


def test_the_same_problems_give_the_same_answers_to_the_bit():
    answers = []
    for _ in range(2):
        solver = make_solver("osqp", N, K, PARAMETERS)
        answers.append([solver.solve(random_problem(seed)) for seed in range(30)])
    for first, second in zip(*answers, strict=True):
        assert (first is None) == (second is None)
        assert first is None or np.array_equal(first, second)


def test_an_unknown_solver_is_refused_by_name():
    with pytest.raises(UnknownName, match=r"unknown solver 'osqq'; did you mean 'osqp'"):
        make_solver("osqq", N, K, PARAMETERS)


def test_any_solver_of_qpsolvers_will_do(monkeypatch):
    monkeypatch.setattr(qpsolvers, "available_solvers", ["other"])
    real = qpsolvers.solve_qp
    monkeypatch.setattr(qpsolvers, "solve_qp", lambda *a, **k: real(*a, **{**k, "solver": "daqp"}))
    solver = make_solver("other", N, K, PARAMETERS)
    problem = random_problem(3)
    np.testing.assert_allclose(solver.solve(problem), reference(problem), atol=1e-9)
    assert solver.solve(random_problem(3, feasible=False)) is None
