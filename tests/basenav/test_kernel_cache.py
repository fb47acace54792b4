"""The folder of compiled kernels follows their sources."""

from pathlib import Path

from motm_wbc.basenav import jit
from motm_wbc.basenav.visibility import line_of_sight

KERNEL = "from motm_wbc.basenav.jit import kernel\n"


def test_the_digest_changes_with_any_kernel_file_and_only_with_those(tmp_path):
    outer, inner, other = (tmp_path / name for name in ("outer.py", "inner.py", "other.py"))
    outer.write_text(KERNEL + "a = 1\n")
    inner.write_text(KERNEL + "b = 1\n")
    other.write_text("c = 1\n")
    before = jit.sources_digest(tmp_path)
    other.write_text("c = 2\n")
    assert jit.sources_digest(tmp_path) == before
    inner.write_text(KERNEL + "b = 2\n")
    assert jit.sources_digest(tmp_path) != before


def test_the_cache_can_be_moved(monkeypatch, tmp_path):
    monkeypatch.setenv("MOTM_CACHE", str(tmp_path))
    assert jit.cache_folder().is_relative_to(tmp_path)
    monkeypatch.delenv("MOTM_CACHE")
    assert not jit.cache_folder().is_relative_to(tmp_path)


def test_kernels_are_kept_there():
    line_of_sight_folder = Path(line_of_sight.stats.cache_path)
    assert line_of_sight_folder.is_relative_to(jit.cache_folder())
