"""Boxes of any direction and capsules around the nodes of a tree hold what lies below them, and are thin."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.toi import toi_work as sweeping
from clench.kernels.trees import obb as slabs
from kernels.kernel_entries import entry
from kernels.toi.test_toi_bodies import KINDS, patch, pose

slab_top, slab_misses = entry(slabs.slab_top), entry(slabs.slab_misses)
put_slab_core = entry(slabs.put_slab_core)

is_wider, is_looser = entry(sweeping.is_wider), entry(sweeping.is_looser)

STRIP = np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)
IDENTITY = np.eye(4)[:3]


def below(body, node):
    """Return the elements of a node."""
    if body.right[node] < 0:
        return list(range(body.first[node], body.first[node] + body.count[node]))
    return below(body, node + 1) + below(body, body.right[node])


def capsule(slab, T=IDENTITY):
    """Return the middle of a box's capsule, half of its axis, and its radius."""
    core = np.zeros((3, 3))
    corners, reach = put_slab_core(slab, T, core)
    ends = core[[0, corners - 1]]
    return ends.mean(axis=0), 0.5 * (ends[1] - ends[0]), reach


def to_segment(points, middle, half):
    square = half @ half
    t = np.clip((points - middle) @ half / square, -1.0, 1.0) if square > 0.0 else np.zeros(len(points))
    return np.linalg.norm(points - middle - t[:, None] * half, axis=1)


@settings(deadline=None, max_examples=80)
@given(st.integers(0, 10**6), st.sampled_from(KINDS), st.integers(1, 40), st.sampled_from([1e-9, 1e-3, 1.0, 1e6]))
def test_boxes_and_capsules_hold_all_elements(seed, kind, count, scale):
    rng = np.random.default_rng(seed)
    part = patch(rng, kind, count)
    shift = rng.normal(size=3)
    body = pack_bodies([Elements(scale * (part.vertices + shift), part.elements, scale * part.radius)])
    directions = rng.normal(size=(30, 3))
    for node in range(len(body.first)):
        members = below(body, node)
        points = body.vertices[body.elements[members]].reshape(-1, 3)
        radius = np.repeat(body.radius[members], 3)
        for n in directions / np.linalg.norm(directions, axis=1)[:, None]:
            assert (points @ n + radius).max() <= slab_top(body.slab[node], *n)
        middle, half, reach = capsule(body.slab[node])
        assert (to_segment(points, middle, half) + radius <= reach).all()


def test_of_two_boxes_the_one_that_tells_less_is_looser():
    """A strip of a wall is wider than a finger tip's pad, and yet known better where the two meet."""
    strip = Elements(np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.01, 0], [0.1, 0.01, 1e-5]]), STRIP, np.zeros(2))
    pad = Elements(np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0.01, 0.01, 0.004]]), STRIP, np.zeros(2))
    wall, tip = pack_bodies([strip]), pack_bodies([pad])
    assert is_wider(wall, 0, tip, 0)
    assert not is_looser(wall, 0, tip, 0)
    assert is_looser(tip, 0, wall, 0)
    # Elements have no parts.
    for choose in (is_wider, is_looser):
        assert choose(wall, 0, tip, -1)
        assert not choose(wall, -1, tip, 0)


def test_they_are_thin_where_the_surface_is():
    rng = np.random.default_rng(0)
    slivers, sheet = (pack_bodies([patch(rng, kind, 400)]) for kind in ("slivers", "sheet"))
    leaves = np.flatnonzero(slivers.count)
    long, wide, high = (np.linalg.norm(slivers.slab[leaves, k : k + 3], axis=1) for k in (3, 6, 9))
    assert (high < 1e-5).all()
    assert (wide < 1e-3).all()
    assert (long > 0.02).all()
    assert all(capsule(slivers.slab[n])[2] < 0.02 * slivers.node[n, 3] for n in leaves)
    leaves = np.flatnonzero(sheet.count)
    assert (np.linalg.norm(sheet.slab[leaves, 9:12], axis=1) < 0.1 * sheet.node[leaves, 3]).all()
    # No capsule is much thinner than the ball around what is as wide and as high as long.
    cube = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    body = pack_bodies([Elements(cube, np.array([[k, 7 - k, 7 - k] for k in range(4)]), np.zeros(4))])
    T = pose(np.random.default_rng(1), [0.1, 0.2, 0.3])
    np.testing.assert_allclose(capsule(body.slab[0], T)[0], [0.1, 0.2, 0.3], atol=1e-7)
    assert not capsule(body.slab[0])[1].any()


@pytest.mark.parametrize("size", [1e30, 1e-320, 0.0])
def test_sizes_that_squares_do_not_hold_are_held(size):
    points = size * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with np.errstate(all="ignore"):
        body = pack_bodies([Elements(points, np.array([[0, 1, 2]]), np.zeros(1))])
    for n in np.eye(3):
        assert (points @ n).max() <= slab_top(body.slab[0], *n)


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 10**6), st.sampled_from(KINDS), st.integers(1, 3), st.floats(0.0, 0.05))
def test_what_is_said_to_miss_a_box_is_farther_away(seed, kind, corners, w):
    rng = np.random.default_rng(seed)
    body, T = pack_bodies([patch(rng, kind, 20)]), pose(rng, rng.normal(size=3) * 0.05)
    core = rng.normal(size=(3, 3)) * 0.05
    for node in range(len(body.first)):
        inside = body.vertices[body.elements[below(body, node)]].reshape(-1, 3) @ T[:, :3].T + T[:, 3]
        weights = rng.dirichlet(np.ones(corners), 40)
        apart = np.linalg.norm((weights @ core[:corners])[:, None] - inside[None], axis=2).min()
        if slab_misses(body.slab[node], T, core, corners, w):
            assert apart > w
    # Well away along a face's normal it always is said to.
    box = body.slab[0].astype(float)
    n = T[:, :3] @ (box[3:6] / np.linalg.norm(box[3:6]))
    far = T[:, :3] @ box[:3] + T[:, 3] + (np.linalg.norm(box[3:6]) + w + 0.02) * n
    assert slab_misses(body.slab[0], T, np.tile(far, (3, 1)), 1, w)


@pytest.mark.parametrize("size", [1e-5, 1e-4, 1e-3, 0.01])
@pytest.mark.parametrize("grown", [0.0, 0.005])
def test_what_lies_just_inside_a_box_is_not_said_to_miss_it(size, grown):
    """Beyond each face in turn, by less than the box is grown by: single precision could not tell."""
    rng = np.random.default_rng(2)
    for _ in range(60):
        rod = rng.normal(size=(3, 3)) * size + rng.uniform(-0.1, 0.1, 3)
        body, T = pack_bodies([Elements(rod, np.array([[0, 1, 2]]), np.array([grown]))]), pose(rng, np.zeros(3))
        box = body.slab[0].astype(float)
        for k in (3, 6):
            n = box[k : k + 3] / np.linalg.norm(box[k : k + 3])
            inside = box[:3] + box[k : k + 3] + (grown - 1e-13) * n
            assert not slab_misses(body.slab[0], T, np.tile(T[:, :3] @ inside, (3, 1)), 1, 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_boxes_lie_along_the_principal_axes(kind):
    """No box of a node is thicker than the one along the eigenvectors that LAPACK finds, single precision aside."""
    body = pack_bodies([patch(np.random.default_rng(5), kind, 60)])
    for node in range(len(body.first)):
        points = body.vertices[body.elements[below(body, node)]].reshape(-1, 3)
        values, axes = np.linalg.eigh(np.cov(points.T, bias=True))
        if np.diff(values).min() < 1e-3 * values[-1]:
            continue  # any directions will do
        sizes = np.sort(0.5 * np.ptp(points @ axes, axis=0))[::-1]
        edges = body.slab[node, 3:12].reshape(3, 3).astype(float)
        np.testing.assert_allclose(np.linalg.norm(edges, axis=1), sizes, rtol=1e-5, atol=1e-7)
