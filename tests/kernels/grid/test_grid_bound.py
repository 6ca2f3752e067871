"""The grid never tells more than the distance, and hardly less."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.geometry.bodies import Elements, no_body, pack_bodies, with_grid
from clench.kernels.grid import grid_bound
from clench.kernels.grid.distance_grid import CUBES, MARGIN, grid_around
from clench.kernels.toi.toi_work import PAIRS
from kernels.kernel_entries import entry
from kernels.toi.test_toi_bodies import KINDS, patch, pose

square_bound, is_box_off = entry(grid_bound.square_bound), entry(grid_bound.is_box_off)
STACK = np.zeros((PAIRS, 3), dtype=np.int64)
#: Corners of triangles that have no area, or almost none.
FLAT = ([0, 0, 0], [0, 1, 1], [0, 1, 0])


def dot(a, b):
    return (a * b).sum(axis=-1)


def to_segments(p, a, b):
    along = b - a
    length = dot(along, along)
    t = np.clip(np.divide(dot(p - a, along), length, out=np.zeros_like(length), where=length > 0.0), 0.0, 1.0)
    return np.linalg.norm(p - a - t[:, None] * along, axis=-1)


def to_triangles(p, a, b, c):
    """Return the distances of a point from triangles: from their edges, or from the planes of those it lies over."""
    n = np.cross(b - a, c - a)
    least = np.minimum.reduce([to_segments(p, a, b), to_segments(p, b, c), to_segments(p, c, a)])
    over = np.logical_and.reduce([dot(np.cross(y - x, p - x), n) >= 0.0 for x, y in ((a, b), (b, c), (c, a))])
    over &= dot(n, n) > 0.0
    least[over] = np.minimum(least, np.abs(dot(p - a, n)) / np.where(over, np.linalg.norm(n, axis=-1), 1.0))[over]
    return least


def distance(body, p):
    """Return the distance of a point from all elements of a body."""
    corners = body.vertices[body.elements]
    return max(float((to_triangles(p, *corners.transpose(1, 0, 2)) - body.radius).min()), 0.0)


def drawn_body(rng, kind, scale):
    given_elements = patch(rng, kind, int(rng.choice([1, 7, 60])))
    elements = given_elements.elements.copy()
    if rng.random() < 0.3 and len(elements) > 1:  # some without area
        elements[0] = elements[0][list(FLAT[rng.integers(3)])]
    if rng.random() < 0.5:  # and some that look the other way
        elements[::2] = elements[::2, ::-1]
    at = rng.normal(size=3) * rng.choice([0.0, 1.0, 10.0])
    points = (given_elements.vertices + at) * scale
    body = pack_bodies([Elements(points, elements, given_elements.radius * scale)])
    return body._replace(grid=grid_around(body.box[0]))


def drawn_points(rng, body):
    """Return points near and far, on the surface, and on the corners, edges and faces of cubes."""
    edge, first = body.grid.place[3], body.grid.place[:3]
    size = np.array(body.grid.square.shape)
    middle, half = body.box[0, :3], body.box[0, 3:]
    anywhere = middle + (half + 15 * edge) * rng.uniform(-1.0, 1.0, (6, 3))
    close = body.vertices[rng.integers(len(body.vertices), size=6)] + edge * rng.normal(size=(6, 3)) * rng.choice(
        [0.0, 1e-9, 0.1, 1.0], (6, 1)
    )
    cubes = rng.integers(0, size, (6, 3)) + rng.random((6, 3)) * (rng.random((6, 3)) < 0.4)
    return np.vstack([anywhere, close, first + edge * cubes, middle + 1e3 * half, body.vertices[:1]])


@settings(deadline=None, max_examples=120)
@given(st.integers(0, 2**32), st.sampled_from(KINDS), st.sampled_from([1e-6, 1.0, 1e5]))
def test_a_bound_is_never_above_the_distance(seed, kind, scale):
    rng = np.random.default_rng(seed)
    body = drawn_body(rng, kind, scale)
    assert max(body.grid.square.shape) <= CUBES + 2 * MARGIN + 1
    place, edge, shape = body.grid.place, body.grid.place[3], np.array(body.grid.square.shape)
    for p in drawn_points(rng, body):
        bound, square = square_bound(body, tuple(p), STACK), distance(body, p) ** 2
        assert bound <= square
        # The squared distance from a convex body bends by 0 to 2, so this is all that is lost.
        if len(body.elements) == 1 and (p >= place[:3]).all() and (p < place[:3] + edge * (shape - 1)).all():
            cube = grid_bound.LARGE if bound >= (grid_bound.FAR * grid_bound.LARGE * edge) ** 2 else 1
            assert bound >= square * (1.0 - 1e-6) - (cube * edge) ** 2 * (0.75 + 1e-6)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32), st.sampled_from(KINDS))
def test_no_point_of_a_box_that_is_off_lies_near_the_surface(seed, kind):
    rng = np.random.default_rng(seed)
    body = drawn_body(rng, kind, 1.0)
    edge, found = body.grid.place[3], 0
    for _ in range(30):
        middle, half = rng.normal(size=3) * 0.02, 0.03 * rng.random(3) ** 2 * rng.choice([0.0, 1.0, 1.0], 3)
        T = pose(rng, body.box[0, :3] + 40 * edge * rng.uniform(-1.0, 1.0, 3))
        if is_box_off(body, tuple(middle), tuple(half), T, STACK):
            found += 1
            for p in middle + half * rng.uniform(-1.0, 1.0, (8, 3)).round(1):
                assert distance(body, T[:, :3] @ p + T[:, 3]) >= grid_bound.AWAY * edge
    assert found > 0


def test_without_a_grid_nothing_is_known_to_be_off():
    T = np.column_stack([np.eye(3), np.full(3, 9.0)])
    assert not is_box_off(no_body(), (0.0, 0.0, 0.0), (0.1, 0.1, 0.1), T, STACK)


def test_a_grid_is_filled_with_the_same_bits_in_any_order():
    rng = np.random.default_rng(3)
    body = pack_bodies([patch(rng, "soup", 60)])
    one, other = with_grid(body), with_grid(body)
    points = np.vstack([drawn_points(rng, one) for _ in range(30)])
    bounds = [square_bound(one, tuple(p), STACK) for p in points]
    assert [square_bound(other, tuple(p), STACK) for p in points[::-1]] == bounds[::-1]
    assert [square_bound(one, tuple(p), STACK) for p in points] == bounds
    np.testing.assert_array_equal(one.grid.square, other.grid.square)
    assert (one.grid.square >= 0.0).any()


@pytest.mark.parametrize("box", [np.zeros(6), [0, 0, 0, -np.inf, -np.inf, -np.inf], [0, 0, 0, np.inf, 1, 1]])
def test_what_has_no_size_has_no_grid(box):
    assert grid_around(np.array(box, dtype=float)).square.size == 0


def test_a_flat_body_has_a_grid_and_none_at_all_has_not():
    grid = grid_around(np.array([1.0, 2.0, 3.0, 0.5, 0.25, 0.0]))
    assert grid.square.shape == (CUBES + 2 * MARGIN + 1, CUBES // 2 + 2 * MARGIN + 1, 2 * MARGIN + 1)
    np.testing.assert_allclose(grid.place + grid.place[3] * np.array([24, 16, 8, 0]), [1.0, 2.0, 3.0, 1 / 32])
    assert with_grid(no_body()).grid.square.size == 0
