"""How far links are apart by their hulls: never farther than they are, and almost as far."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from clench.kernels.geometry.bodies import pack_bodies
from clench.kernels.hulls import near_hulls
from clench.kernels.hulls.enclosing_hulls import HullPart, pack_hulls
from clench.kernels.meetings import hull_planes
from clench.kernels.toi import toi_work
from kernels.hulls.test_gjk import distance
from kernels.hulls.test_hull_sweep import two_parts
from kernels.kernel_entries import entry
from kernels.toi.test_toi_bodies import KINDS, pose

make_sweep_work = entry(toi_work.make_sweep_work)
links_parting, plane_between = entry(near_hulls.links_parting), entry(hull_planes.plane_between)


def placed_parts(elements, T):
    """Return the points of both parts of a body where it is, and the largest radius of their elements."""
    first = elements.parts[1]
    for rows, radius in (
        (elements.elements[:first], elements.radius[:first]),
        (elements.elements[first:], elements.radius[first:]),
    ):
        yield elements.vertices[np.unique(rows[rows >= 0])] @ T[:, :3].T + T[:, 3], radius.max()


def drawn(seed, kinds):
    """Return two elements of two parts each, both packed, and a workspace with their poses."""
    rng, work = np.random.default_rng(seed), make_sweep_work(2, 0)
    two = [two_parts(rng, kind) for kind in kinds]
    work.moving[:], work.resting[:] = pose(rng, 0.08 * rng.normal(size=3)), pose(rng, np.zeros(3))
    return two, pack_bodies(two), work, rng


@settings(deadline=None, max_examples=120)
@given(seed=st.integers(0, 10**6), kinds=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)))
@example(seed=386914, kinds=("slivers", "slivers"))
def test_links_are_apart_by_their_hulls_almost_as_far_as_least_squares_tell(seed, kinds):
    two, links, work, rng = drawn(seed, kinds)
    n = rng.normal(size=3)
    found, side, others = links_parting(links, 0, 1, tuple(n / np.linalg.norm(n)), work)
    placed = [
        (a, wide, b, wider)
        for a, wide in placed_parts(two[0], work.moving)
        for b, wider in placed_parts(two[1], work.resting)
    ]
    gaps = [distance(a, b) - wide - wider for a, wide, b, wider in placed]
    assert np.linalg.norm(side) == pytest.approx(1.0)
    assert found <= max(min(gaps), 0.0) + 1e-6
    assert found <= others
    # The search ends once it knows that others are nearer than the overlap.
    assert others <= max(sorted(gaps)[1], 0.0, -found) + 1e-6
    # Two parts are apart along the vector by so much, or overlap by so much.
    along = [(a @ side).min() - (b @ side).max() - wide - wider for a, wide, b, wider in placed]
    assert min(abs(gap - found) for gap in along) <= 1e-9
    if min(gaps) > 1e-3:
        # Radii are taken off after the search, which ends at a tenth of the distance between the corners.
        widest = two[0].radius.max() + two[1].radius.max()
        assert found >= 0.85 * min(gaps) - 0.15 * widest - 1e-6


#: Elements of one radius: their hull is not larger than they are.
EVEN = [kind for kind in KINDS if kind != "round"]


@pytest.mark.parametrize("kinds", [(one, other) for one in EVEN for other in EVEN])
def test_a_plane_between_links_is_the_same_with_hulls_and_without(kinds):
    for seed in range(10):
        _, links, work, rng = drawn(seed, kinds)
        bare = links._replace(hulls=pack_hulls([(), ()]))
        for n in rng.normal(size=(6, 3)):
            n /= np.linalg.norm(n)
            assert plane_between(links, 0, 1, *n, work) == pytest.approx(plane_between(bare, 0, 1, *n, work), abs=1e-12)
            assert plane_between(links, 0, 1, *n, work) <= plane_between(bare, 0, 1, *n, work) + 1e-12


def test_links_without_hulls_are_not_told_to_be_apart():
    _, links, work, _ = drawn(0, ("soup", "soup"))
    for hulls in ([(), ()], [(), [HullPart(np.eye(3), 0.0)]]):
        bare = links._replace(hulls=pack_hulls(hulls))
        assert links_parting(bare, 0, 1, (1.0, 0.0, 0.0), work)[0] == -math.inf
