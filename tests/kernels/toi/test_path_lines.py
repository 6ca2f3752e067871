"""The lines of a path: way-points on a line are none of its ends, and a pair sees only the joints that move it."""

import numpy as np
import pytest

from clench.kernels.toi import path_lines
from clench.kernels.toi.path_lines import ALL, PAIR, PathLines
from kernels.kernel_entries import entry

find_corners, place_on_path = entry(path_lines.find_corners), entry(path_lines.place_on_path)
#: Joint 0 goes straight in uneven steps, joint 1 there and back, joint 2 rests.
PATH = np.array([[0.0, 0.0, 1.0], [0.1, 1.0, 1.0], [0.4, 0.0, 1.0], [0.8, 0.0, 1.0], [1.0, 0.0, 1.0]])


def corners(path, joints):
    kept, joints = np.full(len(path), -1), np.array(joints, dtype=np.int64)
    count = find_corners(path, np.arange(len(path)), len(path), joints, len(joints), kept)
    return kept[: count + 1].tolist()


@pytest.mark.parametrize(
    ("joints", "expected"), [([0], [0, 4]), ([1], [0, 1, 4]), ([0, 1], [0, 1, 2, 4]), ([2], [0, 4]), ([], [0, 4])]
)
def test_a_pair_sees_the_corners_of_its_joints(joints, expected):
    assert corners(PATH, joints) == expected


def test_a_line_that_a_pair_goes_and_rests_after_is_one_line():
    """Where the pair is on it is all that counts."""
    assert corners(np.array([[0.0], [1.0], [1.0], [1.0]]), [0]) == [0, 3]


def test_a_way_back_is_a_corner():
    assert corners(np.array([[0.0], [1.0], [0.5], [0.25]]), [0]) == [0, 1, 3]


def test_one_way_point_is_no_line():
    assert corners(PATH[:1], [0, 1, 2]) == [0]


@pytest.mark.parametrize(
    ("share", "expected"), [(0.0, 0.0), (0.05, 0.5), (0.25, 1.5), (0.4, 2.0), (0.9, 3.5), (1.0, 4.0)]
)
def test_a_share_of_a_line_is_a_place_among_its_way_points(share, expected):
    kept = np.zeros((2, len(PATH)), dtype=np.int64)
    kept[PAIR, :2] = 0, 4
    last = np.zeros(2, dtype=np.int64)
    last[ALL], last[PAIR] = 3, 1
    lines = PathLines(kept, last, PATH.copy(), np.zeros((5, 1, 3, 4)), np.zeros((2, 3, 4)))
    assert place_on_path(PATH, 0, share, np.array([0]), 1, lines) == pytest.approx(expected, abs=1e-12)
