"""Contacts, put together to episodes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Episode:
    """Two bodies that must not touch were in contact.

    Attributes:
        first: name of one, a link of the robot or a held object.
        second: name of the other.
        start: first contact [s].
        end: last contact [s].
        depth: largest penetration seen [m], the audit's skin included; exact where shallow.
    """

    first: str
    second: str
    start: float
    end: float
    depth: float

    def __str__(self) -> str:
        span = f"{self.start:.2f} to {self.end:.2f} s"
        return f"{self.first} and {self.second}, {span}, {1e3 * self.depth:.0f} mm deep"


class EpisodeLog:
    """Collects contacts; pauses shorter than a gap don't end an episode.

    Args:
        gap: [s].
    """

    def __init__(self, gap: float) -> None:
        self._gap = gap
        self._episodes: list[Episode] = []
        self._last: dict[tuple[str, str], int] = {}

    def touch(self, first: str, second: str, time: float, depth: float) -> None:
        """Take a contact at `time` [s], `depth` [m] deep."""
        index = self._last.get((first, second))
        if index is not None and time - self._episodes[index].end <= self._gap:
            old = self._episodes[index]
            deepest = max(old.depth, depth)
            self._episodes[index] = Episode(first, second, old.start, time, deepest)
            return
        self._last[first, second] = len(self._episodes)
        self._episodes.append(Episode(first, second, time, time, depth))

    def episodes(self) -> tuple[Episode, ...]:
        """All episodes so far, by their start."""
        return tuple(self._episodes)
