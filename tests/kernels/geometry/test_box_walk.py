"""Boxes around nodes hold what lies below them, and what walks towards one stays clear of it as far as is said."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from clench.kernels.geometry import box_walk
from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.toi import core_motion
from clench.kernels.trees import obb as slabs
from clench.kernels.trees.node_boxes import SLAB
from kernels.kernel_entries import entry
from kernels.plain_sweeps import walk_rectangle, walk_to_box
from kernels.toi.test_toi_bodies import KINDS, drawn_chain, patch, pose
from kernels.trees.test_obb import below, to_segment

put_box, off_box = entry(box_walk.put_box), entry(box_walk.off_box)
put_rectangle = entry(box_walk.put_rectangle)
move_core, put_slab_face = entry(core_motion.move_core), entry(slabs.put_slab_face)

SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def boxed(slab, T):
    box = np.empty((5, 3))
    return box, put_box(slab, T, box)


def drawn_box(rng, flat=False):
    """Return a box of any direction, whose sizes are very different."""
    axes = pose(rng, np.zeros(3))[:, :3]
    half = 10.0 ** rng.uniform(-4.0, 0.0, 3) * (rng.uniform(size=3) > 0.3 if flat else 1.0)
    return np.vstack([0.3 * rng.normal(size=3), axes, half])


def off_face(points, slab, T):
    """Return the core of a box, as a moving node has it, how far points are from it, and what it is grown by."""
    core, box = np.empty((4, 3)), np.empty((5, 3))
    corners, grown = put_slab_face(slab, T, core)
    if corners == 4:
        put_rectangle(core, box)
        return corners, to_box(points, box), grown
    ends = core[[0, corners - 1]]
    return corners, to_segment(points, ends.mean(axis=0), 0.5 * (ends[1] - ends[0])), grown


def corners_of(box):
    return box[0] + SIGNS * box[4] @ box[1:4]


def to_box(points, box):
    local = (points - box[0]) @ box[1:4].T
    return np.linalg.norm(local - np.clip(local, -box[4], box[4]), axis=-1)


def drawn_core(rng, corners, size, away):
    """Return a core, four corners being those of a rectangle, which may be a line or a point."""
    if corners < 4:
        return size * rng.normal(size=(4, 3)) + away * rng.normal(size=3)
    u, v = size * rng.uniform(size=(2, 1)) * (rng.uniform(size=(2, 1)) > 0.2) * pose(rng, np.zeros(3))[:2, :3]
    return away * rng.normal(size=3) + np.array([-u - v, u - v, u + v, v - u])


def spread_over(core, corners, count=60):
    """Return points all over a core."""
    if corners < 3:
        t = np.linspace(0.0, 1.0, count + 1)[:, None]
        return (1.0 - t) * core[0] + t * core[corners - 1]
    a, b = (v.ravel() / count for v in np.meshgrid(*[np.arange(count + 1)] * 2))
    kept = (a + b <= 1.0 + 1e-12) | (corners == 4)
    return core[0] + a[kept, None] * (core[1] - core[0]) + b[kept, None] * (core[corners - 1] - core[0])


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.sampled_from(KINDS), st.integers(1, 40), st.sampled_from([1e-9, 1e-3, 1.0, 1e6]))
def test_boxes_hold_all_elements_wherever_a_pose_puts_them(seed, kind, count, scale):
    rng = np.random.default_rng(seed)
    part = patch(rng, kind, count)
    body = pack_bodies([Elements(scale * (part.vertices + rng.normal(size=3)), part.elements, scale * part.radius)])
    T = pose(rng, scale * rng.normal(size=3))
    for node in range(len(body.first)):
        members = below(body, node)
        points = body.vertices[body.elements[members]].reshape(-1, 3)
        box, grown = boxed(body.slab[node], T)
        np.testing.assert_allclose(box[1:4] @ box[1:4].T, np.eye(3), atol=1e-14)
        placed, radius = points @ T[:, :3].T + T[:, 3], np.repeat(body.radius[members], 3)
        assert (to_box(placed, box) + radius <= grown + 1e-14 * scale).all()
        _, away, grown = off_face(placed, body.slab[node], T)
        assert (away + radius <= grown + 1e-14 * scale).all()


def test_of_flat_nodes_a_rectangle_moves():
    rng = np.random.default_rng(5)
    sheet = pack_bodies([patch(rng, "sheet", 400)])
    flat = [off_face(np.zeros((0, 3)), slab, pose(rng, np.zeros(3))) for slab in sheet.slab]
    assert np.mean([corners == 4 for corners, _, _ in flat]) > 0.9
    assert np.median([grown for _, _, grown in flat] / sheet.node[:, 3]) < 0.1
    # A cube is as thick as it is wide: a ball is as good.
    cube = np.concatenate([np.zeros(3), np.eye(3).ravel(), [0.0]]).astype(np.float32)
    assert off_face(np.zeros((0, 3)), cube, pose(rng, np.zeros(3)))[0] == 1


@pytest.mark.parametrize("half", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.2, 0.0), (1e-30, 1e-35, 0.0), (1e30, 1, 0)])
def test_boxes_without_height_have_axes_as_well(half):
    rng = np.random.default_rng(4)
    for _ in range(20):
        T = pose(rng, rng.normal(size=3))
        edges = np.array(half)[:, None] * pose(rng, np.zeros(3))[:, :3]
        slab = np.concatenate([rng.normal(size=3), edges.ravel(), [0.0]]).astype(np.float32)
        assert len(slab) == SLAB
        box, _ = boxed(slab, T)
        np.testing.assert_allclose(box[1:4] @ box[1:4].T, np.eye(3), atol=1e-14)
        turned = T[:, :3] @ slab[3:12].reshape(3, 3).astype(np.float64).T
        assert (np.abs(box[1:4] @ turned).sum(axis=1) <= box[4] + 1e-14 * half[0]).all()
        assert (box[4] <= 1.001 * np.array(half) + 1e-6 * half[0]).all()


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 10**6), st.integers(1, 4), st.booleans())
def test_a_gap_is_never_larger_than_the_distance(seed, corners, flat):
    rng = np.random.default_rng(seed)
    box, core = drawn_box(rng, flat), drawn_core(rng, corners, rng.uniform(0.01, 1.0), 0.5)
    gap, *n, top = off_box(core, corners, box, np.empty((4, 3)))
    assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
    assert top == pytest.approx((corners_of(box) @ n).max(), abs=1e-12)
    assert gap == pytest.approx((core[:corners] @ n).min() - top, abs=1e-12)
    apart = to_box(spread_over(core, corners), box).min()
    assert gap <= apart + 1e-12
    if corners == 1 and apart > 1e-9:
        assert gap == pytest.approx(apart, abs=1e-12)


@pytest.mark.parametrize(("corners", "count", "least"), [(2, 2000, 1e-3), (4, 100, 0.03)])
def test_a_gap_is_most_of_the_distance(corners, count, least):
    shares = []
    for seed in range(600):
        rng = np.random.default_rng(seed)
        box, core = drawn_box(rng), drawn_core(rng, corners, 0.3, 0.5)
        apart = to_box(spread_over(core, corners, count), box).min()
        if apart > least:
            shares.append(off_box(core, corners, box, np.empty((4, 3)))[0] / apart)
    assert len(shares) > 300
    assert np.quantile(shares, 0.25) > 0.99
    # Where edges cross, no direction that is looked at may part the two.
    assert np.mean(np.array(shares) > 0.5) > 0.95


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_a_walk_ends_before_the_box_is_met(seed, corners):
    rng = np.random.default_rng(seed)
    box, core = drawn_box(rng, flat=True), drawn_core(rng, corners, 0.2, 0.4)
    chain = drawn_chain(seed, rng)
    count, best, w, near = len(chain), rng.uniform(0.1, 2.0), rng.uniform(0.0, 0.05), rng.uniform(1e-4, 0.05)
    placed = np.empty((8, 3))

    def apart(s):
        move_core(core, corners, chain, count, s, placed)
        return to_box(spread_over(placed, corners, 12), box).min()

    begin = rng.uniform(0.0, best)
    if apart(begin) <= w + 0.1:
        return
    found = walk_to_box(core, corners, box, w, chain, count, near, begin, best, placed)
    assert found >= begin
    for s in np.linspace(begin, best if found == math.inf else found, 150):
        assert apart(s) > w


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 10**6), st.integers(1, 3))
@example(126, 1)
def test_a_rectangle_walks_until_it_is_near_what_rests(seed, corners):
    rng = np.random.default_rng(seed)
    core, fixed = drawn_core(rng, 4, 0.2, 0.4), drawn_core(rng, corners, 0.2, 0.4)[:3]
    chain = drawn_chain(seed, rng)
    count, best, w, near = len(chain), rng.uniform(0.1, 2.0), rng.uniform(0.0, 0.05), rng.uniform(1e-4, 0.05)
    placed, box, resting = np.empty((8, 3)), np.empty((5, 3)), spread_over(fixed, corners, 40)

    def apart(s):
        move_core(core, 4, chain, count, s, placed)
        put_rectangle(placed, box)
        return to_box(resting, box).min()

    begin = rng.uniform(0.0, best)
    if apart(begin) <= w + 0.1:
        return
    found = walk_rectangle(core, fixed, corners, np.empty((5, 3)), w, chain, count, near, begin, best, placed)
    assert begin <= found
    for s in np.linspace(begin, best if found == math.inf else found, 150):
        assert apart(s) > w


def test_a_box_around_a_segment_is_no_longer_and_no_wider():
    half, box = np.array([0.05, -0.08, 0.16]), np.empty((5, 3))
    for u, v in ((half, 0.0 * half), (0.0 * half, half)):
        put_rectangle(np.array([-u - v, u - v, u + v, v - u]), box)
        np.testing.assert_allclose(sorted(box[4]), [0.0, 0.0, np.linalg.norm(half)], atol=1e-15)


@pytest.mark.parametrize("sizes", [(0.3, 0.2), (0.3, 0.0), (0.0, 0.0), (1e-20, 1e-200), (1e100, 1.0)])
def test_a_rectangle_is_a_box_without_height(sizes):
    rng = np.random.default_rng(7)
    for _ in range(20):
        axes, middle = pose(rng, np.zeros(3))[:, :3], sizes[0] * rng.normal(size=3)
        u, v = sizes[0] * axes[0], sizes[1] * axes[1]
        corners, box = middle + np.array([-u - v, u - v, u + v, v - u]), np.full((5, 3), np.nan)
        put_rectangle(corners, box)
        np.testing.assert_allclose(box[1:4] @ box[1:4].T, np.eye(3), atol=1e-14)
        assert (to_box(corners, box) <= 1e-14 * sizes[0]).all()
        assert box[4, 2] == 0.0
