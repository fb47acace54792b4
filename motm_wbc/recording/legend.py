"""What the colours of the scene mean, for the reader of a recording."""

from __future__ import annotations

from motm_wbc.scene.scenario import Scenario

_KEY = (
    ("white outline", "footprint of the base, with a line to its front; white line: its trail"),
    ("small arrows, violet to yellow", "candidate poses, the brightest is the cheapest"),
    ("grey ticks", "candidates that were rejected; the label names the reason"),
    ("magenta arrow", "goal of the base, with its cost [s]"),
    ("pale blue line", "global path"),
    ("cyan line", "plan of the local search"),
    ("red line and outline", "braking arc, and the footprint where it ends"),
    ("grey ring, yellow ring", "circle of candidates, and reach, about the current target"),
    ("three arrows", "pose that the tool is after: x red, y green, z blue"),
    ("green ring on a support", "where the object shall be put down"),
)


def legend(title: str, scenario: Scenario) -> str:
    """The text, in Markdown.

    Args:
        title: heading.
        scenario: named and described.
    """
    lines = [f"## {title}", f"Scenario **{scenario.name}**: {scenario.description}", ""]
    lines += [f"- **{drawn}**: {meaning}" for drawn, meaning in _KEY]
    return "\n".join(lines)
