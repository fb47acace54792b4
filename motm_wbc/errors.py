"""The errors of the package: one tree, so that a caller can catch all of it at once.

Every message is one line that says what was wrong, where, and what would be legal.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class MotmError(Exception):
    """Base of every error that this package raises on purpose."""


class InputError(MotmError):
    """Something that the user gave (a file, an option, an argument) can't be used.

    Attributes:
        what: what is wrong and what would be legal.
        where: the file and key, option or argument, empty if there is none.
    """

    def __init__(self, what: str, where: str = "") -> None:
        self.what = what
        self.where = where
        super().__init__(f"{where}: {what}" if where else what)


class UnknownName(InputError):
    """A name that is not one of a known set; the message has the nearest legal one."""

    def __init__(self, kind: str, name: str, legal: Iterable[str], where: str = "") -> None:
        choices = sorted(legal)
        near = difflib.get_close_matches(name, choices, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}? " if near else ""
        listed = ", ".join(choices) if choices else "none"
        super().__init__(f"unknown {kind} {name!r}; {hint}legal: {listed}", where)


class NoPath(MotmError):
    """There is no collision-free path between the two places asked for."""


class Unavailable(InputError):
    """A part that needs a package which can't be imported here."""
