"""The stages of placing, driven by made-up moments."""

import numpy as np
import pytest

from motm_wbc.mission.cylinder import CylinderPoint
from motm_wbc.mission.orientation import top_down
from motm_wbc.mission.parameters import GraspParameters, ReachParameters
from motm_wbc.mission.place import PlaceMachine
from motm_wbc.mission.stages import Moment, Stage

CARRY = CylinderPoint(0.45, 0.0, 0.8, 0.0, 0.0, 0.0)
GRASP = GraspParameters()
DROP = np.array([0.6, 0.0, 0.625])
T_GRIP_OBJECT = np.eye(4)
T_GRIP_OBJECT[:3, 3] = [0.0, 0.0, 0.005]  # the object hangs 5 mm below the grip


def machine() -> PlaceMachine:
    T_world_drop = np.eye(4)
    T_world_drop[:3, 3] = DROP
    return PlaceMachine(
        "cube",
        T_world_drop,
        T_GRIP_OBJECT,
        closed_width=0.05,
        open_width=0.08,
        grasp=GRASP,
        reach=ReachParameters(),
    )


def moment(tool, **changes) -> Moment:
    T = np.eye(4)
    T[:3, :3] = top_down(0.3)
    T[:3, 3] = tool
    values = {
        "time": 0.0,
        "T_world_tool": T,
        "tool_velocity": np.zeros(3),
        "T_world_object": T @ T_GRIP_OBJECT,
        "gripper_width": 0.05,
        "fingers_loaded": True,
        "arrival": None,
        "start_before": 0.6,
        "in_range": False,
        "tool_bearing": 0.0,
        "target_bearing": 0.0,
    }
    return Moment(**(values | changes))


def step(placing, now):
    return placing.update(now, CARRY)


def test_it_lifts_carries_reaches_sets_down_and_retreats():
    placing = machine()
    start = np.array([0.0, 0.5, 0.63])
    lifting = step(placing, moment(start))
    assert lifting.stage is Stage.LIFT and lifting.order.may_touch
    assert lifting.order.point == pytest.approx(start + [0.0, 0.0, GRASP.lift + 0.01])
    off = step(placing, moment(start + [0.0, 0.0, 0.02]))
    assert off.stage is Stage.LIFT and not off.order.may_touch

    carried = step(placing, moment(start + [0.0, 0.0, GRASP.lift]))
    assert carried.stage is Stage.TRAVEL and carried.order.cylinder is CARRY
    assert carried.order.gripper_width == 0.0

    above = DROP + [0.0, 0.0, 0.1]
    reaching = step(placing, moment(DROP + [0.2, 0.0, 0.1], in_range=True))
    assert reaching.stage is Stage.REACH
    set_down = step(placing, moment(above, in_range=True))
    assert set_down.stage is Stage.DESCEND
    at = DROP + [0.0, 0.0, 0.005 + GRASP.release_height]
    assert set_down.order.point == pytest.approx(at)
    assert set_down.order.may_touch

    fast = step(placing, moment(at, tool_velocity=np.array([0.3, 0.0, 0.0]), in_range=True))
    assert fast.stage is Stage.DESCEND
    released = step(placing, moment(at, in_range=True))
    assert released.stage is Stage.RELEASE and released.order.gripper_width == 0.08
    assert not placing.released
    assert step(placing, moment(at, gripper_width=0.06)).stage is Stage.RELEASE
    opened = step(placing, moment(at, gripper_width=0.07, time=2.0))
    assert opened.stage is Stage.RETREAT and placing.released
    assert [event.kind for event in opened.events] == ["dropped"]
    assert opened.order.point == pytest.approx(at + [0.0, 0.0, GRASP.retreat])
    assert step(placing, moment(at + [0.0, 0.0, GRASP.retreat])).stage is Stage.DONE


def test_an_object_beside_its_place_is_not_let_go():
    placing = machine()
    step(placing, moment(DROP))
    step(placing, moment(DROP + [0.0, 0.0, GRASP.lift], in_range=True))
    step(placing, moment(DROP + [0.0, 0.0, 0.1], in_range=True))
    step(placing, moment(DROP + [0.0, 0.0, 0.1], in_range=True))
    assert placing.stage is Stage.DESCEND
    beside = step(placing, moment(DROP + [0.0125, 0.0, 0.009], in_range=True))
    assert beside.stage is Stage.DESCEND
    lost = step(placing, moment(DROP + [0.04, 0.0, 0.009], in_range=True))
    assert lost.stage is Stage.REACH
    assert lost.order.point[2] > DROP[2] + 0.05


def test_a_load_that_slips_out_is_noticed():
    placing = machine()
    step(placing, moment(DROP, time=0.0))
    held = step(placing, moment(DROP + [0.0, 0.0, GRASP.lift], time=0.5))
    assert held.stage is Stage.TRAVEL
    flicker = step(placing, moment(DROP, time=0.6, fingers_loaded=False))
    assert flicker.stage is Stage.TRAVEL
    lost = step(placing, moment(DROP, time=0.7, fingers_loaded=False))
    assert lost.stage is Stage.LOST
    assert [event.kind for event in lost.events] == ["lost"]
    assert lost.order.gripper_width == 0.08


def test_a_load_that_was_never_felt_is_noticed_as_well():
    placing = machine()
    assert step(placing, moment(DROP, fingers_loaded=False)).stage is Stage.LIFT
    assert step(placing, moment(DROP, time=0.2, fingers_loaded=False)).stage is Stage.LOST
