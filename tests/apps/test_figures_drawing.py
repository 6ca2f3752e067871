"""Loops and pixels: the small pieces that pictures are made of."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.apps.figures import raster
from clench.apps.figures.loops import join_segments, outline_loops
from clench.apps.figures.raster import Camera, borders, halved, look_along, rasterise, shade
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


def camera(width: int = 40, height: int = 30, scale: float = 10.0) -> Camera:
    return Camera(*look_along(np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])), np.zeros(3), scale, width, height)


def rectangle(x0: float, y0: float, x1: float, y1: float, z: float) -> np.ndarray:
    a, b, c, d = ([x, y, z] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
    return np.array([[a, b, c], [a, c, d]], dtype=np.float64)


def test_a_rectangle_covers_its_pixels_without_gap_along_the_diagonal() -> None:
    picture = rasterise(rectangle(-1.0, -0.5, 1.0, 0.5, 0.0), camera())
    seen = picture.triangle >= 0
    assert seen[10:20, 10:30].all()
    assert seen.sum() == 200
    assert np.isneginf(picture.nearness[~seen]).all()


def test_the_nearer_surface_is_seen_and_crossing_ones_share_the_picture() -> None:
    back, front = rectangle(-1, -1, 1, 1, 0.0), rectangle(-0.5, -0.5, 0.5, 0.5, 0.3)
    for corners, near in ((np.vstack([back, front]), (2, 3)), (np.vstack([front, back]), (0, 1))):
        picture = rasterise(corners, camera())
        assert np.isin(picture.triangle[12:18, 17:23], near).all()
        assert picture.nearness[15, 20] == pytest.approx(0.3, abs=1e-6)
        assert picture.nearness[6, 11] == pytest.approx(0.0, abs=1e-6)
    tilted = rectangle(-1, -1, 1, 1, 0.0)
    tilted[..., 2] = tilted[..., 0]
    picture = rasterise(np.vstack([back, tilted]), camera())
    assert (picture.triangle[5:25, 10:19] < 2).all()
    assert (picture.triangle[5:25, 21:30] >= 2).all()


def test_degenerate_and_distant_triangles_do_no_harm() -> None:
    on_edge = np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    point = np.zeros((1, 3, 3))
    away = rectangle(50.0, 50.0, 51.0, 51.0, 0.0)
    huge = rectangle(-1e3, -1e3, 1e3, 1e3, -1.0)
    picture = rasterise(np.vstack([on_edge, point, away, huge]), camera())
    assert (picture.triangle >= 4).mean() > 0.95
    assert (picture.triangle >= 0).all()
    assert (rasterise(np.empty((0, 3, 3)), camera()).triangle == -1).all()


def test_working_in_chunks_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1.5, 1.5, (60, 3, 3))
    whole = rasterise(corners, camera())
    monkeypatch.setattr(raster, "_CHUNK", 64)
    chunked = rasterise(corners, camera())
    np.testing.assert_array_equal(whole.triangle, chunked.triangle)
    np.testing.assert_array_equal(whole.nearness, chunked.nearness)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_pixels_show_the_nearest_plane_of_the_triangles_over_them(seed: int) -> None:
    corners = np.random.default_rng(seed).uniform(-1.2, 1.2, (5, 3, 3))
    view = camera(24, 20, 8.0)
    picture = rasterise(corners, view)
    p = view.project(corners)
    for row in range(view.height):
        for column in range(view.width):
            at = np.array([column + 0.5, row + 0.5])
            found = []
            for t in p:
                m = np.vstack([t[:, :2].T, np.ones(3)])
                weights = np.linalg.solve(m, [*at, 1.0])
                if abs(weights).min() < 1e-6:
                    break  # on an edge: either answer will do
                if (weights > 0.0).all():
                    found.append(float(weights @ t[:, 2]))
            else:
                seen = picture.nearness[row, column]
                assert seen == pytest.approx(max(found), abs=1e-5) if found else np.isneginf(seen)


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_views_are_right_handed(towards: tuple[float, float, float]) -> None:
    axes = np.array(look_along(np.array(towards), np.array([0.0, 0.0, 1.0])))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_straight_from_above_there_is_still_an_up() -> None:
    axes = np.array(look_along(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 1.0])))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


def test_light_borders_and_halving() -> None:
    corners = np.vstack([rectangle(-1, -1, 0, 1, 0.0), rectangle(0, -1, 1, 1, 0.0)])
    view = camera()
    picture = rasterise(corners, view)
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    colors = np.array([[0.8, 0.2, 0.2]] * 4)
    image = shade(picture, normals, colors, view)
    assert image.shape == (30, 40, 3)
    np.testing.assert_array_equal(image[0, 0], 1.0)
    np.testing.assert_array_equal(image, shade(picture, -normals, colors, view))
    edge = borders(picture, np.array([0, 0, 1, 1]), 0.01)
    assert edge[15, 19:21].all()
    assert not edge[15, 12:18].any()
    assert not borders(picture, np.zeros(4, dtype=np.int64), 0.01)[15, 12:28].any()
    half = halved(image)
    assert half.shape == (15, 20, 3)
    np.testing.assert_allclose(half[7, 6], image[14, 12], atol=1e-6)
