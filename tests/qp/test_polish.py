"""The polish is right or says no, whatever it is told about the active constraints."""

import numpy as np
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st

from motm_wbc.qp.polish import polish
from motm_wbc.qp.problem import NO_BOUND

N, K = 5, 6


def case(seed):
    rng = np.random.default_rng(seed)
    J = rng.normal(size=(N, N))
    A = rng.normal(size=(K, N))
    lower = np.concatenate((-rng.uniform(0.1, 1.0, N), np.full(K, -NO_BOUND)))
    upper = np.concatenate((rng.uniform(0.1, 1.0, N), rng.uniform(0.05, 1.0, K)))
    upper[N + 4 :], A[4:] = NO_BOUND, 0.0  # not in use
    return J @ J.T + 0.05 * np.eye(N), 2.0 * rng.normal(size=N), A, lower, upper


def optimum(H, f, A, lower, upper):
    return qpsolvers.solve_qp(
        H, f, A[:4], upper[N : N + 4], lb=lower[:N], ub=upper[:N], solver="daqp"
    )


def polished(data, guess):
    x, y = np.full(N, np.nan), np.full(N + K, np.nan)
    work = np.empty((N, N)), np.empty((N, N)), np.empty((N, N)), np.empty((3, N))
    ok = polish(*data, guess.astype(float), x, y, *work, np.empty(N, np.intp))
    return ok, x, y


def true_guess(data):
    x = optimum(*data)
    _, _, A, lower, upper = data
    values = np.concatenate((x, A @ x))
    return (np.abs(values - upper) < 1e-9) * 1.0 - (np.abs(values - lower) < 1e-9) * 1.0


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10**6))
def test_the_true_active_set_gives_the_optimum_and_its_multipliers(seed):
    data = H, f, A, *_ = case(seed)
    ok, x, y = polished(data, true_guess(data))
    assert ok
    np.testing.assert_allclose(x, optimum(*data), atol=1e-8)
    rows = np.vstack((np.eye(N), A))
    np.testing.assert_allclose(H @ x + f + rows.T @ y, 0.0, atol=1e-8)


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_any_guess_gives_the_optimum_or_no(seed, other):
    data = case(seed)
    ok, x, _ = polished(data, np.random.default_rng(other).integers(-1, 2, N + K))
    if ok:
        np.testing.assert_allclose(x, optimum(*data), atol=1e-8)


def test_one_wrong_guess_is_repaired_as_a_rule():
    repaired = 0
    for seed in range(100):
        data = case(seed)
        guess = true_guess(data)
        guess[seed % N] = 0.0 if guess[seed % N] else 1.0
        repaired += polished(data, guess)[0]
    assert repaired >= 90


def test_a_row_that_the_others_imply_does_no_harm():
    H, f, A, lower, upper = case(3)
    A[1], upper[N + 1] = A[0], upper[N]
    guess = np.zeros(N + K)
    guess[N : N + 2] = 1.0
    f[:] = -50.0 * A[0]
    data = H, f, A, lower, upper
    ok, x, _ = polished(data, guess)
    assert ok
    np.testing.assert_allclose(x, optimum(*data), atol=1e-8)


def test_no_positive_definite_cost_is_no():
    data = case(1)
    data[0][0, 0] = -1.0
    assert not polished(data, np.zeros(N + K))[0]
    data[0][0, 0] = np.nan
    assert not polished(data, np.zeros(N + K))[0]
