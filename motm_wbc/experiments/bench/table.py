"""A benchmark's result for people."""

from __future__ import annotations

from collections.abc import Iterator

from motm_wbc.experiments.bench.basenav import NavBenchResult
from motm_wbc.experiments.bench.wholebody import BenchResult


def rows(result: BenchResult) -> Iterator[tuple[str, str, str, str]]:
    """Name, median, p99 and solver of each contestant that took part, under its problem's title."""
    before = ""
    for name, one in result.figures.items():
        if one is None:
            continue
        if result.titles[name] != before:
            before = result.titles[name]
            yield before, "", "", ""
        failed = f", failed {one['failed']} times" if one["failed"] else ""
        yield f"  {name}", f"{one['median']:.0f}", f"{one['p99']:.0f}", one["solver"] + failed


def nav_rows(result: NavBenchResult) -> Iterator[tuple[str, str, str]]:
    """Title, median and p99 of each figure of base navigation; the unit is in the name."""
    for name, one in result.figures.items():
        if isinstance(one, dict):
            yield f"{result.titles[name]} ({name})", f"{one['median']:.0f}", f"{one['p99']:.0f}"
        else:
            yield f"{result.titles[name]} ({name})", f"{one:.0f}", ""
