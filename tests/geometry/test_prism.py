import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motm_wbc.errors import InputError
from motm_wbc.geometry import polygons
from motm_wbc.geometry.prism import outline_edges, place_edges

OUTLINES = {
    "rectangle": polygons.rectangle(0.8, 0.3) + [0.1, 0.2],
    "triangle": np.array([[0, 0], [1, 0], [0, 1.0]]),
    "corner on an edge": np.array([[0, 0], [0.5, 0], [1, 0], [1, 1], [0, 1.0]]),
    "disc": polygons.disc(0.3, 11),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_edges_lead_around_the_outline_and_look_out(name):
    outline = OUTLINES[name]
    edges = outline_edges(outline)
    ends = edges[:, :2] + edges[:, 6:] * edges[:, 2:4]
    np.testing.assert_allclose(edges[:, :2], outline)
    np.testing.assert_allclose(ends, np.roll(outline, -1, axis=0), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(edges[:, 4:6], axis=1), 1.0)
    np.testing.assert_allclose((edges[:, 2:4] * edges[:, 4:6]).sum(axis=1), 0.0, atol=1e-16)
    toward_the_middle = outline.mean(axis=0) - edges[:, :2]
    assert ((toward_the_middle * edges[:, 4:6]).sum(axis=1) < 0.0).all()


@given(st.sampled_from(sorted(OUTLINES)), st.floats(-50, 50), st.floats(-50, 50), st.floats(-4, 4))
def test_placed_edges_are_the_edges_of_the_placed_outline(name, x, y, yaw):
    local = outline_edges(OUTLINES[name])
    placed = np.empty_like(local)
    place_edges(local, x, y, yaw, placed)
    expected = outline_edges(polygons.place(OUTLINES[name], np.array([x, y, yaw])))
    np.testing.assert_allclose(placed, expected, atol=1e-12)
    place_edges(local, x, y, yaw, local)
    np.testing.assert_array_equal(local, placed)


@pytest.mark.parametrize(
    "outline",
    [
        np.array([[0, 0], [1, 0], [1, 0], [0, 1.0]]),
        np.array([[0, 0], [1, 0], [0, 1], [0, 0.0]]),
        np.array([[0, 0], [1.0, 0]]),
        np.zeros((4, 3)),
        np.array([[0, 0], [1, 0], [np.nan, 1.0]]),
    ],
)
def test_an_outline_without_edges_is_refused(outline):
    with pytest.raises(InputError, match="outline"):
        outline_edges(outline)
