"""All that one compiled step reads and writes, as nested named tuples of arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from motm_wbc.geometry.arrays import Array
from motm_wbc.geometry.jit import inlined
from motm_wbc.geometry.views import prototype, reader
from motm_wbc.kinematics.chain import Chain
from motm_wbc.qp.limits import BaseArrays, JointArrays
from motm_wbc.qp.nearby import NearArrays, PairArrays
from motm_wbc.qp.objective import PostureArrays, ToolArrays
from motm_wbc.qp.rows import RowArrays
from motm_wbc.qp.segments import SegmentArrays
from motm_wbc.qp.selection import SelectionArrays
from motm_wbc.qp.shapes import SceneArrays

Codes = npt.NDArray[np.int8]


class StateArrays(NamedTuple):
    """What one step starts from, and room for what is worked out of it.

    Attributes:
        positions: base pose, arm joints, fingers, as `kinematics.chain.forward` takes them.
        previous: (n_inputs,) inputs that were commanded last.
        reference: (n_base,) inputs that navigation asks for, or that are preferred.
        input_weights: (n_base,) weights of preferred inputs.
        heading: (3,) weight, gain [1/s] and preferred heading [rad].
        locked: (n_inputs,) 1.0 for each input that shall stand still.
        linear_J: (l, n_inputs) tasks of the user's own.
        linear_target: (l,) what they want.
        linear_weights: (l,).
        passed: (n_arm,) by how much each joint has to pass its acceleration limit so that its
            position and velocity hold, is written.
        lead: (n_base,) inputs that the factor scales, is written.
        rotations: (m, 3, 3) of the joint frames, is written.
        translations: (m, 3) [m], is written.
        J_world: (6, n_inputs), is written.
        gradient: (n_arm,) of manipulability, is written.
        bias: (6,) work space.
        H: (n_inputs, n_inputs) cost of all inputs, is written.
        f: (n_inputs,), is written.
    """

    positions: Array
    previous: Array
    reference: Array
    input_weights: Array
    heading: Array
    locked: Array
    linear_J: Array
    linear_target: Array
    linear_weights: Array
    passed: Array
    lead: Array
    rotations: Array
    translations: Array
    J_world: Array
    gradient: Array
    bias: Array
    H: Array
    f: Array


class ProblemArrays(NamedTuple):
    """The arrays of a `QpProblem`; see there."""

    H: Array
    f: Array
    A: Array
    lower: Array
    upper: Array
    hard_lower: Array
    hard_upper: Array
    lower_kind: Codes
    upper_kind: Codes


class Weights(NamedTuple):
    """Weights, gains and safety, as in `WholeBodyParameters`; those up to `yaw` by mode."""

    linear: float
    angular: float
    damping: float
    manipulability: float
    base: float
    yaw: float
    servo_gain: float
    least_error: float
    largest_error: float
    scale: float
    posture: float
    posture_gain: float
    posture_speed: float
    preferred_bound: float
    preferred_bound_margin: float
    pose_speed: float
    pose_turn_speed: float
    retreat_speed: float
    held_rows: float
    dt: float


class StepArrays(NamedTuple):
    """All that one step reads and writes."""

    weights: Array
    problem: ProblemArrays
    chain: Chain
    segments: SegmentArrays
    scene: SceneArrays
    pairs: PairArrays
    near: NearArrays
    selection: SelectionArrays
    rows: RowArrays
    tools: ToolArrays
    posture: PostureArrays
    joints: JointArrays
    base: BaseArrays
    state: StateArrays


PROTOTYPE = StepArrays(
    weights=np.empty(0),
    problem=prototype(ProblemArrays, "f2 f1 f2 f1 f1 f1 f1 c1 c1"),
    chain=prototype(Chain, "i1 i1 f3 f2 f2 i1"),
    segments=prototype(SegmentArrays, "i1 f3 f1 f2 b1 b1"),
    scene=prototype(SceneArrays, "i1 f2 f2 f1 f2 f2 f2 f2 f2"),
    pairs=prototype(PairArrays, "f2 f2 f2 f1 i2 f1"),
    near=prototype(NearArrays, "f3 f2 f2 f2 f2 f1 i1 i2 i1 f2 b1"),
    selection=prototype(SelectionArrays, "f1 i1 i1 i1 f1 i1"),
    rows=prototype(RowArrays, "f2 f1 i2 i3 b1"),
    tools=prototype(ToolArrays, "i1 f3 f2 f2 f2 f3 f1 f1 f2 f3 f1 f3 f3 f2 f2"),
    posture=prototype(PostureArrays, "f1 f1 f1 f1"),
    joints=prototype(JointArrays, "f1 f1 f1 f1 f1"),
    base=prototype(BaseArrays, "f1 f1 f1"),
    state=prototype(StateArrays, "f1 f1 f1 f1 f1 f1 f2 f1 f1 f1 f1 f3 f2 f2 f1 f1 f2 f1"),
)
"""The type and number of dimensions of each array."""
read_arrays = reader(PROTOTYPE)
"""For kernels: the arrays of a table."""


@inlined
def named_weights(w: Array) -> Weights:
    """The weights by name."""
    return Weights(
        w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], w[9],
        w[10], w[11], w[12], w[13], w[14], w[15], w[16], w[17], w[18], w[19],
    )  # fmt: skip
