"""Drive a base through a map of one's own, and draw it.

python examples/drive_map.py MAP X,Y,HEADING X,Y,HEADING OUT.png

MAP is GeoJSON in metres, or the .yaml of a ROS map.
"""

import sys
from pathlib import Path

import numpy as np

from motm_wbc.basenav import load_world
from motm_wbc.experiments.nav.drawing import draw_drive
from motm_wbc.experiments.nav.drive import drive
from motm_wbc.experiments.nav.result import DriveResult
from motm_wbc.geometry.base_motion import BaseLimits
from motm_wbc.geometry.polygons import rectangle

FOOTPRINT = rectangle(0.68, 0.47)  # corners in the base's frame, its origin between the wheels
LIMITS = BaseLimits(v_max=0.5, v_reverse=0.2, omega_max=1.745, a_max=0.5, alpha_max=2.0)


def main(map_file: str, start: str, goal: str, picture: str) -> DriveResult:
    world = load_world(map_file)
    begin, end = (np.array([float(part) for part in pose.split(",")]) for pose in (start, goal))
    result = drive(world, FOOTPRINT, LIMITS, begin, end, stop=True)
    draw_drive(Path(picture), world, FOOTPRINT, LIMITS, end, result)
    print(result.failure_reason or f"there after {result.time_s:.2f} s", f"({picture})")
    return result


if __name__ == "__main__":
    main(*sys.argv[1:])
