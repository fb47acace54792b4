"""Where to look from, so that the whole scene is in the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from motm_wbc.geometry import polygons
from motm_wbc.geometry.arrays import Array
from motm_wbc.scene.scenario import Scenario

_FIELD_OF_VIEW = math.radians(55.0)  # vertical, of rerun's orbital eye
_ROBOT_HEIGHT = 1.3  # [m], an arm's elbow
_AIR = 1.05  # share of the picture that stays free at its edges, plus one


@dataclass(frozen=True, slots=True)
class Camera:
    """An eye.

    Attributes:
        position: (3,) [m].
        target: (3,) point that is looked at [m].
        up: (3,) direction that is up in the picture.
    """

    position: Array
    target: Array
    up: Array


def landmarks(scenario: Scenario, margin: float) -> Array:
    """(n, 3) points that the picture of a run must hold [m].

    Args:
        scenario: start, solids and task are taken in; a boundary may be far away.
        margin: room for the robot about its start and its targets [m].
    """
    points: list[Array] = []
    for solid in (*scenario.supports, *scenario.obstacles):
        outline = solid.footprint()
        points += [_at(outline, 0.0), _at(outline, solid.top)]
    centres = [scenario.start_pose[:2]]
    centres += [
        np.array(step.at or scenario.object(step.object).position) for step in scenario.task
    ]
    for centre in centres:
        points.append(_at(polygons.disc(margin, 24) + centre, 0.0))
        points.append(_at(polygons.disc(0.5 * margin, 24) + centre, _ROBOT_HEIGHT))
    return np.vstack(points)


def slanted(points: Array, aspect: float, elevation: float, turn: float) -> Camera:
    """An eye that sees the scene from the side, its long side across the picture.

    Args:
        points: (n, 3) what the picture must hold [m].
        aspect: width over height of the picture.
        elevation: angle of the view below the horizontal [rad].
        turn: about the vertical, away from looking square onto the long side [rad].
    """
    right = _long_side(points)
    forward = np.array([-right[1], right[0], 0.0])
    level = math.cos(turn) * forward + math.sin(turn) * right
    gaze = math.cos(elevation) * level - np.array([0.0, 0.0, math.sin(elevation)])
    return framed(points, gaze, np.array([0.0, 0.0, 1.0]), aspect)


def overhead(points: Array, aspect: float) -> Camera:
    """An eye that looks straight down, the scene's long side across the picture."""
    right = _long_side(points)
    up = np.array([-right[1], right[0], 0.0])
    return framed(points, np.array([0.0, 0.0, -1.0]), up, aspect)


def framed(points: Array, gaze: Array, up: Array, aspect: float) -> Camera:
    """The nearest eye with a given gaze that has all points in its picture.

    In the axes (right, above, gaze) a point p is in the picture of an eye e if
    |p_r - e_r| <= h (p_g - e_g), and likewise above. Over all points that is
    max(p_r - h p_g) + h e_g <= e_r <= min(p_r + h p_g) - h e_g, so the largest e_g that
    leaves room for e_r is exact, and e_r is in the middle.

    Args:
        points: (n, 3) [m].
        gaze: (3,) unit vector of the view.
        up: (3,) direction that is up in the picture, not along the gaze.
        aspect: width over height of the picture.
    """
    right = np.cross(gaze, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, gaze)
    depth = points @ gaze
    upright = math.tan(0.5 * _FIELD_OF_VIEW) / _AIR
    middles, nearest = [], []
    for axis, half in ((right, upright * aspect), (above, upright)):
        across = points @ axis
        low, high = np.max(across - half * depth), np.min(across + half * depth)
        middles.append(0.5 * (low + high))
        nearest.append((high - low) / (2.0 * half))
    along = float(min(nearest))
    eye = middles[0] * right + middles[1] * above + along * gaze
    return Camera(eye, eye + (float(depth.mean()) - along) * gaze, up)


def _long_side(points: Array) -> Array:
    """(3,) horizontal unit vector along the longer side of the points' bounding box."""
    extent = np.ptp(points, axis=0)
    return np.array([1.0, 0.0, 0.0]) if extent[0] >= extent[1] else np.array([0.0, 1.0, 0.0])


def _at(points: Array, height: float) -> Array:
    return np.column_stack([points, np.full(len(points), height)])
