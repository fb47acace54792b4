from concurrent.futures import ThreadPoolExecutor

import pytest

from motm_wbc.errors import InputError
from motm_wbc.kinematics.cache import cache_folder, store


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MOTM_CACHE", str(tmp_path / "deep" / "cache"))
    return tmp_path / "deep" / "cache"


def test_name_follows_the_content(folder):
    first, second = store("one", "robot", ".urdf"), store("two", "robot", ".urdf")
    assert first != second
    assert store("one", "robot", ".urdf") == first
    assert first.read_text() == "one" and second.read_text() == "two"
    assert first.parent == folder and first.name.startswith("robot-") and first.suffix == ".urdf"
    assert len(list(folder.iterdir())) == 2


def test_a_damaged_file_is_written_again(folder):
    path = store("whole", "robot", ".urdf")
    path.write_text("who")
    assert store("whole", "robot", ".urdf").read_text() == "whole"


def test_a_good_file_is_left_alone(folder):
    path = store("whole", "robot", ".urdf")
    before = path.stat().st_ino
    store("whole", "robot", ".urdf")
    assert path.stat().st_ino == before


def test_many_writers_leave_one_whole_file(folder):
    text = "x" * 200_000
    with ThreadPoolExecutor(8) as pool:
        paths = set(pool.map(lambda _: store(text, "robot", ".urdf"), range(32)))
    assert len(paths) == 1
    assert paths.pop().read_text() == text
    assert len(list(folder.iterdir())) == 1


def test_a_place_that_cannot_be_written_is_said(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("MOTM_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(InputError, match=r"can't be written: .* \(set MOTM_CACHE to another\)"):
        store("x", "robot", ".urdf")


def test_default_is_the_users_own_folder(monkeypatch):
    monkeypatch.delenv("MOTM_CACHE")
    assert cache_folder().name == "motm_wbc"
