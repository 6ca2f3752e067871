"""How corners move: rotation matrices, finite differences, and the first root of a height over a plane."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.toi import core_motion
from kernels.kernel_entries import entry
from kernels.motion_check import STEPS, check_motion

move_core, corner_motion, base_motion, plane_offset, plane_gap, turn_to_plane = (
    entry(getattr(core_motion, name))
    for name in ("move_core", "corner_motion", "base_motion", "plane_offset", "plane_gap", "turn_to_plane")
)
seeds = st.integers(0, 10**6)


def drawn(seed):
    """Return a core of three corners, a chain of one to four turning joints, a direction and a place on the path."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 5))
    chain = np.column_stack([rng.uniform(-2.0, 2.0, count), rng.uniform(-0.05, 0.05, (count, 2))])
    n = rng.normal(size=3)
    return rng.uniform(-0.04, 0.04, (3, 3)), chain, n / np.linalg.norm(n), float(rng.uniform(0.0, 2.0))


def placed(core, chain, s):
    """Turn from x towards z about the y axis, joint by joint."""
    base = np.zeros(3)
    for rate, x, z in chain[:-1]:
        base += Rotation.from_rotvec([0.0, -rate * s, 0.0]).apply([x, 0.0, z])
    return base + Rotation.from_rotvec([0.0, -chain[-1, 0] * s, 0.0]).apply(core)


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_a_core_is_where_rotations_take_it(seed):
    core, chain, n, s = drawn(seed)
    out = np.zeros((6, 3))
    move_core(core, 2, chain, len(chain), s, out)
    np.testing.assert_allclose(out[:2], placed(core, chain, s)[:2], atol=1e-15)
    assert not out[2:].any()
    pivot = base_motion(chain, len(chain), n[0], n[2], s)[:2]
    np.testing.assert_allclose(pivot, placed(np.zeros((1, 3)), chain, s)[0, [0, 2]], atol=1e-15)


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_speeds_and_accelerations_are_differences_and_within_their_bounds(seed):
    core, chain, n, s = drawn(seed)
    for k in range(3):
        height = [placed(core, chain, s + d)[k] @ n for d in STEPS]
        bounds = check_motion(lambda at, k=k: corner_motion(core, k, chain, len(chain), *n, at), s, height)
        arms = np.hypot(chain[:-1, 1], chain[:-1, 2])
        rates, across = np.abs(chain[:, 0]), np.hypot(n[0], n[2])
        arms = np.append(arms, np.hypot(core[k, 0], core[k, 2]))
        tightest = [rates @ arms, across * (rates**2 @ arms)]
        assert bounds == pytest.approx(tightest, rel=1e-12)
    one, other = (
        base_motion(chain, len(chain), n[0], n[2], s),
        corner_motion(core * 0.0, 0, chain, len(chain), *n, s),
    )
    assert one[2:] == pytest.approx(other, abs=1e-15)


@settings(deadline=None, max_examples=100)
@given(seeds, st.integers(1, 3), st.integers(1, 3))
def test_what_lies_beyond_along_a_direction(seed, ka, kb):
    rng = np.random.default_rng(seed)
    a, b, n = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    assert plane_offset(a, ka, *n) == pytest.approx((a[:ka] @ n).max(), abs=1e-14)
    assert plane_gap(a, ka, b, kb, *n) == pytest.approx((a[:ka] @ n).min() - (b[:kb] @ n).max(), abs=1e-14)


@settings(deadline=None, max_examples=300)
@given(st.floats(0.0, 2 * np.pi), st.floats(1e-3, 1.0), st.floats(-1.2, 1.2), st.floats(0.01, 7.0))
def test_a_point_comes_down_to_a_plane_at_the_first_root(angle, size, height, best):
    """The gap is `K + size cos(s - angle)`, with K such that it is at least 0 now."""
    gap = size * max(height + np.cos(angle), 0.0)
    constant = gap - size * np.cos(angle)
    found = turn_to_plane(gap, size * np.sin(angle), -size * np.cos(angle), best)
    grid = np.linspace(0.0, best, 20001)
    below = np.flatnonzero(constant + size * np.cos(grid - angle) < -1e-9 * size)
    if len(below):
        assert 0.0 <= found <= grid[below[0]]
    # What is found is a root, on the way down, or the end of what is of interest.
    if found < best:
        assert constant + size * np.cos(found - angle) == pytest.approx(0.0, abs=1e-9 * size)
        assert -np.sin(found - angle) <= 1e-4
        assert (constant + size * np.cos(grid[grid < found] - angle) >= -1e-9 * size).all()
    else:
        assert found == best or len(below) == 0


def test_a_plane_out_of_reach_is_never_met():
    assert turn_to_plane(0.2, 0.0, 0.05, 6.0) == 6.0
    assert turn_to_plane(0.2, 0.0, -0.05, 6.0) == 6.0
    assert turn_to_plane(0.0, 0.0, -0.05, 6.0) == 0.0
    assert turn_to_plane(0.05, 0.0, -0.05, 6.0) == pytest.approx(0.5 * np.pi)
