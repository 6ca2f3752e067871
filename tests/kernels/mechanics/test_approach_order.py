"""In which order links may touch an object, by the distance of their balls from it along the way."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.geometry.bodies import Elements, no_body, pack_bodies, with_grid
from clench.kernels.mechanics import approach_order
from clench.kernels.mechanics.approach_order import COLUMNS, RADIUS, UNTIL
from clench.kernels.toi.toi_work import PAIRS
from engine.surfaces import brute_distance
from kernels.kernel_entries import entry
from kernels.kernel_solids import torus

way_to_ball, next_link = entry(approach_order.way_to_ball), entry(approach_order.next_link)
number = st.floats(-1.0, 1.0)


@settings(deadline=None, max_examples=200)
@given(st.tuples(number, number, number), st.tuples(number, number, number), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_two_balls_touch_after_the_way_that_a_quadratic_equation_tells(one, other, r, R):
    along = np.array([0.6, 0.0, 0.8])
    found = way_to_ball(np.array([*one, r]), np.array([*other, R]), along)

    def gap(way):
        return np.linalg.norm(np.array(one) + way * along - other) - r - R

    if gap(0.0) <= 0.0:
        assert found == 0.0
        return
    nearest = float((np.array(other) - one) @ along)
    if found == math.inf:
        assert nearest <= 0.0 or gap(nearest) >= -1e-9
    else:
        assert 0.0 <= found <= nearest + 1e-9
        assert gap(found) == pytest.approx(0.0, abs=1e-7)
        assert gap(0.999 * found) >= 0.0


def follow(body, balls, along, best):
    """Return links in the order in which they are told, and a travel before which each does not touch."""
    told, stack = [], np.empty((PAIRS, 3), dtype=np.int32)
    while True:
        k, start = next_link(body, along, best, balls, stack)
        if k < 0:
            return told
        told.append((k, start))


@pytest.mark.parametrize("seed", range(6))
def test_no_ball_touches_before_it_is_told_to(seed):
    rng, ring = np.random.default_rng(seed), torus(0.05, 0.015)
    body = with_grid(
        pack_bodies([Elements(ring.vertices, ring.triangles.astype(np.int32), np.zeros(len(ring.triangles)))])
    )
    along, balls = np.array([0.0, 0.0, -1.0]), np.zeros((6, COLUMNS))
    balls[:, :2], balls[:, 2] = rng.uniform(-0.06, 0.06, (6, 2)), rng.uniform(0.1, 0.3, 6)
    balls[:, RADIUS] = rng.uniform(0.002, 0.02, 6)
    placed = balls.copy()
    told = follow(body, balls, along, 0.5)
    assert len({k for k, _ in told}) == len(told)
    starts = [start for _, start in told]
    assert starts == sorted(starts)
    first = {}
    for k in range(6):
        for way in np.linspace(0.0, 0.5, 400):
            at = placed[k, :3] + way * along
            if brute_distance(ring.vertices, ring.triangles, at) <= placed[k, RADIUS]:
                first[k] = way
                break
    assert set(first) <= {k for k, _ in told}
    for k, start in told:
        assert start <= first.get(k, math.inf)
    # Most are told not long before they touch.
    assert sum(first[k] - start < 0.02 for k, start in told if k in first) >= len(first) // 2


def test_without_a_grid_links_come_in_the_order_of_their_bounds_and_not_after_the_limit():
    balls = np.zeros((3, COLUMNS))
    balls[:, UNTIL] = 0.3, 0.1, 0.2
    assert follow(no_body(), balls, np.array([1.0, 0.0, 0.0]), 0.25) == [(1, 0.1), (2, 0.2)]
    assert follow(no_body(), np.zeros((0, COLUMNS)), np.array([1.0, 0.0, 0.0]), 1.0) == []
