"""How far a body is clear by its hulls: never farther than its elements are, and mostly almost as far."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.geometry.bodies import Elements, no_body, pack_bodies
from clench.kernels.hulls import hull_motion, hull_sweep, hull_window, near_elements
from clench.kernels.hulls.enclosing_hulls import pack_hulls
from clench.kernels.hulls.hull_window import BOX
from clench.kernels.toi import core_motion
from clench.kernels.toi import toi_work as sweeping
from kernels.kernel_entries import entry
from kernels.plain_sweeps import clear_travel, list_near, shorten, sweep_body, sweep_pair
from kernels.toi.test_toi_bodies import KINDS, TOUCH, cores, drawn_chain, patch, pose

make_sweep_work, list_touching = entry(sweeping.make_sweep_work), entry(near_elements.list_touching)
lowest_between, move_core = entry(hull_motion.lowest_between), entry(core_motion.move_core)
way_to_box, is_far = entry(hull_window.way_to_box), entry(hull_sweep.is_far)
motion_of_hull, put_pose = entry(hull_motion.motion_of_hull), entry(hull_motion.put_pose)
height, least_height = entry(hull_motion.height), entry(hull_window.least_height)


def two_parts(rng, kind):
    """Return elements of two parts, the second one beside the first."""
    parts = [patch(rng, kind, 9) for _ in range(2)]
    points = np.vstack([parts[0].vertices, parts[1].vertices + rng.normal(size=3) * 0.03])
    elements = np.vstack([parts[0].elements, parts[1].elements + len(parts[0].vertices)]).astype(np.int32)
    return Elements(points, elements, np.concatenate([p.radius for p in parts]), (0, len(parts[0].elements)))


def drawn(seed, kinds, hulls):
    """Return two bodies, the chain of the first one, its travel, and a workspace with their poses."""
    rng = np.random.default_rng(seed)
    moving, resting = pack_bodies([two_parts(rng, kinds[0])]), pack_bodies([two_parts(rng, kinds[1])])
    if not hulls:
        resting = resting._replace(hulls=pack_hulls([()]))
    chain, best, work = drawn_chain(seed, rng), float(rng.uniform(0.5, 2.0)), make_sweep_work(8, 0)
    away, beside = rng.normal(size=(2, 3))
    work.moving[:] = pose(rng, 0.15 * away / np.linalg.norm(away))
    on_the_way = np.zeros((6, 3))
    move_core(np.tile(work.moving[:, 3], (3, 1)), 1, chain, len(chain), 0.6 * best, on_the_way)
    work.resting[:] = pose(rng, on_the_way[0] + 0.05 * beside / np.linalg.norm(beside))
    return moving, resting, chain, best, work


def first_contact(moving, resting, chain, touch, best, work):
    """Return when the first of all pairs of elements meets, and the elements of the resting body that meet by then."""
    found, others = np.full(len(resting.elements), best), list(cores(resting, work.resting))
    for a, ka, wa in cores(moving, work.moving):
        for n, (b, kb, wb) in enumerate(others):
            at = sweep_pair(a, ka, b, kb, wa + wb, chain, len(chain), touch, 0.0, best, np.zeros((6, 3)))
            found[n] = min(found[n], at)
    return found


@pytest.mark.parametrize("hulls", [True, False])
@pytest.mark.parametrize("kinds", [(one, other) for one in KINDS for other in KINDS])
def test_a_body_is_clear_no_farther_than_its_elements(kinds, hulls):
    clear, met = 0, 0
    for seed in range(12):
        moving, resting, chain, best, work = drawn(seed, kinds, hulls)
        found = clear_travel(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        first = first_contact(moving, resting, chain, TOUCH, best, work).min()
        if found == math.inf:
            assert first == best
            clear += 1
        else:
            assert 0.0 <= found <= max(first, 0.0)
            met += found > 0.0
    assert clear + met >= 5


def test_convex_bodies_are_clear_almost_until_they_touch():
    corners = np.array(np.meshgrid(*[[-0.01, 0.01]] * 3)).reshape(3, -1).T
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]])
    box = Elements(
        corners, np.vstack([faces, [[0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5]]]).astype(np.int32), np.zeros(12)
    )
    moving, chain, reached = pack_bodies([box]), np.array([[1.0, 0.0, 0.0]]), 0
    for hulls in (True, False):
        resting = moving if hulls else moving._replace(hulls=pack_hulls([()]))
        for seed in range(40):
            rng, work = np.random.default_rng(seed), make_sweep_work(2, 0)
            work.moving[:], work.resting[:] = pose(rng, [0.1, 0.0, 0.0]), pose(rng, [0.0, 0.0, 0.1])
            work.resting[:, 3] += 0.005 * rng.normal(size=3)
            found = clear_travel(moving, 0, resting, 0, chain, 1, TOUCH, 3.0, work)
            first = first_contact(moving, resting, chain, TOUCH, 3.0, work).min()
            assert (found == math.inf) == (first == 3.0)
            if first < 3.0:
                assert first - 3e-3 <= found <= first
                reached += found > first - 1e-4
    assert reached >= 60


def test_bodies_without_elements_or_hulls():
    moving, resting, chain, best, work = drawn(0, ("soup", "soup"), True)
    bare = moving._replace(hulls=pack_hulls([()]))
    assert clear_travel(bare, 0, resting, 0, chain, len(chain), TOUCH, best, work) == 0.0
    assert clear_travel(moving, 0, no_body(), 0, chain, len(chain), TOUCH, best, work) == math.inf
    assert list_touching(bare, 0, resting, 0, TOUCH, work) == -1
    assert list_near(bare, 0, resting, 0, chain, len(chain), TOUCH, 0.05, work) == -1
    assert list_touching(no_body(), 0, resting, 0, TOUCH, work) == 0


def test_a_body_without_hulls_meets_what_it_meets_with_them():
    met = 0
    for seed in range(30):
        moving, resting, chain, best, work = drawn(seed, ("soup", "sheet"), bool(seed % 2))
        bare = moving._replace(hulls=pack_hulls([()]))
        found = sweep_body(bare, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        assert found == pytest.approx(sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work), abs=1e-6)
        met += found < best
    assert met >= 5


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_listed_holds_all_that_is_met(kind):
    short, listed, all_of_them, overlapping = 0.05, 0, 0, 0
    for seed in range(25):
        moving, resting, chain, _, work = drawn(seed, (kind, kind), bool(seed % 2))
        work.moving[:, 3] = work.resting[:, 3] + 0.03 * np.random.default_rng(seed).normal(size=3)
        count = list_near(moving, 0, resting, 0, chain, len(chain), TOUCH, short, work)
        met = np.flatnonzero(first_contact(moving, resting, chain, TOUCH, short, work) < short)
        if count >= 0:
            assert set(met) <= set(work.listed[:count])
            assert len(set(work.listed[:count])) == count
            listed += count
            all_of_them += len(resting.elements)
        count = list_touching(moving, 0, resting, 0, TOUCH, work)
        met = np.flatnonzero(first_contact(moving, resting, np.array([[1.0, 0.0, 0.0]]), TOUCH, 0.0, work) < 0.0)
        overlapping += len(met)
        assert count < 0 or set(met) <= set(work.listed[:count])
    assert 0 < listed < all_of_them
    assert overlapping > 0


@settings(deadline=None, max_examples=300)
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0, 3), st.floats(0, 1))
def test_no_path_between_two_heights_sags_lower_than_told(start, end, sag, share):
    """The lowest path has the largest acceleration all the way: a parabola below the chord."""
    at = np.linspace(0.0, 1.0, 2001)
    path = start + (end - start) * at - 4.0 * share * sag * at * (1.0 - at)
    low = lowest_between(start, end, sag)
    assert low <= path.min() + 1e-12
    if share == 1.0:
        assert low == pytest.approx(path.min(), abs=1e-5)


def test_way_to_a_box_leads_to_its_nearest_point():
    for seed in range(50):
        rng, window = np.random.default_rng(seed), np.zeros((56, 6))
        box = pose(rng, rng.normal(size=3))
        half, middle = rng.uniform(0.01, 1.0, 3), rng.normal(size=3) * 2.0
        window[BOX : BOX + 3, :4], window[BOX : BOX + 3, 4] = box, half
        inside = np.clip(box[:, :3].T @ (middle - box[:, 3]), -half, half)
        way = box[:, :3] @ inside + box[:, 3] - middle
        n = way_to_box(middle, window)
        assert np.linalg.norm(n) == pytest.approx(1.0)
        if np.linalg.norm(way) > 1e-9:
            np.testing.assert_allclose(n, way / np.linalg.norm(way), atol=1e-9)


def test_a_part_that_is_far_is_never_met():
    near = 0
    for seed in range(200):
        rng, window = np.random.default_rng(seed), np.zeros((56, 6))
        ours, theirs = pose(rng, 0.4 * rng.normal(size=3)), pose(rng, 0.4 * rng.normal(size=3))
        half, other, speed = rng.uniform(0.01, 0.5, 3), rng.uniform(0.01, 0.5, 3), rng.uniform(0.0, 1.0)
        window[BOX : BOX + 3, :4], window[BOX : BOX + 3, 4] = ours, half
        box = np.column_stack([theirs, other])
        motion = hull_motion.HullMotion(0, 0.01, speed, 0.0, 0.0, 0.0, 0.0)
        one = ours[:, :3] @ (half[:, None] * rng.uniform(-1, 1, (3, 200))) + ours[:, 3:]
        two = theirs[:, :3] @ (other[:, None] * rng.uniform(-1, 1, (3, 200))) + theirs[:, 3:]
        apart = np.linalg.norm(one[:, :, None] - two[:, None, :], axis=0).min() - 0.01 - 0.002
        if apart <= 0.5 * speed:
            assert not is_far(box, motion, 0.002, 0.5, window)
            near += 1
    assert 20 < near < 180


@pytest.mark.parametrize("gap", [3.0, 8.1, 8.2])
def test_a_window_never_ends_later_than_it_was_looked_at(gap):
    """Over more than a turn, the bound on the height falls below what no point can reach at its highest speed."""
    moving, chain = pack_bodies([two_parts(np.random.default_rng(0), "soup")]), np.array([[8.0, 0.0, 0.0]])
    work = make_sweep_work(2, 0)
    work.moving[:], work.resting[:] = np.eye(3, 4), np.eye(3, 4)
    motion = motion_of_hull(moving, 0, chain, 1, work)
    n, size = (0.0, 0.0, 1.0), motion.speed / 8.0
    for rows, s in (((0, 3), 0.0), ((3, 6), 1.0)):
        put_pose(chain, 1, s, work, work.hull[rows[0] : rows[1]])
    start = height(moving.hulls, motion, work.hull[:3], n)
    top = start - gap * size
    assert least_height(moving.hulls, motion, n, start, 1.0, work.hull) <= top
    found = shorten(moving, moving, chain, motion, n, start, top, 1.0, work)
    assert (found == 1.0) if gap > 8.0 else (gap / 8.0 <= found < 1.0)
