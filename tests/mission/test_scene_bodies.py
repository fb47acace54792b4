import math

import numpy as np
import pytest

from motm_wbc.interfaces import WorldState
from motm_wbc.mission.bodies import SceneBodies
from motm_wbc.scene.scenario import load_scenario

SCENARIO = load_scenario("line")


def tilted(angle):
    T = SCENARIO.T_world_object("cube").copy()
    c, s = math.cos(angle), math.sin(angle)
    T[1:3, 1:3] = [[c, -s], [s, c]]
    return T


def cube_of(bodies):
    return next(body for body in bodies if body.name == "cube")


def test_a_tilted_object_does_not_grow_from_step_to_step():
    scene = SceneBodies(SCENARIO)
    for k in range(500):
        bodies = scene.at(WorldState(0.0, {"cube": tilted(0.05 + 1e-4 * (k % 2))}), None)
    cube = cube_of(bodies)
    expected = 0.05 * (math.cos(0.05) + math.sin(0.05))
    assert cube.top - cube.bottom == pytest.approx(expected, abs=1e-5)


def test_what_stands_stays_the_same_instance():
    scene = SceneBodies(SCENARIO)
    first = scene.at(WorldState(0.0, {"cube": SCENARIO.T_world_object("cube")}), None)
    moved = SCENARIO.T_world_object("cube").copy()
    moved[0, 3] += 1e-7
    again = scene.at(WorldState(0.0, {"cube": moved}), None)
    assert all(a is b for a, b in zip(first, again, strict=True))
    moved = moved.copy()
    moved[0, 3] += 1e-3
    later = cube_of(scene.at(WorldState(0.0, {"cube": moved}), None))
    assert later.pose[0] == pytest.approx(1e-3, abs=1e-6)


def test_a_held_object_is_a_part_of_the_hand_not_of_the_scene():
    scene = SceneBodies(SCENARIO)
    world = WorldState(0.0, {"cube": np.asarray(SCENARIO.T_world_object("cube"))})
    assert "cube" not in {body.name for body in scene.at(world, "cube")}
    held = scene.held("cube", np.eye(4), True)
    assert held.size == pytest.approx([0.05, 0.05, 0.05]) and held.contact_allowed
