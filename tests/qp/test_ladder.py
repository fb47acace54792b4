import time

import numpy as np
import pytest

from motm_wbc.qp.ladder import Ladder
from motm_wbc.qp.parameters import WholeBodyParameters
from motm_wbc.qp.problem import NO_BOUND, Limit, QpProblem
from motm_wbc.qp.solvers import make_solver

PARAMETERS = WholeBodyParameters(collision_rows=3)
VARIABLES = ("base", "shoulder", "elbow")
both = pytest.mark.parametrize("solver", ["osqp", "daqp"])


def problem(rows=(), *, wide=1.0, narrow=0.1, f=(0.0, 0.0, 0.0)):
    """One base variable in [0, 1], two joints: narrow bounds are accelerations, wide are hard."""
    case = QpProblem.empty(3, 3)
    for slot, (row, limit) in enumerate(rows):
        case.A[slot], case.bound[slot] = row, limit
    case.f[:] = f
    case.box_lower[:], case.box_upper[:] = (0.0, -narrow, -narrow), (1.0, narrow, narrow)
    case.hard_lower[:], case.hard_upper[:] = (0.0, -wide, -wide), (1.0, wide, wide)
    return case


def ladder(solver="osqp", name=None):
    solver = make_solver(solver, 3, 3, PARAMETERS) if isinstance(solver, str) else solver
    return Ladder(solver, name or "osqp", VARIABLES, 2, 3, PARAMETERS)


def solve(case, solver="osqp"):
    return ladder(solver, solver).solve(case, lambda slot: f"pair{slot}")


@both
def test_a_feasible_step_is_full(solver):
    answer = solve(problem([([1, 1, 0], -0.05)], f=(-1, 0, 0)), solver)
    assert (answer.rung, answer.reason, answer.solver_fallback) == ("full", "", False)
    assert (answer.solver, answer.note, answer.conflict) == (solver, "", None)
    # of 1/2 |x|^2 - s with s + shoulder <= -0.05: s = 0.05 is held by shoulder = -0.1
    np.testing.assert_allclose(answer.x, [0.05, -0.1, 0.0], atol=1e-8)


@both
def test_acceleration_gives_way_first_no_more_than_needed(solver):
    answer = solve(problem([([0, 1, 0], -0.4)]), solver)
    assert answer.rung == "no_acceleration"
    np.testing.assert_allclose(answer.x, [0.0, -0.4, 0.0], atol=1e-6)
    assert answer.reason == (
        "acceleration of shoulder against pair0; gave way: acceleration of shoulder by 0.3"
    )


@both
def test_collision_rows_give_way_next_and_hard_limits_never(solver):
    answer = solve(problem([([0, 1, 0], -3.0), ([0, 0, -1], 0.05)]), solver)
    assert answer.rung == "soft_collision"
    np.testing.assert_allclose(answer.x[1], -1.0, atol=1e-9)
    assert answer.reason == (
        "speed of shoulder against pair0; gave way: pair0 by 2, acceleration of shoulder by 0.9"
    )
    assert answer.x[2] >= -0.05 - 1e-6  # the row that can be kept is kept


def test_two_rows_that_contradict_each_other_share_the_excess():
    answer = solve(problem([([0, 1, 0], -0.3), ([0, -1, 0], -0.3)]))
    assert answer.rung == "soft_collision"
    assert answer.reason.startswith("pair0 against pair1; gave way: pair")
    assert abs(answer.x[1]) <= 0.3 + 1e-6


def acceleration_and_row():
    return problem([([0, 0, 1], -0.4), ([1, 0, 0], 0.5)])


def velocity_and_row():
    return problem([([0, 0, 1], -1.5), ([1, 0, 0], 0.5)])


def position_and_row():
    case = problem([([0, 0, 1], -0.2), ([0, 1, 0], 0.05)])
    case.hard_lower[2] = case.box_lower[2] = -0.02
    case.lower_kind[2] = Limit.POSITION
    return case


def row_and_row():
    return problem([([0, 1, 1], -0.05), ([1, 0, 0], 0.5), ([0, -1, -1], -0.05)])


def base_acceleration_and_row():
    case = problem([([1, 0, 0], 0.2), ([0, 0, 1], 0.01)])
    case.hard_lower[0] = case.box_lower[0] = 0.4
    case.lower_kind[0] = Limit.ACCELERATION
    return case


def base_speed_and_row():
    return problem([([-1, 0, 0], -1.2), ([0, 0, 1], 0.01)])


def lock_and_row():
    case = problem([([0, 1, 0], 0.0), ([0, 0, -1], -0.05)])
    case.hard_lower[2] = case.hard_upper[2] = case.box_lower[2] = case.box_upper[2] = 0.0
    case.lower_kind[2] = case.upper_kind[2] = Limit.LOCK
    return case


def position_and_acceleration():
    case = problem([([0, 1, 0], 0.0)])  # the elbow is too fast to stop before its end
    case.box_lower[2], case.box_upper[2], case.hard_upper[2] = 0.3, 0.05, 0.05
    case.upper_kind[2] = Limit.POSITION
    return case


def three_of_them():
    return problem([([0, 1, 1], -0.3), ([1, 0, 0], 0.5)])


def two_at_once():
    return problem([([0, 1, 0], -0.4), ([0, 0, -1], -0.4)])


@both
@pytest.mark.parametrize(
    ("planted", "rung", "named"),
    [
        (acceleration_and_row, "no_acceleration", ["acceleration of elbow against pair0"]),
        (velocity_and_row, "soft_collision", ["speed of elbow against pair0"]),
        (position_and_row, "soft_collision", ["position of elbow against pair0"]),
        (row_and_row, "soft_collision", ["pair0 against pair2"]),
        (base_acceleration_and_row, "soft_collision", ["acceleration of base against pair0"]),
        (base_speed_and_row, "soft_collision", ["speed of base against pair0"]),
        (lock_and_row, "soft_collision", ["lock of elbow against pair1"]),
        (
            position_and_acceleration,
            "no_acceleration",
            ["acceleration of elbow against position of elbow"],
        ),
        (
            three_of_them,
            "no_acceleration",
            ["acceleration of shoulder against acceleration of elbow against pair0"],
        ),
        (
            two_at_once,
            "no_acceleration",
            ["acceleration of elbow against pair1", "acceleration of shoulder against pair0"],
        ),
    ],
)
def test_a_planted_contradiction_is_named_and_nothing_else(solver, planted, rung, named):
    case = planted()
    answer = solve(case, solver)
    assert answer.rung == rung
    conflict = answer.conflict
    names = [" against ".join(map(conflict.name, members)) for members in conflict.sets]
    assert sorted(names) == named
    assert "gave way: " in answer.reason
    assert (answer.x >= case.hard_lower).all() and (answer.x <= case.hard_upper).all()
    if rung == "no_acceleration":
        assert case.excess(answer.x) <= 1e-6


def test_each_conflict_dissolves_with_any_one_limit_less():
    rng = np.random.default_rng(4)
    found = 0
    for _ in range(60):
        case = problem([(rng.normal(size=3), rng.uniform(-0.6, 0.2)) for _ in range(3)])
        conflict = solve(case).conflict
        for members in conflict.sets if conflict else ():
            found += 1
            assert not conflict._feasible(np.array(members))
            for index in range(len(members)):
                assert conflict._feasible(np.delete(np.array(members), index))
    assert found >= 20


def test_the_reason_is_of_the_step_that_it_was_for():
    """The problem is overwritten in the next step, the text is made later."""
    case = problem([([0, 1, 0], -0.4)])
    answer = solve(case)
    case.A[:], case.lower[:], case.upper[:] = 0.0, -NO_BOUND, NO_BOUND
    assert answer.reason.startswith("acceleration of shoulder against pair0; gave way")


def test_hard_limits_that_leave_nothing_brake_and_are_named():
    case = problem()
    case.hard_lower[1], case.hard_upper[1] = 0.5, 0.2
    case.box_lower[1], case.box_upper[1] = 0.5, 0.2
    answer = solve(case)
    assert answer.x is None and answer.rung == "brake"
    assert answer.reason == "no solver found an answer; speed of shoulder against speed of shoulder"


class Stub:
    def __init__(self, value, seconds=0.0):
        self.value, self.seconds, self.asked = value, seconds, 0

    def solve(self, case):
        self.asked += 1
        end = time.thread_time() + self.seconds
        while time.thread_time() < end:
            pass
        return self.value


@pytest.mark.parametrize(
    "value", [None, np.full(3, np.nan), np.array([np.inf, 0, 0]), np.zeros(2), np.zeros((3, 1))]
)
def test_a_failing_solver_is_replaced_and_counted(value):
    answer = ladder(Stub(value), "stub").solve(problem(f=(-1, 0, 0)), str)
    assert answer.rung == "full" and answer.solver_fallback and answer.solver == "daqp"
    np.testing.assert_allclose(answer.x, [1.0, 0.0, 0.0], atol=1e-9)


def test_an_answer_that_breaks_a_row_is_not_taken():
    wrong = Stub(np.array([1.0, 0.0, 0.0]))
    answer = ladder(wrong, "stub").solve(problem([([1, 0, 0], 0.5)]), str)
    assert answer.solver_fallback and answer.x[0] <= 0.5 + 1e-6


def test_a_solver_that_stalls_is_not_asked_again_and_the_answers_say_so():
    slow = Stub(np.array([0.0, 0.0, 0.0]), seconds=2.0 * PARAMETERS.solver_time_limit)
    tested = ladder(slow, "snail")
    first = tested.solve(problem(), str)
    assert (first.solver, first.rung) == ("snail", "full")
    for _ in range(3):
        answer = tested.solve(problem(), str)
        assert (answer.solver, answer.rung, answer.solver_fallback) == ("daqp", "full", True)
        assert answer.note.startswith("snail took 0.02 s and is not asked any more")
    assert slow.asked == 1


def test_a_quick_solver_is_asked_every_time():
    quick = Stub(np.zeros(3))
    tested = ladder(quick, "stub")
    for _ in range(5):
        assert tested.solve(problem(), str).note == ""
    assert quick.asked == 5


@both
@pytest.mark.parametrize("field", ["A", "upper"])
def test_no_numbers_are_never_answered_as_kept(solver, field):
    bad = problem([([0, 1, 0], 0.5)])
    getattr(bad, field)[-3] = np.nan
    answer = solve(bad, solver)
    assert answer.rung != "full" or np.isfinite(bad.excess(answer.x))
    assert bad.excess(np.zeros(3)) == np.inf


@both
def test_without_any_answer_it_says_brake(solver):
    bad = problem()
    bad.H[0, 0] = np.nan
    answer = solve(bad, solver)
    assert answer.x is None and answer.rung == "brake"
    assert answer.reason == "no solver found an answer; no contradiction beyond rounding"


def test_an_infeasible_step_is_quick():
    tested, times = ladder(), []
    for step in range(300):
        case = problem([([0, 1, 0], -0.4 - 1e-3 * (step % 100))])
        start = time.thread_time()
        tested.solve(case, str)
        times.append(time.thread_time() - start)
    assert np.quantile(times, 0.9) <= 1e-3
