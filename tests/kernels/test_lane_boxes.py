"""Boxes apart along the axis that joints turn about, against their corners."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels import stage_sweep
from kernels.kernel_entries import entry

lanes_apart = entry(stage_sweep.lanes_apart)

number = st.floats(-1.0, 1.0)
box = st.tuples(number, number, number, *[st.floats(0.0, 0.5)] * 3)
pose = st.tuples(st.tuples(number, number, number), st.tuples(number, number, number))


def placed(turn, place):
    return np.column_stack([Rotation.from_rotvec(turn).as_matrix(), place])


def lane(box, T):
    """Return the extent of a box along y."""
    corners = np.array([np.add(box[:3], np.multiply(box[3:], s)) for s in itertools.product((-1.0, 1.0), repeat=3)])
    y = corners @ T[1, :3] + T[1, 3]
    return y.min(), y.max()


@settings(deadline=None, max_examples=300)
@given(box, pose, box, pose)
def test_boxes_are_apart_where_their_corners_are(one, there, other, elsewhere):
    T, R = placed(*there), placed(*elsewhere)
    (low, high), (least, most) = lane(one, T), lane(other, R)
    between = max(least - high, low - most)
    if abs(between) > 1e-12:
        assert lanes_apart(np.array(one), T, np.array(other), R) == (between > 0.0)
