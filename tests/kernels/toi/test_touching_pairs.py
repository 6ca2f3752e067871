"""Which elements touch, where and along which direction: round and flat things that lie flush on a box."""

import numpy as np
import pytest

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.toi.touching_pairs import PAIR_GAP, PAIR_NX, touching_pairs
from kernels.kernel_solids import box

WITHIN, TIE = 1e-5, 1e-9


def solid(mesh):
    return Elements(
        np.array(mesh.vertices, dtype=float), np.array(mesh.triangles, np.int32), np.zeros(len(mesh.triangles))
    )


CAPSULE = Elements(np.array([[-0.02, 0.0, 0.0], [0.02, 0.0, 0.0]]), np.array([[0, 1, 1]], np.int32), np.array([0.005]))
BALL = Elements(np.zeros((1, 3)), np.zeros((1, 3), np.int32), np.array([0.005]))
PLATE = solid(box(0.04, 0.02, 0.01))
TABLE = pack_bodies([solid(box(0.2, 0.2, 0.02))])


def at(*positions):
    poses = np.zeros((1, len(positions), 3, 4))
    poses[0, :, :, :3] = np.eye(3)
    poses[0, :, :, 3] = positions
    return poses


def touches(links, positions, moves, checked=None, room=200):
    """Return what every touch is of and with, and its numbers; the table's top is at 0.01."""
    count = len(links)
    checked = np.zeros((count, count), np.int64) if checked is None else np.array(checked)
    found, numbers = np.zeros((room, 3), np.int64), np.zeros((room, 7))
    still = np.ascontiguousarray(np.eye(4)[:3])
    wanted = np.array([moves], np.int64)
    rows = touching_pairs(
        pack_bodies(links), TABLE, checked, at(*positions), wanted, still, WITHIN, TIE, found, numbers
    )
    return found[:rows], numbers[:rows]


def places(numbers):
    return {tuple(np.round(row, 9)) for row in numbers[:, :3]}


@pytest.mark.parametrize("gap", [0.0, 3e-6, -3e-6])
def test_a_capsule_that_lies_on_a_table_touches_at_both_ends(gap):
    found, numbers = touches([CAPSULE], [(0.01, 0.02, 0.015 + gap)], [1])
    assert {(-0.01, 0.02, 0.01), (0.03, 0.02, 0.01)} <= places(numbers)
    assert (found == [0, 0, 1]).all()
    np.testing.assert_allclose(numbers[:, PAIR_NX:PAIR_GAP], [[0.0, 0.0, 1.0]] * len(numbers), atol=1e-12)
    np.testing.assert_allclose(numbers[:, PAIR_GAP], gap, atol=1e-15)
    assert (np.abs(numbers[:, 0] - 0.01) <= 0.02 + 1e-12).all()


def test_a_plate_touches_at_its_four_lower_corners():
    gap = 2e-6
    found, numbers = touches([PLATE], [(0.03, -0.02, 0.015 + gap)], [1])
    lower = {(x, y, 0.01) for x in (0.01, 0.05) for y in (-0.03, -0.01)}
    assert lower <= places(numbers)
    down = np.abs(numbers[:, PAIR_NX + 2] - 1.0) < 1e-9
    np.testing.assert_allclose(numbers[down][:, PAIR_GAP], gap, atol=1e-12)
    # No row is there twice.
    assert len(np.unique(np.round(numbers[:, :6], 8), axis=0)) == len(numbers)
    assert len(found) == len(numbers)


def test_a_ball_touches_in_one_point_and_what_is_far_or_deep_not_at_all():
    _, numbers = touches([BALL], [(0.013, 0.021, 0.015)], [1])
    assert places(numbers) == {(0.013, 0.021, 0.01)}
    for height in (0.015 + 2.0 * WITHIN, 0.015 - 2.0 * WITHIN, 0.5):
        assert len(touches([BALL], [(0.013, 0.021, height)], [1])[0]) == 0


def test_links_are_looked_at_once_and_only_those_that_move_and_are_checked():
    """Three balls in a row, each touching the next."""
    row = [(0.01 * k, 0.0, 0.2) for k in range(3)]
    all_pairs = np.ones((3, 3), np.int64) - np.eye(3, dtype=np.int64)

    def pairs(moves, checked=all_pairs):
        return [tuple(p[1:]) for p in touches([BALL] * 3, row, moves, checked)[0]]

    assert sorted(pairs([1, 1, 1])) == [(1, 0), (2, 1)]
    assert sorted(pairs([1, 0, 0])) == [(0, 1)]
    assert sorted(pairs([0, 1, 0])) == [(1, 0), (1, 2)]
    assert pairs([0, 0, 0]) == []
    assert pairs([1, 1, 1], np.zeros((3, 3), np.int64)) == []
    found, numbers = touches([BALL] * 3, row, [0, 1, 0], all_pairs)
    np.testing.assert_allclose(np.sort(numbers[:, 0]), [0.005, 0.015], atol=1e-15)
    # The direction is from what is met to what moves.
    np.testing.assert_allclose(numbers[found[:, 2] == 0][:, PAIR_NX], 1.0)
    np.testing.assert_allclose(numbers[found[:, 2] == 2][:, PAIR_NX], -1.0)


def test_there_is_room_for_so_many_only():
    found, _ = touches([PLATE], [(0.03, -0.02, 0.015)], [1], room=5)
    assert len(found) == 3
