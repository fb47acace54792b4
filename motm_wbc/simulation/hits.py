"""When a finger that is not grasping knocks against an object: told once a hit."""

from __future__ import annotations

_HIT = 1e-3  # [m] that an object is pushed before it counts
_OVER = 0.1  # [s] without a push after which the next one is a new hit


class HitWatch:
    """Adds up how far fingers push an object, hit by hit."""

    def __init__(self) -> None:
        self._pushed: dict[str, float] = {}
        self._last: dict[str, float] = {}

    def push(self, name: str, distance: float, time: float) -> bool:
        """Take one step's push [m] of an object; whether it makes a hit of it."""
        if time - self._last.get(name, -_OVER) > _OVER:
            self._pushed[name] = 0.0
        before = self._pushed.get(name, 0.0)
        self._pushed[name] = before + distance
        self._last[name] = time
        return before < _HIT <= before + distance
