"""Finding the pairs of capsules that a robot file has to name.

For whoever writes a robot file. A pair matters when it can come close, and does not touch
by its nature: neighbours along the chain, and pairs that touch in nearly every posture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry.arrays import Array
from motm_wbc.kinematics.model import RobotModel

_ALWAYS = 0.95  # share of touching samples that counts as "always"
_SEGMENT_POINTS = 17  # on a segment, for its distance to the base's box


@dataclass(frozen=True, slots=True)
class Pairs:
    """The pairs that matter.

    Attributes:
        self_pairs: names of capsules that must keep apart.
        base_pairs: names of capsules that must keep off the base's body.
    """

    self_pairs: tuple[tuple[str, str], ...]
    base_pairs: tuple[str, ...]


def find_pairs(model: RobotModel, near: float = 0.02, samples: int = 20000, seed: int = 0) -> Pairs:
    """The pairs that a robot file should name, from random postures.

    Args:
        model: the robot; the pairs in its own description don't matter.
        near: pairs that never come closer than this are left out [m].
        samples: number of postures, uniform between the joint limits.
        seed: of the random postures.
    """
    rng = np.random.default_rng(seed)
    low = np.where(np.isfinite(model.q_lower), model.q_lower, -np.pi)
    high = np.where(np.isfinite(model.q_upper), model.q_upper, np.pi)
    postures = rng.uniform(low, high, (samples, model.n_arm))
    segments = np.stack(
        [model.configuration(np.zeros(3), q).capsule_segments() for q in (model.home, *postures)],
        axis=1,
    )
    names, radius = model.capsules.names, model.capsules.radius
    moves = model.capsule_moved_by[:, model.n_base :].sum(axis=1)
    pairs = [
        (names[i], names[j])
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(moves[i] - moves[j]) > 1
        and _matters(segment_gap(segments[i], segments[j]) - radius[i] - radius[j], near)
    ]
    bodies = [
        name
        for name, ends, r, moved in zip(names, segments, radius, moves, strict=True)
        if moved > 1 and _matters(_box_gap(model, ends) - r, near)
    ]
    return Pairs(tuple(pairs), tuple(bodies))


def segment_gap(first: Array, second: Array) -> Array:
    """(n,) distances between segments (n, 2, 3) and (n, 2, 3) [m].

    The closest points of two lines, clamped to the segments one after the other (Ericson,
    "Real-Time Collision Detection", 2005, section 5.1.9).
    """
    d1, d2 = first[:, 1] - first[:, 0], second[:, 1] - second[:, 0]
    r = first[:, 0] - second[:, 0]
    a, e, f = _dot(d1, d1), _dot(d2, d2), _dot(d2, r)
    b, c = _dot(d1, d2), _dot(d1, r)
    tiny = 1e-15
    denominator = a * e - b * b
    s = np.where(
        denominator > tiny, np.clip((b * f - c * e) / np.maximum(denominator, tiny), 0, 1), 0.0
    )
    t = np.where(e > tiny, (b * s + f) / np.maximum(e, tiny), 0.0)
    clamped = np.clip(t, 0.0, 1.0)
    again = np.clip((clamped * b - c) / np.maximum(a, tiny), 0.0, 1.0)
    s = np.where((clamped != t) | (e <= tiny), np.where(a > tiny, again, 0.0), s)
    gap = r + s[:, None] * d1 - clamped[:, None] * d2
    return np.asarray(np.sqrt(_dot(gap, gap)))


def _matters(distance: Array, near: float) -> bool:
    """Whether a pair, its distances (1 + n,) at home and in samples [m], needs a row."""
    touching = distance < 0.0
    return bool(distance.min() < near and not touching[0] and touching.mean() < _ALWAYS)


def _box_gap(model: RobotModel, ends: Array) -> Array:
    """(n,) distances of segments (n, 2, 3) from the base's box, base at the origin [m]."""
    share = np.linspace(0.0, 1.0, _SEGMENT_POINTS)[:, None, None]
    points = (1.0 - share) * ends[:, 0] + share * ends[:, 1]
    outside = np.abs(points - model.base_box.centre) - 0.5 * model.base_box.size
    gap = np.linalg.norm(np.maximum(outside, 0.0), axis=-1) + np.minimum(outside.max(axis=-1), 0.0)
    return np.asarray(gap.min(axis=0))


def _dot(p: Array, q: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", p, q))
