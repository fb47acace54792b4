import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.errors import UnknownName
from motm_wbc.qp.osqp_solver import OsqpSolver
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import NO_BOUND, QpProblem
from motm_wbc.qp.solvers import make_solver

N, K = 8, 12
PARAMETERS = WholeBodyParameters()
SOLVERS = sorted({"osqp", "daqp", *qpsolvers.available_solvers})
VIOLATION = {"daqp": 1e-8, "quadprog": 1e-8}  # 1e-4 for all else
ANSWERED = {"osqp": 0.97, "piqp": 0.97}  # share of feasible problems, the rest is daqp's

every_solver = pytest.mark.parametrize("name", SOLVERS)


def random_problem(seed, *, feasible=True):
    """The sizes and weights of a real step: small damping, stiff tool task, some rows in use."""
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(6, N)) * 0.5
    weights = np.array([50.0] * 3 + [5.0] * 3)
    problem = QpProblem.empty(N, K)
    problem.H[:] = J.T @ (weights[:, None] * J) + np.diag([30.0] + [0.02] * (N - 1))
    problem.f[:] = -J.T @ (weights * rng.normal(size=6) * 0.3)
    centre = rng.uniform(-1, 1, N)
    problem.box_lower[:] = centre - rng.uniform(0.01, 0.2, N)
    problem.box_upper[:] = centre + rng.uniform(0.01, 0.2, N)
    used = rng.permutation(K)[: rng.integers(0 if feasible else 1, K + 1)]
    problem.A[used] = rng.normal(size=(len(used), N)) * 0.5
    inside = rng.uniform(problem.box_lower, problem.box_upper)
    problem.bound[used] = problem.A[used] @ inside + rng.uniform(0, 0.1, len(used))
    if not feasible:
        problem.bound[used[:1]] = -50.0
    return problem


def cost(problem, x):
    return 0.5 * x @ problem.H @ x + problem.f @ x


def violation(problem, x):
    values = np.concatenate((x, problem.A @ x))
    return max((problem.lower - values).max(), (values - problem.upper).max())


def reference(problem):
    """By another way than the solvers go: quadprog on the rows and bounds that there are."""
    rows = np.vstack((np.eye(N), -np.eye(N), problem.A))
    bounds = np.concatenate((problem.box_upper, -problem.box_lower, problem.bound))
    used = bounds < NO_BOUND
    return qpsolvers.solve_qp(
        problem.H, problem.f, rows[used], bounds[used], solver="quadprog"
    )  # fmt: skip


@every_solver
def test_random_problems_have_the_reference_optimum_on_one_workspace(name):
    solver = make_solver(name, N, K, PARAMETERS)
    answered, count = 0, 100
    for seed in range(count):
        problem = random_problem(seed)
        x = solver.solve(problem)
        if x is None:
            continue
        answered += 1
        assert violation(problem, x) <= VIOLATION.get(name, 1e-4)
        assert cost(problem, problem.clip(x)) == pytest.approx(
            cost(problem, reference(problem)), abs=1e-3
        )
    assert answered >= ANSWERED.get(name, 1.0) * count


@every_solver
def test_an_infeasible_problem_is_none_and_leaves_no_trace(name):
    solver, fresh = make_solver(name, N, K, PARAMETERS), make_solver(name, N, K, PARAMETERS)
    for seed in range(10):
        assert solver.solve(random_problem(seed, feasible=False)) is None
        after, alone = solver.solve(random_problem(seed)), fresh.solve(random_problem(seed))
        assert after is not None and alone is not None
        np.testing.assert_allclose(after, alone, atol=2e-3)


@every_solver
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_equal_bounds_are_legal(name, seed):
    problem = random_problem(seed)
    problem.A[:], problem.bound[:] = 0.0, NO_BOUND
    problem.box_upper[: N - 1] = problem.box_lower[: N - 1]
    x = make_solver(name, N, K, PARAMETERS).solve(problem)
    if x is not None:  # some solvers want an interior; daqp answers for them
        np.testing.assert_allclose(x[: N - 1], problem.box_lower[: N - 1], atol=1e-4)
        assert violation(problem, x) <= 1e-4
    assert x is not None or name not in ("osqp", "daqp")


@every_solver
def test_without_any_bound_it_is_the_free_optimum(name):
    problem = QpProblem.empty(N, K)
    problem.f[:] = np.arange(N) / N
    x = make_solver(name, N, K, PARAMETERS).solve(problem)
    np.testing.assert_allclose(x, -problem.f, atol=1e-4)


@every_solver
def test_near_parallel_and_repeated_rows(name):
    solver = make_solver(name, N, K, PARAMETERS)
    for seed in range(20):
        problem = random_problem(seed)
        rng = np.random.default_rng(seed)
        row = rng.normal(size=N)
        for slot in range(K):  # a fan of rows within 1e-9 of each other, all through one point
            problem.A[slot] = row * (1.0 + slot / 7.0) + 1e-9 * rng.normal(size=N)
            inside = (problem.box_lower + problem.box_upper) / 2.0
            problem.bound[slot] = problem.A[slot] @ inside - 1e-3
        x = solver.solve(problem)
        if name in ("osqp", "daqp"):
            assert x is not None
        if x is not None:
            assert violation(problem, x) <= VIOLATION.get(name, 1e-4)
            assert cost(problem, problem.clip(x)) <= cost(problem, reference(problem)) + 1e-3


@every_solver
def test_a_degenerate_vertex(name):
    """Twelve rows and eight bounds meet in the one point that is best."""
    problem = QpProblem.empty(N, K)
    problem.f[:] = -1.0
    problem.box_upper[:] = 0.25
    problem.A[:] = np.abs(np.random.default_rng(1).normal(size=(K, N)))
    problem.bound[:] = problem.A.sum(axis=1) * 0.25
    x = make_solver(name, N, K, PARAMETERS).solve(problem)
    np.testing.assert_allclose(x, np.full(N, 0.25), atol=1e-4)


@every_solver
@pytest.mark.parametrize("field", ["H", "f", "A", "upper", "lower"])
def test_no_numbers_is_none_and_never_an_exception(name, field):
    solver = make_solver(name, N, K, PARAMETERS)
    bad = random_problem(3)
    bad.bound[0] = 0.5
    for value in (np.nan, np.inf, -np.inf):
        if (field, value) in (("upper", np.inf), ("lower", -np.inf)):
            continue
        getattr(bad, field).flat[0] = value
        x = solver.solve(bad)
        assert x is None or name == "daqp"  # its own answer is checked by the ladder
        good = solver.solve(random_problem(3))
        np.testing.assert_allclose(good, reference(random_problem(3)), atol=2e-3)


def test_crossed_bounds_are_never_accepted_as_solved_by_daqp():
    problem = random_problem(5)
    problem.box_lower[2] = problem.box_upper[2] + 1e-3
    assert make_solver("daqp", N, K, PARAMETERS).solve(problem) is None


def test_osqp_is_exact_in_nearly_all_cases_and_never_worse_than_its_tolerance():
    osqp, daqp = (make_solver(name, N, K, PARAMETERS) for name in ("osqp", "daqp"))
    gaps = []
    for seed in range(300):
        problem = random_problem(1000 + seed)
        first, second = osqp.solve(problem), daqp.solve(problem)
        assert second is not None
        if first is not None:
            gap = first - second  # in the metric of the cost: a flat direction is worth nothing
            gaps.append(float(gap @ problem.H @ gap))
    assert len(gaps) >= 291  # what OSQP leaves, daqp answers
    assert max(gaps) <= 1e-4
    assert np.quantile(gaps, 0.95) <= 1e-15


def test_a_warm_start_pays():
    """Twenty problems in a row that change little, against each one alone."""
    iterations = {"warm": 0, "cold": 0}
    for seed in range(10):
        warm = OsqpSolver(N, K, PARAMETERS)
        first, last = random_problem(seed), random_problem(seed)
        for step in range(20):
            last.f[:] = first.f * (1.0 + 0.01 * step)
            for kind, solver in (("warm", warm), ("cold", OsqpSolver(N, K, PARAMETERS))):
                solver.solve(last)
                iterations[kind] += solver.iterations
    assert iterations["warm"] < 0.6 * iterations["cold"]


def test_the_same_problems_give_the_same_answers_to_the_bit():
    answers = []
    for _ in range(2):
        solver = make_solver("osqp", N, K, PARAMETERS)
        answers.append([solver.solve(random_problem(seed)) for seed in range(60)])
    for first, second in zip(*answers, strict=True):
        assert (first is None) == (second is None)
        assert first is None or np.array_equal(first, second)


@every_solver
def test_a_solver_leaves_the_problem_as_it_is(name):
    problem, same = random_problem(11), random_problem(11)
    make_solver(name, N, K, PARAMETERS).solve(problem)
    for field in ("H", "f", "A", "lower", "upper"):
        np.testing.assert_array_equal(getattr(problem, field), getattr(same, field))


def test_an_unknown_solver_is_refused_by_name():
    with pytest.raises(UnknownName, match=r"unknown solver 'osqq'; did you mean 'osqp'"):
        make_solver("osqq", N, K, PARAMETERS)


def test_a_solver_that_raises_anything_is_none(monkeypatch):
    def broken(*_, **__):
        raise RuntimeError("any")

    solver = make_solver("quadprog", N, K, PARAMETERS)
    monkeypatch.setattr(qpsolvers, "solve_qp", broken)
    assert solver.solve(random_problem(3)) is None
    osqp = OsqpSolver(N, K, PARAMETERS)
    osqp._solver = None
    assert osqp.solve(random_problem(3)) is None
