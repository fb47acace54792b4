import numpy as np
import pytest

from motm_wbc.errors import InputError
from motm_wbc.kinematics.hulls import collision_hulls

URDF = """<robot name="r"><link name="a"><collision>
<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>
<geometry><box size="2 4 6"/></geometry></collision>
<collision><geometry><cylinder radius="0.5" length="2"/></geometry></collision>
<collision><geometry><sphere radius="0.5"/></geometry></collision></link><link name="b"/></robot>"""


def hulls_of(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return collision_hulls(path)


def test_shapes_are_where_their_origin_says(tmp_path):
    box, _, _ = hulls_of(tmp_path, URDF)["a"]
    np.testing.assert_allclose(box.min(axis=0), [1 - 2, 2 - 1, 3 - 3], atol=1e-12)
    np.testing.assert_allclose(box.max(axis=0), [1 + 2, 2 + 1, 3 + 3], atol=1e-12)


def test_links_without_shapes_are_left_out(tmp_path):
    assert list(hulls_of(tmp_path, URDF)) == ["a"]


@pytest.mark.parametrize("index", [1, 2])
def test_round_shapes_are_contained(tmp_path, index):
    from scipy.spatial import ConvexHull

    corners = hulls_of(tmp_path, URDF)["a"][index]
    distances = -ConvexHull(corners).equations[:, 3]
    assert distances.min() == pytest.approx(0.5, abs=1e-9)
    assert np.linalg.norm(corners[:, :2], axis=1).max() < 0.53


def test_an_unknown_shape_is_refused(tmp_path):
    with pytest.raises(InputError, match="collision shape 'capsule'; legal: box, cylinder"):
        hulls_of(tmp_path, URDF.replace('<sphere radius="0.5"/>', "<capsule/>"))


def test_a_missing_mesh_is_named(tmp_path):
    with pytest.raises(InputError, match=r"mesh gone\.stl"):
        hulls_of(tmp_path, URDF.replace('<sphere radius="0.5"/>', '<mesh filename="gone.stl"/>'))
