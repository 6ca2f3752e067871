"""Pairs of elements on a short way: none that meets is left out, most others are."""

import numpy as np
import pytest

from kernels.hulls.test_hull_sweep import drawn
from kernels.plain_sweeps import list_near, list_pairs, sweep_listed, sweep_pair
from kernels.toi.test_toi_bodies import KINDS, TOUCH, cores


def meetings(moving, resting, chain, best, work):
    """Return when every pair of elements meets, moving ones by rows."""
    found = np.full((len(moving.elements), len(resting.elements)), best)
    others = list(cores(resting, work.resting))
    for i, (a, ka, wa) in enumerate(cores(moving, work.moving)):
        for n, (b, kb, wb) in enumerate(others):
            found[i, n] = sweep_pair(a, ka, b, kb, wa + wb, chain, len(chain), TOUCH, 0.0, best, np.zeros((6, 3)))
    return found


def near_each_other(seed, kind):
    """Return what `drawn` does, with the bodies beside each other, apart if possible."""
    moving, resting, chain, _, work = drawn(seed, (kind, kind), bool(seed % 2))
    aside = np.random.default_rng(seed).normal(size=3)
    for distance in np.linspace(0.005, 0.12, 24):
        work.moving[:, 3] = work.resting[:, 3] + distance * aside / np.linalg.norm(aside)
        if meetings(moving, resting, np.array([[1.0, 0.0, 0.0]]), 0.0, work).min() >= 0.0:
            break
    return moving, resting, chain, work


@pytest.mark.parametrize("kind", KINDS)
def test_listed_pairs_hold_all_that_meet_and_give_the_first_contact(kind):
    short, pairs, every, contacts = 0.05, 0, 0, 0
    for seed in range(25):
        moving, resting, chain, work = near_each_other(seed, kind)
        arguments = (moving, 0, resting, 0, chain, len(chain), TOUCH, short)
        listed = list_near(*arguments, work)
        at = meetings(moving, resting, chain, short, work)
        rows, found = list_pairs(*arguments, listed, work)
        if found >= 0:
            assert set(zip(*np.nonzero(at < short), strict=True)) <= set(map(tuple, rows))
            assert len(set(map(tuple, rows))) == found
            pairs, every = pairs + found, every + at.size
        first = sweep_listed(*arguments, listed, work)
        assert first == pytest.approx(at.min(), abs=1e-7) if at.min() >= 0.0 else first < 0.0
        if 0.0 <= first < short:
            assert at[work.pair[0], work.pair[1]] == pytest.approx(first, abs=1e-7)
            contacts += 1
    assert contacts > 0
    assert 0 < pairs < 0.5 * every


def test_more_pairs_than_there_is_room_for_are_swept_through_the_trees():
    full = 0
    for seed in range(25):
        moving, resting, chain, work = near_each_other(seed, "soup")
        arguments = (moving, 0, resting, 0, chain, len(chain), TOUCH, 2.0)
        listed = list_near(*arguments, work)
        _, found = list_pairs(*arguments, listed, work)
        full += listed > 0 > found
        first = meetings(moving, resting, chain, 2.0, work).min()
        assert sweep_listed(*arguments, listed, work) == pytest.approx(first, abs=1e-7) or first < 0.0
    assert full > 0


def test_nothing_listed_is_never_met():
    moving, resting, chain, work = near_each_other(0, "soup")
    assert sweep_listed(moving, 0, resting, 0, chain, len(chain), TOUCH, 0.05, 0, work) == 0.05
