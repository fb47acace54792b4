from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from motm_wbc.errors import UnknownName
from motm_wbc.kinematics.capsules import (
    capsule_volume,
    collision_points,
    excess,
    fit_capsule,
    fit_link,
    segment_distance,
)


def test_shipped_capsules_contain_the_collision_shapes(frankie):
    shapes = frankie.capsules
    covered = set()
    for link, a, b, radius in zip(shapes.frames, shapes.a, shapes.b, shapes.radius, strict=True):
        points = collision_points(frankie.urdf_path, link)
        assert len(points) >= 18
        # a capsule is convex: with all corners of a hull it holds the hull
        assert excess(points, a, b, radius) <= 1e-6, link
        assert excess(points, a, b, radius) > -1.5e-4, link  # and no larger than it must be
        covered.add(link)
    tree = ElementTree.parse(frankie.urdf_path).getroot()
    shaped = {link.get("name") for link in tree.iterfind("link") if len(link.findall("collision"))}
    assert covered == shaped - {"base_link"}


def test_arm_capsules_are_tight(frankie):
    shapes = frankie.capsules
    ratios = {}
    for name, link, a, b, r in zip(
        shapes.names, shapes.frames, shapes.a, shapes.b, shapes.radius, strict=True
    ):
        points = collision_points(frankie.urdf_path, link)

        ratios[name] = capsule_volume(a, b, r) / trimesh.convex.convex_hull(points).volume
    assert max(ratios[f"link{i}"] for i in (1, 2, 3, 4, 5)) < 1.6
    assert max(ratios.values()) < 2.5


def test_fit_gives_the_shipped_numbers(frankie):
    index = frankie.capsules.names.index("left_finger")
    fitted = fit_link(frankie.urdf_path, "panda_leftfinger", np.array([0.0, 0.0, 1.0, 0.059]))
    assert fitted.radius == pytest.approx(frankie.capsules.radius[index], abs=2e-4)
    ends = np.array([fitted.a, fitted.b])
    shipped = np.array([frankie.capsules.a[index], frankie.capsules.b[index]])
    order = [0, 1] if ends[0, 2] < ends[1, 2] else [1, 0]
    np.testing.assert_allclose(ends[order], shipped, atol=5e-4)
    assert max(fitted.a[2], fitted.b[2]) + fitted.radius <= 0.0592


def test_fit_finds_a_capsule_again():
    rng = np.random.default_rng(0)
    a, b, radius = np.array([0.1, 0.0, -0.2]), np.array([0.0, 0.1, 0.2]), 0.05
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    on_axis = a + rng.uniform(0.0, 1.0, (4000, 1)).round() * (b - a)
    fitted = fit_capsule(on_axis + radius * directions)
    assert fitted.radius == pytest.approx(radius, abs=1e-3)
    assert fitted.volume == pytest.approx(capsule_volume(a, b, radius), rel=0.02)
    assert 1.0 < fitted.volume_ratio < 1.05


def test_distance_from_a_segment():
    points = np.array([[0.5, 0.3, 0.0], [-1.0, 0.0, 0.0], [2.0, 1.0, 0.0]])
    a, b = np.zeros(3), np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(segment_distance(points, a, b), [0.3, 1.0, np.sqrt(2.0)])
    np.testing.assert_allclose(segment_distance(points, a, a), np.linalg.norm(points, axis=1))
    assert excess(points[:1], a, b, 0.3) == pytest.approx(0.0)


def test_a_link_without_shapes_is_an_error(frankie):
    with pytest.raises(UnknownName, match="panda_link8"):
        collision_points(frankie.urdf_path, "panda_link8")


def test_hand_has_room_over_a_grasped_cube(frankie):
    here = frankie.configuration(np.zeros(3), frankie.home)
    segment = here.capsule_segments()[frankie.capsules.names.index("hand")]
    radius = frankie.capsules.radius[frankie.capsules.names.index("hand")]
    palm = segment[:, 2].min() - radius  # home looks straight down
    assert palm - here.T_world_tool[2, 3] > 0.025 + 0.008
    tips = [here.capsule_segments()[i] for i in (9, 10)]
    lowest = min(tip[:, 2].min() for tip in tips) - 0.018
    assert here.T_world_tool[2, 3] - lowest < 0.015
