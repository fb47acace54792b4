"""What many reaches come to, as lines of text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from benchmarks.reaching.reach import LIMIT, PAIR, Outcome

CHATTER = 10
"""Reversals of one joint in a second beyond which it counts as chatter: a swing of 5 Hz, faster
than what a wrist does that turns about near a singular pose."""
_BY_PART = {"base": "the base's body", "link": "its own links"}
_HAND = ("link7", "hand", "left_finger", "right_finger")
_NAMED = 8


def table(outcomes: Sequence[Outcome]) -> str:
    """Counts, misses by reason, margins, restlessness, for one outcome or more."""
    reached = [outcome for outcome in outcomes if outcome.reached]
    missed = [outcome for outcome in outcomes if not outcome.reached]
    least = min(outcomes, key=lambda outcome: outcome.margin)
    lines = [
        f"drawn              {sum(outcome.drawn for outcome in outcomes)}",
        f"with a free way    {sum(outcome.free for outcome in outcomes)}",
        f"legal as well      {len(outcomes)}",
        f"reached            {_share(reached, outcomes)}",
        f"  at the first try {_share([o for o in reached if not o.regrouped], outcomes)}",
    ]
    for kind in sorted({outcome.kind for outcome in outcomes}):
        of_kind = [outcome for outcome in outcomes if outcome.kind == kind]
        inside = [outcome for outcome in of_kind if outcome.reached]
        lines.append(f"  {kind:<16} {_share(inside, of_kind)}")
    lines.append(f"  after the path   {_spread([o.time - o.duration for o in reached], 's')}")
    lines.append(f"missed             {len(missed)}, held back at the end by")
    lines += _counted([reason(outcome) for outcome in missed])
    lines.append("  by name")
    lines += _counted([_plain(name) for outcome in missed for name in outcome.held_back])
    if any(outcome.followed_share is not None for outcome in outcomes):
        open_ways = [outcome for outcome in outcomes if not outcome.is_blocked]
        lines += [
            f"  no arm motion along the straight way {len(outcomes) - len(open_ways)}",
            f"  reached without these {_share(reached, open_ways)}",
        ]
    lines += [
        f"  left             {_spread([1e3 * o.position_error for o in missed], 'mm')}; "
        f"{_spread([o.angle_error for o in missed], 'rad')}",
    ]
    touching = [[_plain(name) for name in outcome.contacts] for outcome in outcomes]
    for who, is_base in (("arm", False), ("base", True)):
        names = [[n for n in found if n.startswith("base_link") is is_base] for found in touching]
        lines.append(f"contact of the {who}: {_affected([bool(found) for found in names])}")
        lines += _counted([name for found in names for name in found])
    lines += [
        f"least margin       {1e3 * least.margin:+.4f} mm to the safe distance of "
        f"{least.margin_kind}: {least.margin_pair} (scene {least.scene}, target {least.target})",
        f"limits broken      {_affected([o.limits_broken > 0 for o in outcomes])}",
        f"off the first rung {_affected([set(o.rungs) != {'full'} for o in outcomes])}",
        *_counted([rung for o in outcomes for rung in o.rungs if rung != "full"]),
        f"reversals          {_spread([float(o.reversals) for o in outcomes], 'in a second')}; "
        f"chatter (more than {CHATTER}): {_affected([o.reversals > CHATTER for o in outcomes])}",
        f"above 10 Hz        {_spread([o.high_share for o in outcomes], 'of the energy')}",
        f"step               {1e3 * float(np.median([o.step_time for o in outcomes])):.3f} ms",
    ]
    return "\n".join(lines)


def reason(outcome: Outcome) -> str:
    """What held a reach back at its end, in kinds: joints' limits, and pairs by their bodies."""
    kinds = set()
    for name in outcome.held_back:
        if name.endswith(LIMIT):
            kinds.add("joint limits")
            continue
        first, second = name.split(PAIR)
        who = "hand" if first in _HAND else "arm"
        whom = next((text for part, text in _BY_PART.items() if second.startswith(part)), "scene")
        kinds.add(f"{who} and {whom}")
    return " + ".join(sorted(kinds)) or "none: the tasks are in balance, or it was too slow"


def _plain(name: str) -> str:
    """A name with the numbers of scene bodies taken off, so that many scenes can be counted."""
    first, separator, second = name.partition(PAIR)
    parts = [part.rstrip("0123456789") for part in second.split("_")]
    return first + separator + (second if second.startswith("link") else "_".join(parts))


def _share(part: Sequence[Outcome], whole: Sequence[Outcome]) -> str:
    return f"{len(part)} of {len(whole)}, {100.0 * len(part) / max(len(whole), 1):.1f} %"


def _affected(flags: Sequence[bool]) -> str:
    return f"{sum(flags)} reaches"


def _counted(names: Sequence[str]) -> list[str]:
    return [f"    {number:4d}  {name}" for name, number in Counter(names).most_common(_NAMED)]


def _spread(values: Sequence[float], unit: str) -> str:
    """Median, 95 % quantile and largest."""
    if not values:
        return "-"
    middle, high, most = np.quantile(values, (0.5, 0.95, 1.0))
    return f"median {middle:.3g}, 95 % {high:.3g}, largest {most:.3g} {unit}"
