"""The direction between two hulls: a plane across it parts them, nearly as far as they are apart."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from clench.kernels.hulls import gjk
from clench.kernels.hulls.enclosing_hulls import HullPart, pack_hulls
from kernels.hulls.test_enclosing_hulls import KINDS, cloud
from kernels.kernel_entries import entry

separating_direction = entry(gjk.separating_direction)
GOOD = 0.02


def distance(a, b):
    """Return the distance of two convex hulls: least squares with weights that are not negative and sum to one each."""
    heavy = 1e5
    rows = np.vstack([np.hstack([a.T, -b.T]), heavy * np.repeat(np.eye(2), [len(a), len(b)], axis=0).T])
    weights, _ = nnls(rows, np.array([0.0, 0.0, 0.0, heavy, heavy]))
    one, other = weights[: len(a)], weights[len(a) :]
    return float(np.linalg.norm(one @ a / one.sum() - other @ b / other.sum()))


@settings(deadline=None, max_examples=150)
@given(
    seed=st.integers(0, 10**6), kinds=st.tuples(st.sampled_from(KINDS), st.sampled_from(KINDS)), away=st.floats(0, 6)
)
def test_a_direction_parts_two_hulls_that_are_apart(seed, kinds, away):
    rng = np.random.default_rng(seed)
    clouds = [cloud(kind, int(rng.choice([1, 2, 8, 40])), rng) for kind in kinds]
    T = np.column_stack([Rotation.random(rng=rng).as_matrix(), away * rng.normal(size=3)])
    hulls, others = (pack_hulls([[HullPart(points, 0.0)]]) for points in clouds)
    moved = clouds[0] @ T[:, :3].T + T[:, 3]
    apart = distance(moved, clouds[1])
    for other, corners in ((0, np.empty((0, 3))), (-1, np.ascontiguousarray(clouds[1]))):
        n = np.append(rng.normal(size=3), 0.0)
        parted = separating_direction(hulls, 0, T, others, other, corners, (GOOD, 0.0), np.empty((5, 6)), n)
        gap = (moved @ n[:3]).min() - (clouds[1] @ n[:3]).max()
        assert np.linalg.norm(n[:3]) == pytest.approx(1.0)
        assert gap <= apart + 1e-6
        assert parted == (gap > 0.0) or abs(gap) < 1e-12
        if apart > 1e-3:
            assert gap >= (1.0 - 1.5 * GOOD) * apart - 1e-6
        if apart < 1e-9 and gap > 1e-12:
            pytest.fail(f"hulls that meet are told to be {gap} apart")
