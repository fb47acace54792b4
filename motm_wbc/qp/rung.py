"""Rungs of the ladder."""

from __future__ import annotations

from typing import Literal, TypeAlias

Rung: TypeAlias = Literal["full", "no_acceleration", "soft_collision", "brake"]
"""Rungs of the ladder, from normal operation to the last resort."""
