"""What a side of an outline makes of a corner that it touches at the start."""

import numpy as np
import pytest

from clench.kernels.closing.layout import KIND_SIDE, Outline, Work
from clench.kernels.sections import turning_pairs
from kernels.kernel_entries import entry

turn_sides = entry(turning_pairs.turn_sides)

TURN = 1.0
#: A side along x, from 0.01 to 0.05, that looks towards -z.
SIDE = np.array([[0.0, -1.0, 0.0, 0.01, 0.05]])


def met(side, x, z, both, radius=0.0):
    """Return the turn at which a side meets the end 1 of segment 3, the winner, and the pair that is put off."""
    pair = np.full(13, -1)
    pair[6] = 0
    outline = Outline(2, 0, 0, 0, 1, radius, both, 1)
    flat, line, whole = np.empty((0, 3)), np.empty(0), np.empty(0, np.int64)
    work = Work(flat, flat, line, flat, side, flat, flat, flat, line, line, line, whole, np.empty((0, 3, 4)), pair)
    found = turn_sides(outline, (3, 1, 0), (x, z), 0.0, 1e-11, TURN, work)
    return found, list(pair[:6]), list(pair[6:])


@pytest.mark.parametrize("x", [0.01, 0.03, 0.05])
def test_either_face_of_a_sharp_side_leaves_it_to_the_corners_whether_a_touch_at_the_start_blocks(x):
    """The side turns towards z: a sheet that looks the other way meets what is there with its inner face."""
    facing = -SIDE[:, [0, 1, 2, 4, 3]]
    nothing = [-1] * 6
    assert met(facing, x, 0.0, both=False) == (TURN, nothing, [1, KIND_SIDE, 2, 0, 3, 1, 0])
    assert met(SIDE, x, 0.0, both=False) == (TURN, nothing, [0, *nothing])
    assert met(SIDE, x, 0.0, both=True) == (TURN, nothing, [1, KIND_SIDE, 2, 0, 3, 3, 0])


@pytest.mark.parametrize("both", [False, True])
def test_a_round_side_that_touches_at_the_start_is_stopped_there(both):
    facing = -SIDE[:, [0, 1, 2, 4, 3]] if not both else SIDE
    found, winner, later = met(facing, 0.03, 0.002, both, radius=0.002)
    assert (found, winner, later[0]) == (0.0, [KIND_SIDE, 2, 0, 3, 3 if both else 1, 0], 0)


def test_the_inner_face_of_a_side_meets_what_is_ahead():
    angle = 0.4
    found, winner, later = met(SIDE, 0.03 * np.cos(angle), 0.03 * np.sin(angle), both=True)
    assert found == pytest.approx(angle, abs=1e-12)
    assert (winner, later[0]) == ([KIND_SIDE, 2, 0, 3, 3, 0], 0)
