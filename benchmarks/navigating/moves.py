"""Motions of a differential drive from node to node of a lattice of (x, y, heading).

Nodes are exact poses, and motions join them exactly: turning on the spot, and two arcs with a
common tangent (a biarc). A chain of motions is therefore a way that can be driven as it is.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motm_wbc.geometry.angles import wrap
from motm_wbc.geometry.arrays import Array

_CELLS = 6  # how far a motion may go along x and y [cells]
_TURNS = (0, 1, -1, 2, -2, 4, -4)  # change of heading that a motion along arcs may have
_LENGTH_COST = 0.02  # [rad/cell]: a motion that is no longer than needed is checked with less


class Moves(NamedTuple):
    """All motions, by the heading that they begin with; each has its reverse among them.

    Attributes:
        starts: (headings + 1,) where each heading's motions begin.
        shifts: (m, 3) change of column, row and heading index.
        spans: (m, 2) first and last-plus-one of the poses in between.
        extents: (m,) farthest of these from the first pose [m].
        between: (p, 4) x, y [m], cos, sin of the poses in between, relative to the first node.
    """

    starts: NDArray[np.int64]
    shifts: NDArray[np.int64]
    spans: NDArray[np.int64]
    extents: Array
    between: Array


@cache
def make_moves(cell: float, headings: int, spacing: float, radius: float) -> Moves:
    """All motions of a lattice; they are shared, not to be written to.

    Args:
        cell: distance of two nodes [m].
        headings: number of headings, evenly over the circle.
        spacing: how far any point of the base may move from pose to pose [m].
        radius: distance of the base's farthest point from its origin [m].
    """
    table: list[list[tuple[tuple[int, int, int], Array]]] = [[] for _ in range(headings)]
    for first in range(headings):
        for shift, poses in _forward(first, cell, headings, spacing, radius):
            table[first].append((shift, poses))
            last = (first + shift[2]) % headings
            back = poses[::-1] - [cell * shift[0], cell * shift[1], 0.0]
            table[last].append(((-shift[0], -shift[1], -shift[2]), back))
    rows = [move for moves in table for move in moves]
    counts = np.array([len(poses) for _, poses in rows])
    ends = np.cumsum(counts)
    poses = np.vstack([poses for _, poses in rows])
    return Moves(
        starts=np.concatenate([[0], np.cumsum([len(moves) for moves in table])]).astype(np.int64),
        shifts=np.array([shift for shift, _ in rows], dtype=np.int64),
        spans=np.column_stack([ends - counts, ends]).astype(np.int64),
        extents=np.array([np.hypot(way[:, 0], way[:, 1]).max() for _, way in rows]),
        between=np.column_stack([poses[:, :2], np.cos(poses[:, 2]), np.sin(poses[:, 2])]),
    )


def _forward(
    first: int, cell: float, headings: int, spacing: float, radius: float
) -> list[tuple[tuple[int, int, int], Array]]:
    """Motions forward from a heading, and turning left: shift, poses in between."""
    unit = math.tau / headings
    theta = unit * first
    count = math.ceil(radius * unit / spacing)
    turning = np.zeros((count + 1, 3))
    turning[:, 2] = theta + unit * np.arange(count + 1) / count
    found = [((0, 0, 1), turning)]
    for turn in _TURNS:
        column, row = _target(theta, theta + unit * turn)
        poses = _biarc(theta, theta + unit * turn, column * cell, row * cell, spacing, radius)
        found.append(((column, row, turn), poses))
    return found


def _target(theta: float, after: float) -> tuple[int, int]:
    """The node that a motion ends at: where least is turned to and fro on the way."""
    best, least = (0, 0), math.inf
    for column in range(-_CELLS, _CELLS + 1):
        for row in range(-_CELLS, _CELLS + 1):
            length = math.hypot(column, row)
            direction = math.atan2(row, column)
            ahead = abs(wrap(direction - theta)) < 0.5 * math.pi
            if not 2.0 <= length <= _CELLS or not ahead:
                continue
            turns = [turn for turn, _ in _arcs(theta, after, float(column), float(row))]
            wasted = sum(abs(turn) for turn in turns) - abs(wrap(after - theta))
            cost = wasted + _LENGTH_COST * length
            if cost < least:
                best, least = (column, row), cost
    return best


def _arcs(theta: float, after: float, x: float, y: float) -> list[tuple[float, float]]:
    """Turn [rad] and length [m] of the two arcs from (0, 0, theta) to (x, y, after)."""
    t0 = np.array([math.cos(theta), math.sin(theta)])
    t1 = np.array([math.cos(after), math.sin(after)])
    way = np.array([x, y])
    both, bend = float(way @ (t0 + t1)), 2.0 * (1.0 - float(t0 @ t1))
    square = float(way @ way)
    if bend < 1e-12:
        reach = square / (2.0 * both)
    else:
        reach = (-both + math.sqrt(both * both + bend * square)) / bend
    joint = 0.5 * (way + reach * (t0 - t1))
    first = _arc(theta, joint)
    return [first, _arc(theta + first[0], way - joint)]


def _arc(theta: float, chord: Array) -> tuple[float, float]:
    half = wrap(math.atan2(chord[1], chord[0]) - theta)
    length = math.hypot(*chord)
    return 2.0 * half, length if abs(half) < 1e-9 else length * half / math.sin(half)


def _biarc(theta: float, after: float, x: float, y: float, spacing: float, radius: float) -> Array:
    """(n, 3) poses from (0, 0, theta) to (x, y, after), both ends included."""
    poses = [np.array([0.0, 0.0, theta])]
    for turn, length in _arcs(theta, after, x, y):
        begin = poses[-1]
        count = max(1, math.ceil((length + radius * abs(turn)) / spacing))
        for k in range(1, count + 1):
            half = 0.5 * turn * k / count
            chord = length * k / count * (1.0 if abs(half) < 1e-9 else math.sin(half) / half)
            heading = begin[2] + half
            step = [chord * math.cos(heading), chord * math.sin(heading), 2.0 * half]
            poses.append(begin + step)
    return np.array(poses)
