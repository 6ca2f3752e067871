"""Tables of corners: how cones are divided. Whether they find the right corner, test_enclosing_hulls.py asks."""

import numpy as np
import pytest

from clench.kernels.hulls.corner_tables import DEEPEST, ENOUGH, WIDE, make_table
from kernels.hulls.test_enclosing_hulls import KINDS, cloud


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_divides_cones_until_they_have_few_corners(kind):
    points = np.unique(cloud(kind, 2000, np.random.default_rng(3)), axis=0)
    cone, entry, order = make_table(points)
    assert sorted(order) == list(range(len(points)))
    whole = cone[:, 1] >= 0
    assert cone[whole, 1].sum() == len(entry)
    assert (cone[whole, 1] > 0).all()
    # Four parts of each cone that is divided follow each other.
    parts = np.concatenate([first + np.arange(4) for first in cone[~whole, 0]]) if (~whole).any() else np.arange(0)
    assert sorted(parts) == list(range(6 * WIDE * WIDE, len(cone)))
    level = np.zeros(len(cone), dtype=int)
    for n in np.flatnonzero(~whole):
        level[cone[n, 0] : cone[n, 0] + 4] = level[n] + 1
    assert level.max() <= DEEPEST
    assert (cone[whole & (level < DEEPEST), 1] <= ENOUGH).all()
    # Corners that are first met in a cone are numbered there.
    assert (np.diff(entry[np.sort(np.unique(entry, return_index=True)[1])]) == 1).all()
