"""Loops: the small pieces that planar pictures are made of."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.apps.figures.planes.loops import join_segments, outline_loops
from clench.closing.outlines import cut_shape
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind


def ring(points: np.ndarray, outward: float = 1.0) -> np.ndarray:
    """Return the segments of a counter-clockwise polygon, normals outwards (or inwards for -1)."""
    ends = np.roll(points, -1, axis=0)
    run = ends - points
    normals = outward * np.column_stack([run[:, 1], -run[:, 0]]) / np.linalg.norm(run, axis=1)[:, None]
    return np.column_stack([points, ends, normals])


def area(points: np.ndarray) -> float:
    after = np.roll(points, -1, axis=0)
    return 0.5 * float((points[:, 0] * after[:, 1] - points[:, 1] * after[:, 0]).sum())


SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 30), st.integers(0, 2**32 - 1))
def test_shuffled_and_reversed_segments_become_one_loop(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(count) * 2.0 * np.pi / count
    polygon = rng.uniform(0.5, 1.0, (count, 1)) * np.column_stack([np.cos(t), np.sin(t)])
    segments = ring(polygon)[rng.permutation(count)]
    swapped = rng.random(count) < 0.5
    segments[swapped] = segments[swapped][:, [2, 3, 0, 1, 4, 5]]
    (loop,) = join_segments(segments)
    assert loop.closed
    assert len(loop.points) == count
    assert area(loop.points) == pytest.approx(area(polygon))


def test_a_hole_runs_against_its_border() -> None:
    hole = 0.25 + 0.5 * SQUARE
    loops = join_segments(np.vstack([ring(SQUARE), ring(hole, -1.0)]))
    assert sorted(area(loop.points) for loop in loops) == pytest.approx([-0.25, 1.0])


def test_an_open_curve_stays_open_and_in_one_piece() -> None:
    for order in ([0, 1, 2], [1, 0, 2], [2, 1, 0]):
        (loop,) = join_segments(ring(SQUARE)[:3][order])
        assert not loop.closed
        np.testing.assert_array_equal(loop.points, SQUARE)


def test_nothing_and_points_give_no_loops() -> None:
    assert join_segments(np.empty((0, 6))) == []
    assert join_segments(np.array([[1.0, 2.0, 1.0, 2.0, 0.0, 1.0]])) == []


def test_two_squares_that_share_a_corner_are_covered_once_each() -> None:
    loops = join_segments(np.vstack([ring(SQUARE), ring(SQUARE + 1.0)]))
    assert sum(area(loop.points) for loop in loops) == pytest.approx(2.0)
    assert all(loop.closed for loop in loops)


def test_outlines_of_links_have_the_right_area() -> None:
    across = Pose(wxyz=[np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]).matrix  # the capsule's axis along x
    cases = [
        (Shape(ShapeKind.CAPSULE, (0.01, 0.03, 0.0)), 0.02 * 0.06 + np.pi * 1e-4),
        (Shape(ShapeKind.SPHERE, (0.01, 0.0, 0.0)), np.pi * 1e-4),
        (Shape(ShapeKind.BOX, (0.03, 0.02, 0.01)), 4 * 0.03 * 0.01),
        (Shape(ShapeKind.ELLIPSOID, (0.03, 0.02, 0.01)), np.pi * 3e-4),
    ]
    for shape, expected in cases:
        outline = cut_shape(shape, across, 0.0)
        assert outline is not None
        (loop,) = outline_loops(outline)
        assert loop.closed
        assert abs(area(loop.points)) == pytest.approx(expected, rel=0.01), shape.kind
