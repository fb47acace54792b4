from __future__ import annotations

import math
import stat
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from motm_wbc.errors import InputError
from motm_wbc.interfaces import Event, GroundTruth, StepReport
from motm_wbc.recording import Recorders, TraceRecorder, camera, colours, solids
from motm_wbc.recording.atomic import AtomicFile
from motm_wbc.scene.scenario import load_scenario

L_SHAPE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]], dtype=float)


class OnlySteps:
    """A recorder that takes no distances; notes what it is told."""

    def __init__(self, fails: bool = False) -> None:
        self.told: list[str] = []
        self._fails = fails

    def step(self, truth: GroundTruth, report: StepReport) -> None:
        self.told.append("step")

    def event(self, event: Event) -> None:
        self.told.append("event")

    def close(self) -> None:
        self.told.append("close")
        if self._fails:
            raise OSError("disk full")


class WithScalars(OnlySteps):
    def scalars(self, time: float, values: Mapping[str, float]) -> None:
        self.told.append(f"scalars {time} {dict(values)}")


def test_importing_the_room_loads_no_heavy_package() -> None:
    code = (
        "import sys, motm_wbc.recording; "
        "print(sorted({'rerun', 'pyarrow', 'pinocchio', 'numba'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_tee_passes_everything_on(run: Any) -> None:
    plain, scalar = OnlySteps(), WithScalars()
    tee = Recorders([plain, scalar])
    tee.step(*run.steps[0])
    tee.event(Event(0.0, "a", "b"))
    tee.scalars(0.5, {"base": 0.1})
    tee.close()
    assert plain.told == ["step", "event", "close"]
    assert scalar.told == ["step", "event", "scalars 0.5 {'base': 0.1}", "close"]


def test_tee_closes_all_even_if_one_fails() -> None:
    broken, sound = OnlySteps(fails=True), OnlySteps()
    with pytest.raises(OSError, match="disk full"):
        Recorders([broken, sound]).close()
    assert broken.told == sound.told == ["close"]


def test_tee_takes_real_recorders(run: Any) -> None:
    trace = TraceRecorder(("shoulder", "elbow"), ("v", "omega"))
    tee = Recorders([trace])
    tee.step(*run.steps[0])
    tee.scalars(0.0, {"arm": 0.2})
    assert trace.table()["distance_arm"].to_pylist() == [0.2]


@given(
    points=hnp.arrays(
        float, st.tuples(st.integers(4, 30), st.just(3)), elements=st.floats(-20.0, 20.0)
    ),
    elevation=st.floats(0.1, 1.5),
    turn=st.floats(-3.0, 3.0),
    aspect=st.floats(0.5, 2.5),
)
def test_cameras_have_all_points_in_the_picture(
    points: np.ndarray, elevation: float, turn: float, aspect: float
) -> None:
    for eye in (camera.slanted(points, aspect, elevation, turn), camera.overhead(points, aspect)):
        gaze = eye.target - eye.position
        if np.linalg.norm(gaze) < 1e-6:  # all points coincide
            continue
        gaze /= np.linalg.norm(gaze)
        right = np.cross(gaze, eye.up)
        right /= np.linalg.norm(right)
        above = np.cross(right, gaze)
        seen = points - eye.position
        depth = seen @ gaze
        half = math.tan(math.radians(27.5))
        assert np.all(depth >= -1e-6)
        assert np.all(np.abs(seen @ above) <= half * depth / 1.04 + 1e-6)
        assert np.all(np.abs(seen @ right) <= half * aspect * depth / 1.04 + 1e-6)


def test_camera_is_no_farther_than_needed() -> None:
    points = camera.landmarks(load_scenario("line"), 1.0)
    eye = camera.overhead(points, 1.3)
    seen = points - eye.position
    half = math.tan(math.radians(27.5))
    share = np.abs(seen[:, :2]) / (half * -seen[:, 2:])
    # The scene's long side (y) is across the picture; the tighter side has its air, no more.
    tightest = max(share[:, 1].max() / 1.3, share[:, 0].max())
    assert tightest == pytest.approx(1.0 / 1.05, abs=1e-9)


def test_prisms_are_closed_and_face_outward() -> None:
    vertices, triangles = solids.prism_mesh(L_SHAPE, 0.5, 2.0)
    corners = vertices[triangles]
    # Divergence theorem: the volume is right only if every face is there and faces outward.
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(4.0 * 1.5)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, atol=1e-12)
    assert (vertices[:, 2].min(), vertices[:, 2].max()) == (0.5, 2.0)


def test_cheapest_candidates_are_brightest() -> None:
    costs = np.array([3.0, 1.0, 2.0])
    packed = colours.by_cost(costs)
    light = sum((packed >> shift & 0xFF).astype(float) for shift in (24, 16, 8))
    assert np.argsort(light).tolist() == [0, 2, 1]
    assert packed[1] == 0xFDE725FF
    assert colours.by_cost(np.array([2.0, 2.0])).tolist() == [0xFDE725FF] * 2
    assert colours.by_cost(np.empty(0)).shape == (0,)


def test_atomic_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    file = AtomicFile(path)
    file.temporary.write_text("new")
    assert not path.exists()
    file.commit()
    assert path.read_text() == "new"
    plain = tmp_path / "plain"
    plain.touch()
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)
    AtomicFile(path).discard()
    assert path.read_text() == "new"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.txt", "plain"]


def test_devices_are_not_replaced() -> None:
    with pytest.raises(InputError, match="is no regular file"):
        AtomicFile(Path("/dev/null"))
