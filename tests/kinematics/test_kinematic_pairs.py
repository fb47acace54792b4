import coal
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from motm_wbc.errors import InputError
from motm_wbc.kinematics import Part
from motm_wbc.kinematics.capsules import collision_points
from motm_wbc.kinematics.pair_search import find_pairs, segment_gap
from motm_wbc.kinematics.pairs import SolidRole, classify
from motm_wbc.kinematics.parameters import PairClass, PairClasses
from motm_wbc.scene.files import parse

CLASSES = PairClasses()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["any", "parallel", "points", "one point"]))
def test_segment_gap_is_the_least_distance(seed, kind):
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(-1, 1, (2, 2, 3))
    if kind == "parallel":
        second = first + rng.uniform(-1, 1, 3)
    if kind in ("points", "one point"):
        second[1] = second[0]
    if kind == "points":
        first[1] = first[0]

    def distance(x):
        p = first[0] + x[0] * (first[1] - first[0])
        q = second[0] + x[1] * (second[1] - second[0])
        return float(((p - q) ** 2).sum())

    best = min(
        minimize(distance, start, bounds=[(0, 1), (0, 1)], tol=1e-14).fun
        for start in ([0.5, 0.5], [0, 0], [0, 1], [1, 0], [1, 1])
    )
    assert segment_gap(first[None], second[None])[0] == pytest.approx(np.sqrt(best), abs=1e-5)


def test_shipped_pairs_are_all_that_can_touch(frankie):
    found = find_pairs(frankie, near=0.0, samples=4000, seed=7)
    names = frankie.capsules.names
    shipped = {frozenset((names[i], names[j])) for i, j in frankie.self_pairs}
    # kept apart by the limit of joint 6, see the next test
    by_limit = {frozenset(("link5", "link7")), frozenset(("link5", "hand"))}
    touching = {frozenset(pair) for pair in found.self_pairs}
    assert touching - by_limit <= shipped
    assert len(touching & shipped) >= 15
    assert set(found.base_pairs) <= {names[i] for i in frankie.base_pairs}
    assert len(found.base_pairs) >= 6


@pytest.mark.parametrize("link", ["panda_link7", "panda_hand"])
def test_limit_of_joint_6_keeps_the_hand_off_the_forearm(frankie, link):
    forearm, other = (_convex(frankie, name) for name in ("panda_link5", link))
    distances = []
    q = frankie.home.copy()
    for q[5] in np.linspace(frankie.q_lower[5], frankie.q_upper[5], 30):
        for q[6] in np.linspace(frankie.q_lower[6], frankie.q_upper[6], 40):
            here = frankie.configuration(np.zeros(3), q)
            placed = [_placed(here.link_pose(name)) for name in ("panda_link5", link)]
            distances.append(
                coal.distance(
                    forearm, placed[0], other, placed[1],
                    coal.DistanceRequest(), coal.DistanceResult(),
                )
            )  # fmt: skip
    assert 0.005 < min(distances) < 0.1


def test_nothing_touches_at_home(frankie):
    segments = frankie.configuration(np.zeros(3), frankie.home).capsule_segments()
    radius = frankie.capsules.radius
    for i, j in frankie.self_pairs:
        gap = segment_gap(segments[i : i + 1], segments[j : j + 1])[0] - radius[i] - radius[j]
        assert gap > CLASSES.self_collision.influence


def _convex(model, link):
    hull = trimesh.convex.convex_hull(collision_points(model.urdf_path, link))
    body = coal.BVHModelOBBRSS()
    body.beginModel(len(hull.faces), len(hull.vertices))
    for triangle in hull.triangles:
        body.addTriangle(*(np.array(corner) for corner in triangle))
    body.endModel()
    body.buildConvexRepresentation(False)
    return body.convex


def _placed(T):
    return coal.Transform3s(T[:3, :3], T[:3, 3])


@pytest.mark.parametrize(
    ("part", "role", "how", "expected"),
    [
        (Part.ARM, SolidRole.SUPPORT, {}, "arm_scene"),
        (Part.ARM, SolidRole.OBSTACLE, {}, "arm_scene"),
        (Part.ARM, SolidRole.OBJECT, {"is_target": True}, "hand_scene"),
        (Part.ARM, SolidRole.OBJECT, {"is_held": True}, "self_collision"),
        (Part.HAND, SolidRole.SUPPORT, {}, "hand_support"),
        (Part.FINGER, SolidRole.SUPPORT, {}, "hand_support"),
        (Part.FINGER, SolidRole.SUPPORT, {"contact_allowed": True}, "hand_support"),
        (Part.FINGER, SolidRole.OBSTACLE, {}, "hand_scene"),
        (Part.FINGER, SolidRole.OBJECT, {}, "hand_scene"),
        (Part.FINGER, SolidRole.OBJECT, {"is_target": True}, None),
        (Part.HAND, SolidRole.OBJECT, {"is_target": True}, "hand_target"),
        (Part.HAND, SolidRole.OBJECT, {"is_held": True}, None),
        (Part.FINGER, SolidRole.OBJECT, {"is_held": True}, None),
        (Part.HELD, SolidRole.SUPPORT, {}, "hand_support"),
        (Part.HELD, SolidRole.SUPPORT, {"contact_allowed": True}, None),
        (Part.HELD, SolidRole.OBSTACLE, {"contact_allowed": True}, "hand_scene"),
    ],
)
def test_classes(part, role, how, expected):
    pair = classify(part, role, **how)
    assert (None if pair is None else pair.name) == expected


def test_distances_are_the_published_ones_for_the_arm():
    assert (CLASSES.arm_scene.safe, CLASSES.arm_scene.influence) == (0.05, 0.30)
    assert (CLASSES.hand_support.safe, CLASSES.hand_support.influence) == (0.005, 0.05)


def test_a_class_slows_before_it_stops():
    with pytest.raises(InputError, match="'influence' must be larger than 'safe'"):
        parse(PairClass, {"name": "x", "safe": 0.1, "influence": 0.1}, "here")
