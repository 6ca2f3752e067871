"""Curl planes lie where docs/method.md section 1 puts them, and a mirrored finger gets mirrored planes."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from clench.closing.curl_planes import axis_group_frame, plane_offsets, refined
from clench.core.tolerances import EDGE_INSET

extents = st.lists(
    st.tuples(st.floats(-1.0, 1.0), st.floats(0.01, 1.0)).map(lambda e: (e[0], e[0] + e[1])), min_size=1, max_size=6
)


def test_one_plane_is_in_the_middle():
    np.testing.assert_allclose(plane_offsets([(-0.01, 0.03), (0.0, 0.01)], 1), [0.01])


def test_two_planes_are_the_edges_inset():
    np.testing.assert_allclose(plane_offsets([(-0.01, 0.03)], 2), [-0.01 + 4e-6, 0.03 - 4e-6])


def test_from_three_on_edges_even_spacing_and_the_edges_of_narrower_links():
    offsets = plane_offsets([(-0.01, 0.01), (-0.0043, 0.0043)], 5)
    inset = EDGE_INSET * 0.0086
    expected = [*np.linspace(-0.01 + 2e-6, 0.01 - 2e-6, 5), -0.0043 + inset, 0.0043 - inset]
    np.testing.assert_allclose(offsets, sorted(expected), atol=1e-15)


@pytest.mark.parametrize("count", [3, 5, 50, 161, 1000])
def test_as_many_planes_as_asked_for_however_many(count):
    assert len(plane_offsets([(-0.01, 0.01)], count)) == count
    assert len(plane_offsets([(-0.01, 0.01), (-0.005, 0.0031)], count)) >= count


@given(extents, st.integers(1, 40))
def test_planes_ascend_inside_the_finger_and_reach_its_edges(spans, count):
    low, high = min(e[0] for e in spans), max(e[1] for e in spans)
    offsets = plane_offsets(spans, count)
    assert (np.diff(offsets) > 0).all()
    assert low < offsets[0]
    assert offsets[-1] < high
    if count > 1:
        inset = EDGE_INSET * (high - low)
        assert offsets[0] <= low + 1.001 * inset
        assert offsets[-1] >= high - 1.001 * inset


@given(extents, st.integers(1, 40))
def test_a_mirrored_finger_has_mirrored_planes(spans, count):
    offsets = plane_offsets(spans, count)
    image = plane_offsets([(-b, -a) for a, b in spans], count)
    assert len(image) == len(offsets)
    np.testing.assert_allclose(-image[::-1], offsets, atol=1e-12)


@given(extents, st.integers(3, 9), st.integers(0, 12))
def test_refining_keeps_the_planes_and_the_mirror_image(spans, count, more):
    offsets = plane_offsets(spans, count)
    fine = refined(offsets, len(offsets) + more)
    assert len(fine) == len(offsets) + more
    assert set(offsets) <= set(fine)
    assert fine[0] == offsets[0]
    assert fine[-1] == offsets[-1]
    np.testing.assert_allclose(-refined(-offsets[::-1], len(fine))[::-1], fine, atol=1e-12)


@example(axis=(0.75, 0.0, 1.192092896e-07), towards=(1.0, 0.0, 0.0))
@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1), st.tuples(*[st.floats(-1, 1)] * 3))
def test_the_frame_is_right_handed_with_y_against_the_axis(axis, towards):
    axis = np.array(axis) / np.linalg.norm(axis)
    origin = np.array([0.1, -0.2, 0.3])
    T = axis_group_frame(axis, origin, origin + towards)
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(T[:3, 1], -axis, atol=1e-15)
    np.testing.assert_array_equal(T[:3, 3], origin)
    # Turning about the axis takes x towards z.
    np.testing.assert_allclose(np.cross(axis, T[:3, 0]), T[:3, 2], atol=1e-12)
    across = towards - axis * (np.array(towards) @ axis)
    if np.linalg.norm(across) > 1e-6:
        assert across @ T[:3, 0] == pytest.approx(np.linalg.norm(across))
