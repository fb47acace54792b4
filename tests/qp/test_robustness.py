"""Uses that nobody meant: copies, interrupts, odd shapes, solvers of one's own that misbehave."""

import copy
import pickle
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import (
    Body,
    FreeBase,
    HeldObject,
    NavigatedBase,
    ToolTask,
    WholeBodyController,
    WholeBodyParameters,
)

DT = 1.0 / 120.0


def step(controller, **more):
    model = controller.model
    arguments = {
        "base_pose": np.zeros(3),
        "q": model.home,
        "previous": (np.zeros(model.n_base), np.zeros(model.n_arm)),
        "base": NavigatedBase(np.array([0.004, 0.0])),
        "tools": [ToolTask(np.array([0.05, 0.0, 0.0, 0, 0, 0]))],
        **more,
    }
    return controller.step(**arguments)


@pytest.mark.parametrize("solver", ["osqp", "daqp"])
@pytest.mark.parametrize("make", [copy.deepcopy, copy.copy])
def test_a_copy_starts_anew_and_shares_no_memory(frankie, solver, make):
    controller = WholeBodyController(frankie, DT, solver=solver)
    first = step(controller)
    other = make(controller)
    np.testing.assert_array_equal(step(other).arm, first.arm)
    del controller
    for _ in range(50):
        np.testing.assert_array_equal(step(other).base, first.base)


def test_a_pickled_controller_answers_the_same(frankie):
    controller = WholeBodyController(frankie, DT, WholeBodyParameters(collision_rows=7), "daqp")
    first = step(controller)
    again = pickle.loads(pickle.dumps(controller))
    assert again.parameters.collision_rows == 7
    np.testing.assert_array_equal(step(again).arm, first.arm)


def test_what_a_controller_was_made_of_can_not_be_replaced(frankie):
    controller = WholeBodyController(frankie, DT)
    for name in ("model", "dt", "parameters", "solver"):
        with pytest.raises(AttributeError):
            setattr(controller, name, None)


@pytest.mark.parametrize("dt", [0.0, -0.01, np.nan, np.inf])
def test_a_control_step_is_a_positive_time(frankie, dt):
    with pytest.raises(InputError, match="control step"):
        WholeBodyController(frankie, dt)


def test_a_second_thread_is_turned_away(frankie):
    inside, go_on = threading.Event(), threading.Event()

    class Slow:
        def solve(self, problem):
            inside.set()
            go_on.wait(10.0)
            return np.zeros(len(problem.f))

    controller = WholeBodyController(frankie, DT, solver=Slow())
    thread = threading.Thread(target=step, args=(controller,))
    thread.start()
    assert inside.wait(30.0)
    result = step(controller)
    go_on.set()
    thread.join()
    assert result.rung == "brake" and "another thread" in result.reason
    assert step(controller).rung == "full"


@pytest.mark.parametrize(
    "answer", [ValueError("no"), [0.0], "x", None, np.full(8, np.nan), np.full(8, 50.0, np.float32)]
)
def test_a_solver_of_ones_own_may_do_anything(frankie, answer):
    class Odd:
        def solve(self, problem):
            if isinstance(answer, Exception):
                raise answer
            return answer

    expected = step(WholeBodyController(frankie, DT, solver="daqp"))
    result = step(WholeBodyController(frankie, DT, solver=Odd()))
    assert result.rung == "full" and np.isfinite(result.arm).all()
    assert (np.abs(result.arm) <= frankie.v_max).all()
    if result.solver_fallback:
        np.testing.assert_allclose(result.arm, expected.arm, atol=1e-9)


SQUARE = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
DENT = np.array([[0.1, 0.1], [0.0, 0.0], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
BODIES = {
    "clockwise": {"outlines": (SQUARE[::-1],)},
    "convex": {"outlines": (DENT,)},
    "neither": {"outlines": ()},
    "radius": {"outlines": (), "radius": -1.0},
    "not finite": {"outlines": (SQUARE * np.inf,)},
    "bottom": {"bottom": 2.0},
    "three numbers": {"pose": np.array([0.7])},
    "role": {"role": "support"},
}


@pytest.mark.parametrize("complaint", BODIES)
def test_a_body_without_a_proper_shape_brakes_and_is_named(frankie, complaint):
    good = Body(
        "crate", SolidRole.OBSTACLE, (SQUARE,), None, 0.0, 1.0, np.array([1.0, 0, 0]), np.zeros(3)
    )
    controller = WholeBodyController(frankie, DT)
    result = step(controller, bodies=[replace(good, **BODIES[complaint])])
    assert result.rung == "brake"
    assert "crate" in result.reason and complaint in result.reason
    assert step(controller, bodies=[good]).rung == "full"


def test_a_size_that_was_changed_in_place_is_noticed(frankie):
    size, heights = np.array([0.04, 0.04, 0.04]), []
    controller = WholeBodyController(frankie, DT)
    for height in (0.04, 0.2):
        size[2] = height
        step(controller, held=HeldObject("thing", size, np.eye(4)))
        heights.append(np.ptp(controller._step.near.ends[-14:-1, :, 2]))  # upright at home
    np.testing.assert_allclose(heights, [0.04, 0.2], atol=5e-3)


@pytest.mark.parametrize("width", [5.0, -5.0])
def test_fingers_go_no_further_than_they_can(frankie, width):
    bound = frankie.description.gripper.max_width if width > 0 else 0.0
    controllers = [WholeBodyController(frankie, DT) for _ in range(2)]
    odd, legal = (
        step(c, gripper_width=w) for c, w in zip(controllers, (width, bound), strict=True)
    )
    assert odd.clearance == legal.clearance


def test_free_base_inputs_at_their_bounds_are_named(frankie):
    for solver in ("osqp", "daqp"):
        controller = WholeBodyController(frankie, DT, solver=solver)
        far = ToolTask(np.array([1.0, 1.0, 0, 0, 0, 0]))
        result = step(controller, base=FreeBase(), tools=[far])
        assert abs(result.base[0]) == pytest.approx(0.5 * DT, rel=1e-6)
        assert "base v acceleration" in result.active


@pytest.mark.parametrize("weight", [1.0, 1e6])
def test_no_weight_makes_a_limit_give_way_that_could_be_kept(frankie, box, weight):
    """A wall that comes faster than the arm can flee, and a tool that is told to go into it."""
    here = frankie.configuration(np.zeros(3), frankie.home).T_world_tool[:3, 3]
    wall = box("wall", here[0] + 0.25, 0.0, (0.1, 2.0, 2.0), velocity=(-1.5, 0.0, 0.0))
    excess = []
    for twist in (np.zeros(6), np.array([0.8, 0, 0, 0, 0, 0])):
        controller = WholeBodyController(frankie, DT)
        tool = ToolTask(twist, weights=np.full(6, weight))
        result = step(controller, base=NavigatedBase(np.zeros(2)), tools=[tool], bodies=[wall])
        assert result.rung == "soft_collision"
        rows = controller._step.rows
        x = np.concatenate((result.base, result.arm))
        excess.append((rows.A @ x - rows.bound).max())
    assert excess[1] <= excess[0] + 1e-3


@pytest.mark.parametrize("place", range(0, 140, 3))
def test_an_interrupt_anywhere_leaves_a_controller_that_answers_as_a_new_one(frankie, box, place):
    """Ctrl-C at some line of taking over the input; then a step with other tasks and bodies."""
    table = box("table", 0.8, 0.0, (0.3, 0.4, 0.4), role=SolidRole.SUPPORT)
    up = ToolTask(np.array([0, 0, 0.1, 0, 0, 0]), frame="panda_link5")
    first = {"bodies": [table], "tools": [up], "locked": ["panda_joint3"], "base": FreeBase()}
    held = HeldObject("thing", np.full(3, 0.04), np.eye(4))
    controller, count = WholeBodyController(frankie, DT, solver="daqp"), 0
    step(controller, held=held)

    def trace(frame, event, _):
        nonlocal count
        if "motm_wbc/qp" not in frame.f_code.co_filename.replace("\\", "/"):
            return None
        count += event == "line"
        if count > place:
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        step(controller, **first)
    except KeyboardInterrupt:
        pass
    finally:
        sys.settrace(before)
    controller._lock = threading.Lock()  # as `reset` does
    for arguments in ({"held": held}, first, {}):
        mine = step(controller, **arguments)
        fresh = step(WholeBodyController(frankie, DT, solver="daqp"), **arguments)
        assert (mine.rung, mine.reason) == (fresh.rung, fresh.reason)
        np.testing.assert_allclose(mine.arm, fresh.arm, atol=1e-9)
        np.testing.assert_allclose(mine.base, fresh.base, atol=1e-9)


def test_a_floor_is_no_wall_for_the_base(frankie, box):
    floor = box("floor", 0.0, 0.0, (10.0, 10.0, 0.05), bottom=-0.05, role=SolidRole.SUPPORT)
    result = step(WholeBodyController(frankie, DT), base=FreeBase(), bodies=[floor])
    assert result.rung == "full" and "base - floor" not in result.active
    assert result.clearance > 0.0


def test_what_raises_on_being_read_is_braked_for(frankie):
    class Touchy:
        def __array__(self, *_, **__):
            raise RuntimeError("not here")

    for arguments in ({"q": Touchy()}, {"previous": Touchy()}, {"age": np.float32(0.2)}):
        assert step(WholeBodyController(frankie, DT), **arguments).rung == "brake"
    assert step(WholeBodyController(frankie, DT), age=np.float32(0.01)).rung == "full"
