"""The audit of drives: exact distances, and every planted contact is found."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from motm_wbc.basenav.obstacle import Disc, Obstacle
from motm_wbc.basenav.world import World
from motm_wbc.experiments.nav.contacts import OVERLAP, ContactAudit
from motm_wbc.geometry import polygons, se2

BOX = polygons.rectangle(0.68, 0.47)
FLOOR = polygons.rectangle(6.0, 6.0)
DT = 1.0 / 120.0


def blocked(world: World, time: float) -> shapely.Geometry:
    """All that blocks, moved, as one shape: the plain reference."""
    shapes = [
        shapely.affinity.translate(Polygon(s.outline, s.holes), *(time * s.velocity))
        for s in world.solids
    ]
    if world.boundary is not None:
        shapes.append(shapely.box(-50, -50, 50, 50).difference(Polygon(world.boundary)))
    return shapely.union_all(shapes)


@given(st.integers(0, 10_000))
@settings(max_examples=30)
def test_the_least_distance_is_that_of_every_step(seed):
    rng = np.random.default_rng(seed)
    things = [
        Disc(tuple(rng.uniform(-2.5, 2.5, 2)), 0.2, tuple(rng.uniform(-0.5, 0.5, 2))),
        Obstacle(polygons.rectangle(*rng.uniform(0.2, 1.0, 2)) + rng.uniform(-2.5, 2.5, 2)),
    ]
    world = World(things, FLOOR if seed % 2 else None)
    audit = ContactAudit(world, BOX)
    pose = np.array([*rng.uniform(-1.5, 1.5, 2), rng.uniform(-3.0, 3.0)])
    least, hit = math.inf, False
    for step in range(60):
        v, omega = rng.uniform(-0.5, 0.5), rng.uniform(-1.7, 1.7)
        if step:
            pose = se2.integrate_twist(pose, v, 0.0, omega, DT)
        hit |= audit.look(step * DT, pose, v, omega, DT)
        here = Polygon(polygons.place(BOX, pose))
        least = min(least, here.distance(blocked(world, step * DT)))
    assert audit.least == pytest.approx(least, abs=1e-9)
    assert hit == (least == 0.0)


TABLE = Obstacle(polygons.rectangle(1.0, 1.0), (polygons.rectangle(0.6, 0.6),))


@pytest.mark.parametrize(
    ("things", "boundary", "place"),
    [
        ([TABLE], None, (0.84 - 2e-6, 0.0, 0.0)),  # touches an edge
        ([polygons.rectangle(3.0, 3.0)], None, (0.0, 0.0, 0.3)),  # all of it inside
        ([TABLE], None, (0.0, 0.0, 0.0)),  # over the hole's rim
        ([polygons.disc(0.02)], None, (0.1, 0.1, 0.0)),  # a post under it
        ([], FLOOR, (2.7, 0.0, 0.0)),  # over the boundary
        ([], FLOOR, (5.0, 0.0, 0.0)),  # beyond it
    ],
)
def test_planted_contacts_are_found(things, boundary, place):
    audit = ContactAudit(World(things, boundary), BOX)
    assert audit.look(0.0, np.array(place), 0.0, 0.0, 0.0)
    assert audit.least == 0.0


def test_touching_is_no_contact_and_a_hole_is_free():
    audit = ContactAudit(World([TABLE]), BOX)
    assert not audit.look(0.0, np.array([0.84 - 0.5 * OVERLAP, 0.0, 0.0]), 0.0, 0.0, 0.0)
    ring = Obstacle(polygons.rectangle(3.0, 3.0), (polygons.rectangle(2.0, 2.0),))
    audit = ContactAudit(World([ring]), BOX)
    assert not audit.look(0.0, np.zeros(3), 0.0, 0.0, 0.0)
    assert audit.least == pytest.approx(1.0 - 0.34)


def test_what_runs_into_a_base_at_rest_is_seen():
    world = World([Disc((2.0, 0.0), 0.3, (-0.5, 0.0))])
    audit = ContactAudit(world, BOX)
    hits = [k * DT for k in range(480) if audit.look(k * DT, np.zeros(3), 0.0, 0.0, DT)]
    gap = 2.0 - 0.34 - 0.3 / math.cos(math.pi / 32)  # the corner points at the base
    assert hits[0] == pytest.approx(gap / 0.5, abs=0.03)


def test_an_empty_world_has_no_distance():
    audit = ContactAudit(World([]), BOX)
    assert not audit.look(0.0, np.zeros(3), 0.5, 0.0, DT)
    assert audit.least == math.inf
