"""Boxes apart along the axis that joints turn about, against their corners."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.toi import separating_planes as parting
from clench.kernels.toi import toi_links as stage_sweep
from kernels.kernel_entries import entry

lane_of, lanes_apart = entry(stage_sweep.lane_of), entry(parting.lanes_apart)

number = st.floats(-1.0, 1.0)
box = st.tuples(number, number, number, *[st.floats(0.0, 0.5)] * 3)
pose = st.tuples(st.tuples(number, number, number), st.tuples(number, number, number))


def placed(turn, place):
    return np.column_stack([Rotation.from_rotvec(turn).as_matrix(), place])


def lane(box, T, axis_group):
    """Return the extent of a box along an axis group's y axis."""
    corners = np.array([np.add(box[:3], np.multiply(box[3:], s)) for s in itertools.product((-1.0, 1.0), repeat=3)])
    y = (corners @ T[:, :3].T + T[:, 3]) @ axis_group[:, 1]
    return y.min(), y.max()


@settings(deadline=None, max_examples=300)
@given(box, pose, box, pose, pose)
def test_boxes_are_apart_where_their_corners_are(one, there, other, elsewhere, axis_group):
    T, R, F = placed(*there), placed(*elsewhere), placed(*axis_group)
    lanes = [lane_of(np.array(size), at, *F[:, 1]) for size, at in ((one, T), (other, R))]
    np.testing.assert_allclose(lanes, [lane(one, T, F), lane(other, R, F)], atol=1e-14)
    (low, high), (least, most) = lanes
    assert lanes_apart(*lanes) == lanes_apart(*lanes[::-1]) == (max(least - high, low - most) > 0.0)
