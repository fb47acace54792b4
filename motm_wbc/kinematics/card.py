"""A robot in a few lines, for listings and checks."""

from __future__ import annotations

import math

import numpy as np

from motm_wbc.kinematics.model import RobotModel


def summarise(model: RobotModel) -> list[tuple[str, str]]:
    """Rows (name, value) of a robot's card: every limit that the controller works with."""
    description, base, reach = model.description, model.base_limits, model.description.reach
    gripper, tool = description.gripper, description.tool
    size = model.base_box.size
    x, y, z = model.T_base_arm[:3, 3]
    rows = [
        ("robot", f"{model.name}: {description.description}".rstrip(": ")),
        ("maker, licence", f"{description.maker or '-'}, {description.license}"),
        ("source", description.source),
        ("base", f"{model.base_kind}, inputs {', '.join(model.base_kind.inputs)}"),
        (
            "base limits",
            f"{base.v_max:g} m/s ahead, {base.v_reverse:g} m/s back, {base.omega_max:g} rad/s, "
            f"{base.a_max:g} m/s^2, {base.alpha_max:g} rad/s^2",
        ),
        (
            "footprint",
            f"{size[0]:g} x {size[1]:g} m, {len(model.footprint)} corners, "
            f"{model.base_height:g} m high",
        ),
        ("arm", f"{model.n_arm} joints, mounted at ({x:g}, {y:g}, {z:g}) m"),
    ]
    rows += [(name, _joint(model, i)) for i, name in enumerate(model.arm_joints)]
    rows += [
        ("tool", f"{model.tool_link}, fixed to {tool.parent} at {_vector(tool.xyz)} m"),
        ("approach axis", f"{_vector(tool.approach_axis)} of the tool"),
        (
            "gripper",
            f"{gripper.max_width:g} m wide, {len(gripper.fingers)} fingers, "
            f"closes at {gripper.closing_speed:g} m/s in at least {gripper.min_closing_time:g} s, "
            f"{gripper.force:g} N",
        ),
        (
            "reach",
            f"grasps within {reach.grasp_range:g} m, holds within {reach.hold_radius:g} m, "
            f"bearing +-{math.degrees(reach.bearing_limit):.0f} deg, from the arm's base",
        ),
        (
            "collision",
            f"{len(model.capsules)} capsules, {len(model.self_pairs)} self pairs, "
            f"{len(model.base_pairs)} against the base",
        ),
    ]
    return rows


def _joint(model: RobotModel, i: int) -> str:
    low, high = model.q_lower[i], model.q_upper[i]
    held = f"[{low:g}, {high:g}]" if np.isfinite(low) else "continuous"
    return (
        f"{held} rad or m, {model.v_max[i]:g} /s, {model.a_max[i]:g} /s^2, home {model.home[i]:g}"
    )


def _vector(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
