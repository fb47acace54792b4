"""The benchmark: what is compared is one problem, and what is reported is what was timed."""

import json
import sys
import textwrap
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.distance import pdist
from shapely.geometry import Polygon

from motm_wbc import cli
from motm_wbc.basenav.world import World
from motm_wbc.experiments.bench import basenav, wholebody
from motm_wbc.experiments.bench.basenav_world import random_scene, small_moves
from motm_wbc.experiments.bench.contestants import PEERS, find_peers
from motm_wbc.experiments.bench.figures import RUN_IN, figures, tool_error
from motm_wbc.experiments.bench.ours import Ours
from motm_wbc.experiments.bench.plain_urdf import plain_urdf
from motm_wbc.experiments.bench.problems import PROBLEMS
from motm_wbc.experiments.bench.record import Figure, displaced, near_pairs
from motm_wbc.experiments.bench.shared.motm_bench import (
    Problem,
    capsule_frame,
    fastest,
    timed_round,
)
from motm_wbc.experiments.bench.table import nav_rows
from motm_wbc.experiments.bench.worker import Worker, WorkerError
from motm_wbc.kinematics import load_robot

STATES = 40
MAIN = PROBLEMS[0]


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    return MAIN.make(STATES, tmp_path_factory.mktemp("no_peers"))


@pytest.fixture(scope="module")
def frankie():
    return load_robot("frankie")


@pytest.fixture
def contestant(tmp_path, problem):
    """Start a worker whose steps are the given Python, on the main problem."""

    def start(step, about='{"library": "toy 1", "solver": "none"}'):
        script, file = tmp_path / "toy.py", tmp_path / "problem.npz"
        script.write_text(
            "from motm_bench import serve\nimport numpy as np\n"
            f"class Toy:\n    about = {about}\n"
            "    def __init__(self, problem, arguments): self.problem = problem\n"
            f"    def step(self, k):\n{textwrap.indent(textwrap.dedent(step), ' ' * 8)}\n"
            "    def velocities(self, k, answer): return answer\n"
            "serve(Toy)\n"
        )
        problem.save(file)
        return Worker("toy", [sys.executable, str(script), str(file)], foreign=True)

    return start


def test_a_problem_survives_its_file(problem, tmp_path):
    problem.save(tmp_path / "problem.npz")
    read = Problem.load(tmp_path / "problem.npz")
    for name in Problem.__slots__:
        before, after = getattr(problem, name), getattr(read, name)
        assert type(before) is type(after)
        np.testing.assert_array_equal(before, after)


def test_the_plain_urdf_is_the_same_robot(problem, frankie):
    model = pin.buildModelFromXML(plain_urdf(frankie))
    data = model.createData()
    assert tuple(model.names)[1:] == problem.joints
    assert model.nq == model.nv == 3 + frankie.n_arm
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = np.concatenate((rng.uniform(-2, 2, 3), rng.uniform(frankie.q_lower, frankie.q_upper)))
        pin.framesForwardKinematics(model, data, q)
        here = frankie.configuration(q[:3], q[3:])
        for link in ("tool", "panda_leftfinger", "panda_rightfinger", "panda_link4"):
            found = data.oMf[model.getFrameId(link)].homogeneous
            np.testing.assert_allclose(found, here.link_pose(link), atol=1e-9)


def test_the_plain_urdf_has_no_shapes(problem):
    assert "mesh" not in problem.urdf and "collision" not in problem.urdf


@given(ends=arrays(float, (2, 3), elements=st.floats(-1.0, 1.0)))
def test_a_capsule_lies_along_z_of_its_frame(ends):
    T, length = capsule_frame(ends)
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    for end, side in zip(ends, (-0.5, 0.5), strict=True):
        np.testing.assert_allclose(T[:3, 3] + side * length * T[:3, 2], end, atol=1e-9)


def test_the_closed_loop_is_one(problem):
    """Each state is where the commands of the one before lead to, within all limits."""
    moved = np.diff(problem.q, axis=0) / problem.dt
    np.testing.assert_allclose(moved[:, 2:], problem.v_previous[1:, 2:], atol=1e-9)
    np.testing.assert_allclose(moved[:, :2], problem.v_previous[1:, :2], atol=5e-3)  # an arc
    assert (np.abs(problem.v_previous) <= problem.v_max + 1e-9).all()
    assert (np.linalg.norm(problem.twist, axis=1) > 0.05).all()


def test_at_least_ten_pairs_are_near_in_every_state(problem):
    assert near_pairs(problem, problem.influence).min() >= 10
    assert problem.rows == 12


def test_a_hundred_pairs_are_near_where_that_is_said(tmp_path):
    entry = next(entry for entry in PROBLEMS if entry.key == "rows100")
    problem = entry.make(12, tmp_path)
    assert problem.rows == 100
    assert near_pairs(problem, problem.influence).min() >= 100


def test_random_states_are_clear_and_unalike(tmp_path):
    entry = next(entry for entry in PROBLEMS if entry.key == "random")
    problem, again = entry.make(12, tmp_path), entry.make(12, tmp_path)
    np.testing.assert_array_equal(problem.q, again.q)
    assert np.linalg.norm(np.diff(problem.q, axis=0), axis=1).min() > 0.3
    ours = Ours(problem, "daqp")
    assert all(ours.step(k).clearance > problem.safe for k in range(12))


def test_the_target_is_where_the_twist_leads(problem, frankie):
    T = frankie.configuration(problem.q[7, :3], problem.q[7, 3:]).T_world_tool
    step = problem.twist[7] * problem.dt
    target = problem.T_world_target[7]
    np.testing.assert_allclose(target[:3, 3] - T[:3, 3], step[:3], atol=1e-12)
    np.testing.assert_allclose(pin.log3(target[:3, :3] @ T[:3, :3].T), step[3:], atol=1e-9)
    np.testing.assert_array_equal(displaced(T, np.zeros(6)), T)


def test_the_tool_moves_on_as_the_figure_says():
    figure, t, h = Figure(), 0.7, 1e-6
    difference = (figure.at(t + h)[0] - figure.at(t - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(figure.at(t)[1], difference, atol=1e-6)


def test_the_tool_error_is_that_of_the_motion(problem, frankie):
    """It is what a small motion with these velocities makes of the tool's place."""
    ours, h = Ours(problem, "daqp"), 1e-6
    results = [ours.step(k) for k in range(STATES)]
    velocities = np.array([ours.velocities(k, result) for k, result in enumerate(results)])
    for v in (velocities, velocities + 0.2):
        places = [
            np.array([frankie.configuration(q[:3], q[3:]).T_world_tool[:3, 3] for q in positions])
            for positions in (problem.q, problem.q + h * v)
        ]
        off = problem.twist[:, :3] - (places[1] - places[0]) / h
        expected = np.median(np.linalg.norm(off, axis=1))
        assert tool_error(frankie, problem, v) == pytest.approx(expected, abs=2e-5)
    assert tool_error(frankie, problem, np.full_like(velocities, np.nan)) is None


def test_our_answers_are_read_as_they_are_meant(problem, frankie):
    """Base velocities of the joints are those of the inputs, and the task is fulfilled."""
    ours = Ours(problem, "daqp")
    results = [ours.step(k) for k in range(STATES)]
    for k, result in enumerate(results):
        x, y, turn = ours.velocities(k, result)[:3]
        heading = problem.q[k, 2]
        assert np.hypot(x, y) == pytest.approx(abs(result.base[0]))
        assert y * np.cos(heading) == pytest.approx(x * np.sin(heading), abs=1e-12)
        assert turn == result.base[1]
    assert {result.rung for result in results} == {"full"}
    assert np.median([np.linalg.norm(result.slack[:3]) for result in results]) < 0.02


def test_a_round_times_every_step_and_counts_failures():
    def step(k):
        if k % 3 == 0:
            raise RuntimeError("no answer")

    found = timed_round(SimpleNamespace(step=step), 10)
    assert len(found["wall"]) == len(found["cpu"]) == 10
    assert found["failed"] == 4
    assert min(found["wall"]) > 0


def test_the_fastest_solver_is_one_that_answers():
    def make(solver):
        def step(k):
            if solver == "broken":
                raise RuntimeError
            sum(range({"slow": 20000, "quick": 10}[solver]))

        return SimpleNamespace(step=step, solver=solver)

    assert fastest(make, ["slow", "broken", "quick"], 5).solver == "quick"


def test_figures_leave_out_the_run_in():
    wall = [10**9] * RUN_IN + [2000] * 5
    found = figures(
        [{"wall": wall, "cpu": wall, "failed": 2}] * 3, {"solver": "s", "library": "l"}, 0.1
    )
    assert found["median"] == found["p99"] == 2.0
    assert (found["count"], found["failed"]) == (15, 6)


def test_a_worker_answers_whatever_its_library_prints(contestant, problem):
    with contestant("print('noise'); return self.problem.v_previous[k]") as worker:
        assert worker.about["library"] == "toy 1"
        np.testing.assert_allclose(worker.answers(), problem.v_previous)
        found = worker.round()
    assert len(found["wall"]) == STATES and found["failed"] == 0


def test_a_worker_tells_which_states_it_could_not_answer(contestant):
    step = "if k == 3: raise ValueError\nreturn np.ones(10)"
    with contestant(step) as worker:
        assert np.isnan(worker.answers()).all(axis=1).nonzero()[0].tolist() == [3]
        assert worker.round()["failed"] == 1


def test_a_worker_that_ends_says_why(contestant):
    with pytest.raises(WorkerError, match=r"toy ended early.*ZeroDivisionError"):
        contestant("pass", about="1 / 0")
    with contestant("import os; os._exit(3)") as worker, pytest.raises(WorkerError, match="toy"):
        worker.round()


def test_peers_that_are_not_there_are_named(tmp_path):
    found, missing = find_peers(tmp_path / ".bench")
    assert found == [] and set(missing) == set(PEERS)
    assert str(tmp_path / ".bench" / "pink") in missing["pink"]


def test_peers_take_part(tmp_path):
    """pink here is a script that answers nothing, mink one that ends; roboplan is missing."""
    scripts = tmp_path / "benchmarks" / "peers"
    scripts.mkdir(parents=True)
    for name in ("pink", "mink"):
        python = tmp_path / ".bench" / name / "bin" / "python"
        python.parent.mkdir(parents=True)
        python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
        python.chmod(0o755)
    toy = (
        "from motm_bench import serve\n"
        "class Toy:\n"
        "    about = {'library': 'toy 1', 'solver': 'none'}\n"
        "    def __init__(self, problem, arguments): pass\n"
        "    def step(self, k): raise RuntimeError\n"
        "    def velocities(self, k, answer): return answer\n"
        "serve(Toy)\n"
    )
    (scripts / "worker_pink.py").write_text(toy)
    (scripts / "worker_mink.py").write_text("raise SystemExit('no such thing')\n")
    told = []
    result = wholebody.bench_wholebody(
        tmp_path / ".bench",
        states=15,
        rounds=2,
        problems=(MAIN, PROBLEMS[-1]),
        progress=told.append,
    )
    found = json.loads(json.dumps(result.as_dict()))
    for name in ("frankie_daqp_us", "frankie_osqp_us", "frankie_daqp_navigated_us"):
        assert 0.0 < found[name]["median"] < 1e5
        assert found[name]["count"] == 2 * (15 - RUN_IN)
        assert found[name]["failed"] == 0
    assert found["pink_us"]["failed"] == 30 and found["pink_us"]["tool_error"] is None
    assert found["mink_us"] is None and found["roboplan_us"] is None
    assert found["ridgeback_daqp_us"] is None and found["pink_ridgeback_us"] is None
    assert "no such thing" in found["peers"]["mink, frankie"]
    assert set(found["peers"]) == {"roboplan", "mink, frankie", "ridgeback"}
    assert len(told) == 3


@pytest.fixture
def result():
    one = figures(
        [{"wall": [5000] * 20, "cpu": [4000] * 20, "failed": 0}],
        {"solver": "daqp", "library": "ours 1"},
        0.01,
    )
    names = {"frankie_daqp_us": one, "pink_us": None}
    return wholebody.BenchResult(names, {"pink": "not found: here"}, dict.fromkeys(names, "Main"))


@pytest.mark.parametrize("words", [[], ["--json"]])
def test_the_command(capsys, monkeypatch, result, words):
    monkeypatch.setattr(wholebody, "bench_wholebody", lambda *_, **__: result)
    monkeypatch.setattr(sys, "argv", ["motm", "bench", "wholebody", *words])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    shown = capsys.readouterr()
    assert stopped.value.code == 0
    assert "left out: pink: not found: here" in shown.err
    if words:
        found = json.loads(shown.out)
        assert found["frankie_daqp_us"]["median"] == 5.0 and found["pink_us"] is None
        assert found["peers"] == {"pink": "not found: here"}
    else:
        lines = [line.split() for line in shown.out.splitlines()]
        assert lines[1:] == [["Main"], ["frankie_daqp_us", "5", "4", "daqp"]]


def test_an_unknown_benchmark(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["motm", "bench", "wholebdoy"])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    assert "did you mean 'wholebody'" in capsys.readouterr().err


# --- base navigation ---


def test_placement_is_timed_under_the_names_of_the_contract(monkeypatch):
    monkeypatch.setattr(basenav, "COUNTS", (1, 20))
    monkeypatch.setattr(basenav, "MOST", 30)
    monkeypatch.setattr(basenav, "_LOCAL_PLANNER", "motm_wbc.no_such_module")
    told = []
    result = basenav.bench_basenav(scenes=1, steps=3, moves=2, progress=told.append)
    assert set(result.figures) >= {
        "placement_1_obstacles_us",
        "placement_20_obstacles_us",
        "placement_30_moved_us",
    }
    assert len(told) == len(result.figures)
    for figure in result.figures.values():
        assert 0.0 < figure["median"] <= figure["wall_p99"]
        assert figure["count"] in (1, 2, 3)
    assert basenav.COUNTS == (1, 20)
    assert next(nav_rows(result))[0].startswith("placement, 1 obstacles")


def test_the_contract_counts_are_among_those_timed():
    assert {1, 20, 100, 400} <= set(basenav.COUNTS)
    assert basenav.MOST == 400


@pytest.mark.parametrize("count", [1, 2, 20, 60])
def test_random_scenes_are_what_they_say(count):
    scene, again = random_scene(count, 3), random_scene(count, 3)
    assert len(scene.obstacles) == count
    assert all(map(np.array_equal, scene.obstacles, again.obstacles))
    assert np.hypot(*(scene.start[:2] - scene.target)) == pytest.approx(4.0)
    assert np.hypot(*(scene.after - scene.target)) == pytest.approx(4.0)
    for points in scene.obstacles[2:]:
        polygon = Polygon(points)
        assert 3 <= len(points) <= 8
        assert polygon.convex_hull.area == pytest.approx(polygon.area)
        assert max(pdist(points)) <= 0.8


def test_moves_are_small_and_rigid():
    scene = random_scene(20, 1)
    world = World(scene.obstacles)
    moved = world.transformed(small_moves(scene.obstacles, np.random.default_rng(0)))
    for before, after in zip(world.obstacles, moved.obstacles, strict=True):
        assert pdist(after) == pytest.approx(pdist(before))
        assert 0.0 < np.abs(after - before).max() < 0.2


@pytest.mark.parametrize("words", [[], ["--json"]])
def test_the_command_for_navigation(capsys, monkeypatch, words):
    name = "placement_1_obstacles_us"
    times = {"median": 30.0, "p99": 90.0, "wall_p99": 95.0, "count": 3}
    result = basenav.NavBenchResult({name: times}, {name: "one"})
    monkeypatch.setattr(basenav, "bench_basenav", lambda **_: result)
    monkeypatch.setattr(sys, "argv", ["motm", "bench", "basenav", *words])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    shown = capsys.readouterr().out
    assert stopped.value.code == 0
    if words:
        assert json.loads(shown) == {name: times}
    else:
        assert shown.splitlines()[1].split() == ["one", f"({name})", "30", "90"]
