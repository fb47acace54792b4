"""Levenberg-Marquardt on the band's banded normal equations."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import lapack

from motm_wbc.basenav.teb_band import Band, resized
from motm_wbc.basenav.teb_obstacles import Parts, near_parts
from motm_wbc.basenav.teb_parameters import TebParameters
from motm_wbc.basenav.teb_residuals import BLOCK, Normal, normal_equations
from motm_wbc.basenav.teb_terms import Ends, Neighbours, Terms
from motm_wbc.geometry.arrays import Array

_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-7
_WEAKER, _STRONGER = 0.2, 5.0
_FLOOR = 1e-3  # added to the diagonal: what no residual holds stays where it is
_HURRY = 30.0  # [1/s^2] added to intervals' diagonal: limits that are kept now don't hold them
_SHRINK = 0.25  # an interval does not fall below this share of itself in one step
_SPLITS = 2  # times as many intervals as the horizon has, at most
_SHIFT = 0.3  # [m] by which a pose may move in one round without its obstacles being looked up


def optimised(
    band: Band,
    terms: Terms,
    ends: Ends,
    footprint: Array,
    parts: Parts,
    radius: float,
    parameters: TebParameters,
) -> Band:
    """The band after some rounds of resizing and of Levenberg-Marquardt steps.

    Args:
        band: to begin with.
        terms: limits and weights, the obstacles' that of the first round.
        ends: velocities at the ends.
        footprint: (m, 4) corners and normals of the footprint.
        parts: the obstacles.
        radius: of the footprint about the base's origin [m].
        parameters: numbers of rounds and steps, durations of intervals.
    """
    p = parameters
    reach = radius + max(p.distance, p.nearness_distance) + _SHIFT
    shortest, longest = p.interval - p.interval_slack, p.interval + p.interval_slack
    most = _SPLITS * math.ceil(p.horizon / p.interval)
    for _ in range(p.outer_iterations):
        band = Band(*resized(*band, shortest, longest, most))
        near = Neighbours(footprint, parts, *near_parts(parts, *band, reach))
        band = _descend(band, terms, ends, near, p.inner_iterations)
        terms = terms._replace(obstacle=terms.obstacle * math.sqrt(p.obstacle_growth))
    return band


def _descend(band: Band, terms: Terms, ends: Ends, near: Neighbours, steps: int) -> Band:
    """Levenberg-Marquardt steps; one that raises the cost is not taken but damped more."""
    cost, normal = normal_equations(terms, ends, near, *band)
    damping = _FIRST_DAMPING
    for _ in range(steps):
        tried = _moved(band, _step(normal, damping))
        tried_cost, tried_normal = normal_equations(terms, ends, near, *tried)
        if tried_cost < cost:
            band, cost, normal = tried, tried_cost, tried_normal
            damping = max(damping * _WEAKER, _LEAST_DAMPING)
        else:
            damping *= _STRONGER
    return band


def _step(normal: Normal, damping: float) -> Array:
    """Solution of the damped equations; first and last pose stay, as all does if it fails."""
    step = np.zeros(len(normal.gradient))
    matrix = normal.band[3:-3].copy()
    matrix[:, 0] += damping * (matrix[:, 0] + _FLOOR)
    matrix[::BLOCK, 0] += _HURRY
    _, free, info = lapack.dpbsv(matrix.T, -normal.gradient[3:-3], lower=1, overwrite_ab=1)
    if info == 0:
        step[3:-3] = free
    return step


def _moved(band: Band, step: Array) -> Band:
    blocks = np.append(step, 0.0).reshape(-1, BLOCK)
    poses = band.poses + blocks[:, :3]
    intervals = np.maximum(band.intervals + blocks[:-1, 3], _SHRINK * band.intervals)
    return Band(poses, intervals)
