"""Which surfaces are told to be convex: those of solids, however they are oriented."""

import numpy as np
import pytest

from clench.kernels.geometry.convexity import is_convex
from kernels.hulls.test_hull_meeting import SOLIDS, solid


@pytest.mark.parametrize("kind", SOLIDS)
def test_solids_are_convex(kind):
    for seed in range(5):
        elements = solid(np.random.default_rng(seed), kind)
        assert is_convex(elements.vertices, elements.elements)
        assert is_convex(elements.vertices, elements.elements[:, ::-1])


def test_what_is_open_or_dented_or_in_two_pieces_is_not_convex():
    rng = np.random.default_rng(0)
    ball = solid(rng, "ball")
    assert not is_convex(ball.vertices, ball.elements[1:])
    dented = ball.vertices.copy()
    dented[7] *= 0.8
    assert not is_convex(dented, ball.elements)
    assert not is_convex(ball.vertices, np.vstack([ball.elements, ball.elements[:1]]))
    flipped = ball.elements.copy()
    flipped[0] = flipped[0, ::-1]
    assert not is_convex(ball.vertices, flipped)
    two = np.arange(6, dtype=np.int32).reshape(2, 3)
    assert not is_convex(rng.normal(size=(6, 3)), two)


def test_pieces_that_are_convex_each_are_not_convex_together():
    one = solid(np.random.default_rng(1), "box")
    size = np.ptp(one.vertices, axis=0)

    def twice(shift):
        points = np.vstack([one.vertices, one.vertices + shift])
        return is_convex(points, np.vstack([one.elements, one.elements + len(one.vertices)]))

    assert not twice([3.0 * size[0], 0.0, 0.0])
    assert not twice([size[0], 0.5 * size[1], 0.0])
    assert not twice([0.0, 0.0, 0.0])
    assert not twice([size[0], 0.0, 0.0])


def test_a_flat_plate_is_not_convex():
    corners = np.array(
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]]
    )
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], dtype=np.int32)
    assert not is_convex(corners, np.vstack([faces, faces[:, ::-1]]))
