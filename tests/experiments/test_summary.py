"""Figures of a run, from a made-up plant."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from motm_wbc.experiments.summary import RunLog, _misplaced, _object_error
from motm_wbc.scene.scenario import load_scenario
from motm_wbc.simulation import Release

SCENARIO = load_scenario("two_objects")


def pose(x, y, tilt=0.0):
    T = np.eye(4)
    T[:3, 3] = [x, y, 0.6]
    c, s = math.cos(tilt), math.sin(tilt)
    T[1:3, 1:3] = [[c, -s], [s, c]]
    return T


def plant(time, objects, releases):
    truth = SimpleNamespace(objects=objects)
    return SimpleNamespace(time=time, releases=releases, truth=lambda: truth)


def test_an_objects_error_is_taken_once_it_has_come_to_rest():
    log = RunLog()
    objects = {"cube_a": pose(0.70, -1.5), "cube_b": pose(-1.3, -1.5)}
    made = plant(5.9, objects, [Release(5.0, "cube_a")])
    log.watch_releases(made, 1.0)
    assert _object_error(SCENARIO, log, made) is None
    made.time = 6.0
    objects["cube_a"] = pose(0.71, -1.5)
    log.watch_releases(made, 1.0)
    objects["cube_a"] = pose(9.0, 9.0)  # what happens later is another step's business
    log.watch_releases(made, 1.0)
    assert _object_error(SCENARIO, log, made) == pytest.approx(0.01)


def test_the_worst_object_counts():
    log = RunLog()
    objects = {"cube_a": pose(0.71, -1.5), "cube_b": pose(-1.3, 1.53)}
    made = plant(30.0, objects, [Release(5.0, "cube_a"), Release(20.0, "cube_b")])
    log.watch_releases(made, 1.0)
    assert _object_error(SCENARIO, log, made) == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("done", "error", "tilt", "expected"),
    [
        (True, 0.01, 0.0, None),
        (False, 0.01, 0.0, "not finished"),
        (True, None, 0.0, "no object"),
        (True, 0.06, 0.0, "0.060 m from its place"),
        (True, 0.01, 1.0, "cube_a has toppled"),
    ],
)
def test_why_a_task_is_not_done(done, error, tilt, expected):
    made = plant(30.0, {"cube_a": pose(0, 0, tilt), "cube_b": pose(0, 0)}, [])
    reason = _misplaced(SCENARIO, SimpleNamespace(done=done), made, error)
    assert (reason is None) if expected is None else (expected in reason)
