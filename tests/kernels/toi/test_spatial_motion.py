"""How corners move behind joints whose axes are not parallel: rotation matrices and finite differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.toi import core_motion, spatial_motion
from clench.kernels.toi.spatial_motion import SPATIAL
from kernels.kernel_entries import entry
from kernels.motion_check import STEPS, check_motion

move_core, corner_motion, carried_back, turn_rate = (
    entry(getattr(core_motion, name)) for name in ("move_core", "corner_motion", "carried_back", "turn_rate")
)
move_pose = entry(spatial_motion.move_pose)
seeds = st.integers(0, 10**6)


def drawn(seed):
    """Return a core of three corners, a chain of two to four turning joints, a direction and a place on the path."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 5))
    axes = rng.normal(size=(count, 3))
    if seed % 3 == 0:
        axes = axes[:1] + 1e-6 * axes
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    chain = np.column_stack([rng.uniform(-2.0, 2.0, count), axes, rng.uniform(-0.05, 0.05, (count, 3))])
    n = rng.normal(size=3)
    return rng.uniform(-0.04, 0.04, (3, 3)), chain, n / np.linalg.norm(n), float(rng.uniform(0.0, 2.0))


def orientation(chain, s):
    """Return how what the chain carries has turned."""
    R = Rotation.identity()
    for row in chain:
        R = R * Rotation.from_rotvec(row[0] * s * row[1:4])
    return R


def placed(core, chain, s):
    """Turn about joint after joint, from the palm outwards; every pivot goes along with the joints before it."""
    at = np.zeros(3)
    for k in range(len(chain) - 1):
        at = at + orientation(chain[: k + 1], s).apply(chain[k, 4:])
    return at + orientation(chain, s).apply(core)


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_a_core_is_where_rotations_take_it(seed):
    core, chain, _, s = drawn(seed)
    out = np.zeros((6, 3))
    move_core(core, 2, chain, len(chain), s, out)
    np.testing.assert_allclose(out[:2], placed(core, chain, s)[:2], atol=1e-15)
    assert not out[2:].any()


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_a_direction_is_carried_back(seed):
    _, chain, n, s = drawn(seed)
    step = 0.3
    expected = orientation(chain, s).apply(orientation(chain, s + step).inv().apply(n))
    np.testing.assert_allclose(carried_back(tuple(n), chain, len(chain), s, step), expected, atol=1e-14)
    turned = (orientation(chain, s + 1e-6) * orientation(chain, s).inv()).magnitude() / 1e-6
    assert turned <= turn_rate(chain, len(chain)) * (1.0 + 1e-6)


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_speeds_and_accelerations_are_differences_and_within_their_bounds(seed):
    core, chain, n, s = drawn(seed)
    for k in range(3):
        height = [placed(core, chain, s + d)[k] @ n for d in STEPS]
        check_motion(lambda at, k=k: corner_motion(core, k, chain, len(chain), *n, at), s, height)


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_parallel_joints_move_alike_in_either_form(seed):
    core, chain, n, s = drawn(seed)
    flat = np.column_stack([np.cumsum(chain[:, 0]), chain[:, 4], chain[:, 6]])
    chain[:, 1:4], chain[:, 5] = [0.0, -1.0, 0.0], 0.0
    assert chain.shape[1] == SPATIAL
    for k in range(3):
        one = corner_motion(core, k, chain, len(chain), *n, s)
        other = corner_motion(core, k, flat, len(chain), *n, s)
        assert one[:2] == pytest.approx(other[:2], abs=1e-14)
        # What is known of the axes makes the bounds of parallel joints the smaller ones, where they turn one way.
        if (chain[:, 0] > 0.0).all():
            assert one[2] >= other[2] - 1e-15
            assert one[3] >= other[3] - 1e-15


@settings(deadline=None, max_examples=100)
@given(seeds)
def test_a_pose_goes_along_with_its_corners(seed):
    core, chain, _, s = drawn(seed)
    T = np.column_stack([Rotation.random(rng=np.random.default_rng(seed)).as_matrix(), core[0]])
    moved = T.copy()
    move_pose(chain, len(chain), s, moved)
    assert moved[:, :3] == pytest.approx(orientation(chain, s).as_matrix() @ T[:, :3], abs=1e-12)
    assert moved[:, 3] == pytest.approx(placed(T[:, 3], chain, s), abs=1e-12)
