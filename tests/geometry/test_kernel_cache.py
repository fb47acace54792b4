"""The folder of compiled kernels follows their sources."""

from pathlib import Path

from motm_wbc.basenav.visibility import line_of_sight
from motm_wbc.geometry import jit


def package(tmp_path):
    """outer imports inner, which imports constants; other stands alone."""
    folder = tmp_path / "motm_wbc"
    folder.mkdir()
    (folder / "outer.py").write_text("from motm_wbc import (\n    inner,\n)\n")
    (folder / "inner.py").write_text("from motm_wbc.constants import TINY\n")
    (folder / "constants.py").write_text("TINY = 1\n")
    (folder / "other.py").write_text("a = 1\n")
    return folder


def digest(folder, name):
    jit._imported.cache_clear()
    return jit.sources_digest(folder / name, folder.parent)


def test_the_digest_changes_with_all_that_a_file_uses_and_only_with_that(tmp_path):
    folder = package(tmp_path)
    before = digest(folder, "outer.py")
    (folder / "other.py").write_text("a = 2\n")
    assert digest(folder, "outer.py") == before
    (folder / "constants.py").write_text("TINY = 2\n")
    assert digest(folder, "outer.py") != before


def test_files_that_import_each_other_have_a_digest(tmp_path):
    folder = package(tmp_path)
    (folder / "constants.py").write_text("import motm_wbc.outer\nTINY = 1\n")
    assert digest(folder, "outer.py") != digest(folder, "other.py")


def test_the_cache_can_be_moved(monkeypatch, tmp_path):
    monkeypatch.setenv("MOTM_CACHE", str(tmp_path))
    assert jit.cache_root().is_relative_to(tmp_path)
    monkeypatch.delenv("MOTM_CACHE")
    assert not jit.cache_root().is_relative_to(tmp_path)


def test_kernels_are_kept_there():
    folder = Path(line_of_sight.stats.cache_path).parent
    assert folder.parent.name == jit.cache_root().name
    assert folder.name == jit._folder(line_of_sight.__module__).name
