import numpy as np
import pytest

from motm_wbc.geometry import se2
from motm_wbc.kinematics import Part
from motm_wbc.kinematics.pairs import SolidRole
from motm_wbc.qp import HeldObject, WholeBodyParameters, shapes_from_scene
from motm_wbc.qp.held import box_segments
from motm_wbc.qp.limits import BaseBounds
from motm_wbc.qp.nearby import NEAREST, Neighbourhood, measure, rough_pairs
from motm_wbc.qp.problem import NO_BOUND
from motm_wbc.qp.rows import empty_rows, write_rows
from motm_wbc.qp.segments import place_segments
from motm_wbc.qp.selection import choose_pairs, empty_selection
from motm_wbc.qp.shapes import place_solids
from motm_wbc.scene.scenario import load_scenario

PARAMETERS = WholeBodyParameters(collision_rows=60)
STAND = np.zeros(2)


class Finder:
    """The kernels of one neighbourhood, called one after the other."""

    def __init__(self, model, bodies, target=None, held=None, parameters=PARAMETERS):
        self.model, self.parameters = model, parameters
        self.neighbourhood, self.pairs = Neighbourhood(model, parameters), None
        self.update(bodies, target, held)
        self.base = BaseBounds(model.base_limits, model.n_base, 1 / 120).arrays
        self.count = parameters.collision_rows

    def update(self, bodies, target=None, held=None):
        self.neighbourhood.update(bodies, target, held)
        self.names = self.neighbourhood.names()
        near, inputs = self.neighbourhood, self.model.n_base + self.model.n_arm
        if self.pairs is not near.pairs:
            self.pairs, count = near.pairs, self.parameters.collision_rows
            self.rows = empty_rows(near.pairs, inputs, count)
            self.selection = empty_selection(near.pairs, near.near, count)

    def place(self, here):
        """Rough pairs; what all kernels begin with."""
        near, scene = self.neighbourhood.near, self.neighbourhood.shapes.arrays
        segments = self.neighbourhood.segments.arrays
        scene.poses[0] = here.base_pose
        place_solids(scene, 0, 1)
        place_segments(segments, here.rotations, here.translations, near.ends)
        return rough_pairs(segments, scene, self.pairs, True, near), segments, scene, near

    def find(self, here):
        """Pair -> contact of all pairs within reach."""
        count, segments, scene, near = self.place(here)
        found = {}
        for c in range(count):
            rough, pair = near.contact[c, 0], tuple(near.pair[c].tolist())
            measure(segments, scene, near, c)
            assert rough <= near.contact[c, 0] + 1e-12
            own = pair[1] >= len(scene.radius)
            if near.contact[c, 0] < (self.pairs.own_reach[0] if own else self.pairs.reach[pair]):
                found[pair] = near.contact[c].copy()
        return found

    def contact(self, here, slot):
        """Contact of the pair and place in a row's slot."""
        _, segments, scene, near = self.place(here)
        *pair, place = self.rows.slots[slot]
        near.pair[-1], near.place[-1] = pair, place
        measure(segments, scene, near, len(near.pair) - 1)
        return near.contact[-1].copy()

    def build(self, here, lead=STAND):
        count, segments, scene, near = self.place(here)
        p = self.parameters
        brakes = self.base.change[0] * 120
        chosen = choose_pairs(
            segments, scene, self.pairs, near, count, brakes, p.retreat_speed, p.held_rows,
            1 / 120, self.selection,
        )  # fmt: skip
        write_rows(
            segments, scene, self.pairs, near, self.selection, chosen, self.base, here.J_world,
            lead, p.retreat_speed, 1 / 120,
            self.rows,
        )  # fmt: skip
        return self.rows

    def row_names(self):
        """Slot -> name of its pair."""
        return {slot: self.names.of(*self.rows.slots[slot, :2]) for slot in used(self.rows)}

    def slot(self, name):
        return next(slot for slot, other in self.row_names().items() if other == name)


def used(rows):
    return np.flatnonzero(rows.bound < NO_BOUND)


def scene(box):
    return [
        box("table", 0.75, 0.1, (0.3, 0.4, 0.4), role=SolidRole.SUPPORT),
        box("post", 0.4, 0.35, (0.1, 0.1, 1.0)),
        box("floating", 0.6, -0.3, (0.2, 0.2, 0.1), bottom=0.5, role=SolidRole.OBJECT),
    ]


def test_each_row_is_the_rate_at_which_its_pair_comes_nearer(frankie, box):
    """Against finite differences of the distances, base inputs included."""
    rng = np.random.default_rng(0)
    checked, step = 0, 1e-6
    finder, other = (Finder(frankie, scene(box)) for _ in range(2))
    for _ in range(12):
        pose = np.array([0.05, -0.05, 0.2]) * rng.normal(size=3)
        q = frankie.home + rng.uniform(-0.3, 0.3, 7)
        rows = finder.build(frankie.configuration(pose, q))
        other.rows, base = rows, len(finder.names.segments) - 1
        here = frankie.configuration(pose, q)
        before = {slot: other.contact(here, slot)[0] for slot in used(rows)}
        for column in range(9):
            x = np.zeros(9)
            x[column] = step
            moved = se2.integrate_twist(pose, x[0], 0.0, x[1], 1.0)
            there = frankie.configuration(moved, q + x[2:])
            for slot in used(rows):
                if rows.slots[slot, 0] == base and rows.slots[slot, 2] != NEAREST:
                    continue  # not a point of one body, but where two edges cease to overlap
                rate = -(other.contact(there, slot)[0] - before[slot]) / step
                assert rows.A[slot, column] == pytest.approx(rate, abs=2e-5)
                checked += 1
    assert checked > 1000


def test_a_held_box_is_part_of_the_hand(frankie, box):
    here = frankie.configuration(np.zeros(3), frankie.home)
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 0.05]
    under = here.T_world_tool[:3, 3] - [0, 0, 0.05 + 0.03 + 0.03]
    table = box("table", under[0] + 0.15, under[1], (0.4, 0.4, under[2]), role=SolidRole.SUPPORT)
    for allowed, expected in ((False, True), (True, False)):
        held = HeldObject("cube", np.array([0.05, 0.05, 0.06]), T, contact_allowed=allowed)
        finder = Finder(frankie, [table], held=held)
        rows = finder.build(here)
        names = list(finder.row_names().values())
        assert ("cube - table" in names) is expected
        if expected:
            assert names.count("cube - table") == PARAMETERS.held_rows
            assert finder.selection.clearance[0] == pytest.approx(0.03, abs=1e-9)
            assert finder.names.of(*finder.selection.closest) == "cube - table"
    # its row is that of a point of the tool
    held = HeldObject("cube", np.array([0.05, 0.05, 0.06]), T)
    finder = Finder(frankie, [table], held=held)
    rows = finder.build(here)
    down = -here.J_tool[2]
    slots = [slot for slot, name in finder.row_names().items() if name == "cube - table"]
    assert len(slots) == PARAMETERS.held_rows
    assert max(np.abs(rows.A[slot][2:] - down[2:]).max() for slot in slots) < 0.06


def test_fingers_may_touch_their_target_and_nothing_else(frankie, box):
    here = frankie.configuration(np.zeros(3), frankie.home)
    tool = here.T_world_tool[:3, 3]
    cube = box("cube", tool[0], tool[1], (0.05, 0.05, 0.05), tool[2], role=SolidRole.OBJECT)
    for target, count in (("cube", 0), ("other", 2), (None, 2)):
        finder = Finder(frankie, [cube], target=target)
        parts = finder.neighbourhood.segments.parts
        fingers = [i for i, j in finder.find(here) if parts[i] is Part.FINGER and j == 1]
        assert len(fingers) == count


def test_the_base_drops_out_of_pairs_with_itself(frankie):
    q = frankie.home + np.array([0, 0.9, 0, -0.2, 0, 0.3, 0])
    finder = Finder(frankie, [])
    rows = finder.build(frankie.configuration(np.zeros(3), q), np.array([0.5, 1.0]))
    slots = used(rows)
    assert len(slots) > 3
    np.testing.assert_allclose(rows.A[slots, :2], 0.0, atol=1e-12)
    assert np.abs(rows.A[slots, 2:]).max() > 0.1
    assert (rows.slots[slots, 1] == 0).any()


def test_a_moving_body_shifts_the_bound_by_its_approach(frankie, box):
    here = frankie.configuration(np.zeros(3), frankie.home)
    x, y = here.T_world_tool[:2, 3]
    bounds = {}
    for velocity in ((0, 0, 0), (-0.3, 0, 0), (0, 0, 1.0)):
        wall = box("wall", x + 0.25, y + 0.3, (0.1, 1.0, 2.0), velocity=velocity)
        finder = Finder(frankie, [wall])
        rows = finder.build(here)
        slot = finder.slot("hand - wall")
        bounds[velocity] = rows.bound[slot]
        hand = finder.contact(here, slot)
    assert bounds[(-0.3, 0, 0)] == pytest.approx(bounds[(0, 0, 0)] - 0.3)
    # turning about its own centre, which is further left than the hand: there it goes along +x
    lever = y + 0.3 - hand[2]
    assert lever > 0.15
    assert bounds[(0, 0, 1.0)] == pytest.approx(bounds[(0, 0, 0)] + lever)


def test_pairs_keep_their_slots_while_others_come_and_go(frankie, box):
    finder = Finder(frankie, scene(box), parameters=WholeBodyParameters(collision_rows=6))
    seen, changes = {}, 0
    for x in np.linspace(0.0, 0.15, 30):
        rows = finder.build(frankie.configuration(np.array([x, 0.0, 0.0]), frankie.home))
        now = {tuple(rows.slots[slot]): slot for slot in used(rows)}
        assert len(now) == 6
        for pair in now.keys() & seen.keys():
            assert now[pair] == seen[pair]
        changes += now.keys() != seen.keys()
        seen = now
    assert changes > 1


def test_the_rows_are_those_of_the_pairs_that_may_approach_least(frankie, box):
    here = frankie.configuration(np.zeros(3), frankie.home)
    bodies = [box("shelf", 0.6, 0.0, (0.3, 0.3, 0.05), bottom=0.9)]  # out of the base's way
    every = np.sort(Finder(frankie, bodies).build(here).bound)
    assert (every < NO_BOUND).sum() > 6
    for count in (1, 4, 6):
        some = Finder(frankie, bodies, parameters=WholeBodyParameters(collision_rows=count))
        np.testing.assert_allclose(np.sort(some.build(here).bound), every[:count])


def test_what_stands_on_the_base_lets_it_drive_as_fast_as_it_can_stop(frankie, box):
    here = frankie.configuration(np.zeros(3), frankie.home)
    wall = box("wall", 0.5, 0.0, (0.1, 3.0, 1.0))
    for speed in (0.1, 0.5):
        finder = Finder(frankie, [wall])
        rows = finder.build(here, np.array([speed, 0.0]))
        slot = finder.slot("link0 - wall")
        room = finder.contact(here, slot)[0] - 0.05
        assert 0.02 < room < 0.3
        # braking at 0.5 m/s^2, all but one step and the share kept back
        assert rows.bound[slot] == pytest.approx(np.sqrt(2 * 0.49 * room), abs=0.49 / 120)
        np.testing.assert_allclose(rows.A[slot, 2:], 0.0, atol=1e-12)


def test_unused_slots_are_without_bound_and_zero(frankie):
    finder = Finder(frankie, [])
    q = np.array([0.0, 0.0, 0.0, -0.5, 0.0, 2.0, 0.0])
    finder.build(frankie.configuration(np.zeros(3), frankie.home))  # leaves rows behind
    rows = finder.build(frankie.configuration(np.zeros(3), q))
    idle = rows.bound == NO_BOUND
    assert idle.sum() > 30 and (rows.A[idle] == 0.0).all()


def test_held_boxes_are_covered_by_their_segments():
    rng = np.random.default_rng(1)
    size = np.array([0.06, 0.05, 0.04])
    ends, radius = box_segments(size)
    assert len(ends) == 13 and ends.min(axis=(0, 1)) == pytest.approx(-size / 2)
    # a point on the surface is never further from a segment than a quarter of the smallest side
    points = rng.uniform(-0.5, 0.5, (500, 3)) * size
    face = rng.integers(0, 3, 500)
    points[np.arange(500), face] = 0.5 * size[face] * rng.choice([-1, 1], 500)
    along = ends[:, 1] - ends[:, 0]
    t = np.einsum("psi,si->ps", points[:, None] - ends[:, 0], along)
    t = np.clip(t / np.maximum(np.einsum("si,si->s", along, along), 1e-12), 0, 1)
    away = np.linalg.norm(points[:, None] - ends[:, 0] - t[:, :, None] * along, axis=2) - radius
    assert away.min(axis=1).max() < 0.011
    assert away.min() > -0.02 - 1e-9  # and none of them sticks out
    corner = np.abs(ends).max(axis=1) + radius[:, None]
    assert (corner[12] <= size / 2 + 1e-12).all()


def test_near_pairs_are_all_pairs_within_reach(frankie):
    """The rough distances lose none: against the same search without them."""
    bodies = shapes_from_scene(load_scenario("obstructed_turn"))
    finder, all_of_them = Finder(frankie, bodies), Finder(frankie, bodies)
    legal = np.isfinite(all_of_them.pairs.reach)
    near = set()
    for x in np.linspace(-1.2, 0.0, 13):
        here = frankie.configuration(np.array([x, -0.1, 0.1]), frankie.home)
        found = finder.find(here)
        all_of_them.pairs.reach[legal] = 100.0
        all_of_them.pairs.widest[:] = 100.0
        every = all_of_them.find(here)
        assert len(every) > legal.sum()
        own = len(finder.neighbourhood.shapes.owner)
        for (i, j), contact in every.items():
            if j < own:
                assert ((i, j) in found) == (contact[0] < finder.pairs.reach[i, j])
        near |= found.keys()
    assert len(near) > 15


def test_the_lazy_choice_is_the_one_by_all_exact_distances(frankie, box):
    """Moving and turning solids, too: what comes fast counts before what is near."""
    rng = np.random.default_rng(8)
    fewer = 0
    for _ in range(60):
        bodies = [
            box(f"b{i}", *rng.uniform(-1, 1, 2), rng.uniform(0.1, 0.5, 3), bottom=rng.uniform(0, 1),
                velocity=tuple(rng.uniform(-1, 1, 3) * rng.integers(0, 2)))
            for i in range(8)
        ]  # fmt: skip
        finder = Finder(frankie, bodies, parameters=WholeBodyParameters(collision_rows=9))
        q = frankie.home + rng.uniform(-0.6, 0.6, 7)
        q[[3, 5]] = np.clip(q[[3, 5]], [-3.0, 0.8], [-0.6, 3.7])
        here = frankie.configuration(rng.uniform(-0.1, 0.1, 3), q)
        rows = finder.build(here)
        fewer += finder.neighbourhood.near.measured.sum() < len(finder.find(here))
        every = Finder(frankie, bodies, parameters=WholeBodyParameters(collision_rows=100))
        bounds = np.sort(every.build(here).bound)
        # links on the base are ranked by brakes, but bounded by its arc: left out of account
        arm = ~finder.neighbourhood.segments.arrays.on_base[rows.slots[:, 0]]
        assert (rows.bound[arm][:, None] >= bounds[0] - 1e-12).all()
        slots = {tuple(pair) for pair in rows.slots.tolist()}
        left_out = [
            every.rows.bound[slot]
            for slot in used(every.rows)
            if tuple(every.rows.slots[slot].tolist()) not in slots
            and every.rows.slots[slot, 2] == NEAREST  # ends come only with their pair
            and not finder.neighbourhood.segments.arrays.on_base[every.rows.slots[slot, 0]]
        ]
        if left_out and arm.any():
            assert rows.bound[arm].max() <= min(left_out) + 1e-12
        contacts = every.find(here)
        assert finder.selection.clearance[0] == min(contact[0] for contact in contacts.values())
    assert fewer > 30
