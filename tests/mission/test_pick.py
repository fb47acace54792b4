"""The stages of picking, driven by made-up moments."""

import math
from dataclasses import replace

import numpy as np
import pytest

from motm_wbc.mission.orientation import top_down
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.pick import PickMachine
from motm_wbc.mission.stages import Moment, Stage
from motm_wbc.mission.tool_yaw import YawRange

GRASP = GraspParameters()
SWEEP = np.zeros(1)


def machine() -> PickMachine:
    return PickMachine(
        "cube",
        grasp_height=0.0,
        yaws=(0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi),
        yaw_range=YawRange(-2.0, 2.0),
        open_width=0.08,
        opened_width=0.078,
        closing_time=0.3,
        grasp=GRASP,
        reach=ReachParameters(),
    )


def moment(offset=(0.0, 0.0, 0.0), yaw=0.0, **changes) -> Moment:
    tool, thing = np.eye(4), np.eye(4)
    thing[:3, 3] = [0.6, 0.0, 0.6]
    tool[:3, :3] = top_down(yaw)
    tool[:3, 3] = thing[:3, 3] + np.array(offset)
    made = Moment(
        time=0.0,
        T_world_tool=tool,
        tool_velocity=np.zeros(3),
        T_world_object=thing,
        gripper_width=0.08,
        fingers_loaded=False,
        arrival=None,
        start_before=0.6,
        in_range=True,
        tool_bearing=0.0,
        target_bearing=0.0,
    )
    return replace(made, **changes)


def step(picking, now):
    return picking.update(now, SWEEP)


def ready() -> PickMachine:
    picking = machine()
    step(picking, moment((0.0, 0.0, 0.3)))
    step(picking, moment((0.0, 0.0, 0.06)))
    assert picking.stage is Stage.DESCEND
    return picking


def test_it_waits_while_nothing_is_in_sight():
    picking = machine()
    answer = step(picking, moment((0.5, 0.0, 0.3), in_range=False))
    assert answer.stage is Stage.TRAVEL
    assert answer.order.point is None and answer.order.cylinder is None


def test_it_hovers_until_it_is_aligned():
    picking = machine()
    answer = step(picking, moment((0.2, 0.0, 0.3)))
    assert answer.stage is Stage.REACH
    assert answer.order.point[2] == pytest.approx(0.6 + GRASP.hover)
    assert step(picking, moment((0.02, 0.0, 0.06))).stage is Stage.REACH
    assert step(picking, moment((0.0, 0.0, 0.06), yaw=0.12)).stage is Stage.REACH
    lowered = step(picking, moment((0.005, 0.0, 0.06)))
    assert lowered.stage is Stage.DESCEND
    assert lowered.order.point[2] == pytest.approx(0.6)


@pytest.mark.parametrize(
    "spoilt",
    [
        {"offset": (0.0, 0.0, 0.02)},
        {"yaw": 0.2},
        {"tool_velocity": np.array([0.1, 0.0, 0.0])},
    ],
)
def test_no_attempt_while_anything_is_off(spoilt):
    picking = ready()
    assert step(picking, moment(time=1.0, **spoilt)).stage is Stage.DESCEND
    assert picking.attempts == 0


def test_attempts_are_repeated_until_one_holds():
    picking = ready()
    answer = step(picking, moment(time=1.0))
    assert answer.stage is Stage.CLOSE and answer.order.gripper_width == 0.0
    assert [event.kind for event in answer.events] == ["attempt"]
    assert step(picking, moment(time=1.3)).stage is Stage.CLOSE
    missed = step(picking, moment(time=1.43))
    assert missed.stage is Stage.REOPEN and missed.order.gripper_width == 0.08
    assert step(picking, moment(time=1.60, gripper_width=0.07)).stage is Stage.REOPEN
    assert step(picking, moment(time=1.62)).stage is Stage.CLOSE
    assert picking.attempts == 2
    held = step(picking, moment(time=1.95, fingers_loaded=True, gripper_width=0.05))
    assert held.stage is Stage.DONE and held.order.gripper_width == 0.0


def test_fingers_that_feel_something_too_early_are_not_believed():
    picking = ready()
    step(picking, moment(time=1.0))
    assert step(picking, moment(time=1.1, fingers_loaded=True)).stage is Stage.CLOSE


def test_a_tool_that_is_carried_off_hovers_again():
    picking = ready()
    lost = step(picking, moment((0.05, 0.0, 0.0), time=1.0))
    assert lost.stage is Stage.REACH
    assert lost.order.point[:2] == pytest.approx([0.65, 0.0])  # straight up first
    assert lost.order.point[2] == pytest.approx(0.6 + GRASP.hover)
    risen = step(picking, moment((0.05, 0.0, 0.05), time=1.2))
    assert risen.order.point[:2] == pytest.approx([0.6, 0.0])
