"""A capsule or a sphere meets what the first of all elements tells, with a grid as without."""

import numpy as np
import pytest

from clench.kernels.geometry.bodies import FEW, Elements, pack_bodies, with_grid
from clench.kernels.grid.distance_grid import grid_around
from clench.kernels.toi import core_motion, toi_work
from clench.kernels.toi.separating import OVERLAP
from kernels.kernel_entries import entry
from kernels.plain_sweeps import sweep_body, sweep_pair
from kernels.toi.test_toi_bodies import KINDS, TOUCH, cores, drawn_chain, patch, pose

make_sweep_work, move_core = entry(toi_work.make_sweep_work), entry(core_motion.move_core)


def rod(rng, corners):
    """Return a capsule of any length and radius, or a sphere."""
    ends = np.vstack([np.zeros(3), rng.normal(size=3) * 0.03])[:corners]
    element = np.array([[0, 1, 1] if corners == 2 else [0, 0, 0]], dtype=np.int32)
    return pack_bodies([Elements(ends, element, np.array([rng.choice([0.0, 0.002, 0.02])]))])


def gridded(elements):
    """Return a body with a grid, however few its elements are."""
    body = pack_bodies([elements])
    return body._replace(grid=grid_around(body.box[0]))


def drawn_case(seed, rng, away):
    """Return a chain, a travel, and the poses of what moves and of what rests near its way."""
    chain, best = drawn_chain(seed, rng), float(rng.uniform(0.5, 2.0))
    side, beside = rng.normal(size=(2, 3))
    moving, on_the_way = pose(rng, away * side / np.linalg.norm(side)), np.zeros((6, 3))
    move_core(np.tile(moving[:, 3], (3, 1)), 1, chain, len(chain), 0.6 * best, on_the_way)
    return chain, best, moving, pose(rng, on_the_way[0] + 0.02 * beside / np.linalg.norm(beside))


@pytest.mark.parametrize("corners", [1, 2])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("away", [0.15, 0.05, 0.0])
def test_a_round_body_meets_what_the_first_element_tells(kind, corners, away):
    met, overlaps = 0, 0
    for seed in range(45):
        rng = np.random.default_rng([seed, KINDS.index(kind), corners])
        moving = rod(rng, corners)
        resting = gridded(patch(rng, kind, int(rng.integers(1, 80))))
        chain, best, T_moving, T_resting = drawn_case(seed, rng, away)
        work = make_sweep_work(8, 0)
        work.moving[:], work.resting[:] = T_moving, T_resting
        found = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        won = work.pair.copy()
        expected = best
        ((a, ka, wa),) = cores(moving, work.moving)
        fixed = list(cores(resting, work.resting))
        for b, kb, wb in fixed:
            each = sweep_pair(a, ka, b, kb, wa + wb, chain, len(chain), TOUCH, 0.0, best, np.zeros((6, 3)))
            expected = min(expected, each)
        assert found == pytest.approx(expected, abs=1e-8), (seed, found, expected)
        assert (found == OVERLAP) == (expected == OVERLAP)
        if 0.0 < found < best:
            met += 1
            b, kb, wb = fixed[won[1]]
            at = sweep_pair(a, ka, b, kb, wa + wb, chain, len(chain), TOUCH, 0.0, best, np.zeros((6, 3)))
            assert at == pytest.approx(found, abs=1e-8)
            assert (won[0], won[2], won[3]) == (0, 0, 0)
        overlaps += found == OVERLAP
    assert met >= 4
    assert away > 0.0 or overlaps > 0


def test_a_sweep_is_the_same_whatever_was_swept_before():
    rng = np.random.default_rng(1)
    body, moving = pack_bodies([patch(rng, "soup", 80)]), rod(rng, 2)
    one, other = with_grid(body), with_grid(body)
    cases = [drawn_case(seed, np.random.default_rng(seed), 0.1) for seed in range(60)]

    def swept(resting, case):
        chain, best, T_moving, T_resting = case
        work = make_sweep_work(8, 0)
        work.moving[:], work.resting[:] = T_moving, T_resting
        found = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        return found, tuple(work.pair) if found < best else None

    forth = [swept(one, case) for case in cases]
    back = [swept(other, case) for case in cases[::-1]]
    assert forth == back[::-1]
    assert forth == [swept(one, case) for case in cases]
    assert sum(pair is not None for _, pair in forth) > 10


def test_few_elements_are_swept_without_a_grid():
    rng = np.random.default_rng(2)
    assert with_grid(pack_bodies([patch(rng, "soup", FEW)])).grid.square.size == 0
    assert with_grid(pack_bodies([patch(rng, "soup", FEW + 1)])).grid.square.size > 0
