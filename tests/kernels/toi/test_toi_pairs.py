"""One pair of cores, one of which turns: events with closed forms, and pairs that planes at rest hardly keep apart."""

import numpy as np
import pytest
from scipy.optimize import brentq

from clench.kernels.toi import core_motion
from clench.kernels.toi.separating import OVERLAP
from kernels.kernel_entries import entry
from kernels.plain_sweeps import sweep_pair

move_core, plane_gap = entry(core_motion.move_core), entry(core_motion.plane_gap)

TOUCH = 1e-11
BEST = 1.5
PIVOT = np.array([[1.0, 0.0, 0.0]])


def swept(core, fixed, w=0.0, best=BEST, chain=PIVOT):
    """Sweep a core that turns from x towards z about the origin, or as a chain does."""
    corners = [np.ascontiguousarray(np.resize(np.asarray(c, dtype=float), (3, 3))) for c in (core, fixed)]
    return sweep_pair(
        corners[0], len(core), corners[1], len(fixed), w, chain, len(chain), TOUCH, 0.0, best, np.zeros((6, 3))
    )


@pytest.mark.parametrize("gap", [5e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("away", [0.0, 1e-6, 3.7e-5, 1e-3])
@pytest.mark.parametrize("run", [(0.3, 1.0, 0.6), (0.6, 1.0, -0.3), (1.0, 0.5, 1.0)])
def test_an_edge_that_slides_along_another_and_off_it_is_free(gap, away, run):
    """A face turns in its own plane; the other edge goes through that plane just below its side, which rises there.

    The gap across the side is `D + away sin θ - (D - gap) cos θ`: it only grows, hardly at first.
    """
    height = 0.05
    face = [(-0.02, 0.0, height), (0.02, 0.0, height), (0.0, 0.0, height + 0.02)]
    middle = np.array([away, 0.0, height - gap])
    edge = [middle - 0.01 * np.array(run), middle + 0.01 * np.array(run)]
    assert swept(face, edge) == BEST


@pytest.mark.parametrize("away", [0.02, 1e-3, 1e-4])
@pytest.mark.parametrize("part", [0.5, 0.99, 1.01, 2.0])
def test_an_edge_that_comes_down_on_another_touches_or_passes(away, part):
    """As above, but the side comes down at first: `D - away sin θ - (D - gap) cos θ` is 0, or stays above."""
    height = 0.05
    face = [(-0.03, 0.0, height), (0.03, 0.0, height), (0.0, 0.0, height + 0.02)]
    gap = part * (height - np.sqrt(height**2 - away**2))
    middle = np.array([-away, 0.0, height - gap])
    edge = [middle - 0.01 * np.array((0.3, 1.0, 0.6)), middle + 0.01 * np.array((0.3, 1.0, 0.6))]
    found = swept(face, edge)
    radius = np.hypot(away, height - gap)
    if part > 1.0:
        assert found == BEST
    else:
        expected = np.arctan2(away, height - gap) - np.arccos(height / radius)
        left = height - away * np.sin(found) - (height - gap) * np.cos(found)
        assert found == pytest.approx(expected, rel=1e-3)
        assert 0.0 <= left <= 2.0 * TOUCH


@pytest.mark.parametrize(
    ("middle", "run", "w"),
    [
        ((-0.0088, 0.0025, 0.044), (-0.0037, 0.0364, -0.0079), 0.005),
        ((-0.0069, 0.00095, 0.049), (0.007, 0.01575, 0.005), 0.001),
        ((-0.012, 0.0, 0.0435), (-0.004, 0.03, -0.008), 0.006),
    ],
)
def test_round_edges_that_slide_along_each_other_touch(middle, run, w):
    """The distance of the lines along them is a closed form; their closest points run, and no plane at rest lasts."""
    height, middle, run = 0.05, np.array(middle), np.array(run)

    def left(s):
        n = np.cross((np.cos(s), 0.0, np.sin(s)), run)
        return abs((middle - np.array((-height * np.sin(s), 0.0, height * np.cos(s)))) @ n) / np.linalg.norm(n) - w

    found = swept([(-0.03, 0.0, height), (0.03, 0.0, height)], [middle - run, middle + run], w=w)
    assert found == pytest.approx(brentq(left, 0.0, 0.06, xtol=1e-15), abs=1e-8)
    assert 0.0 <= left(found) <= 2.0 * TOUCH


@pytest.mark.parametrize("rates", [(1.0, 1.7), (1.0, 0.0), (1.0, -0.4)])
def test_a_point_on_two_turning_joints_meets_a_face(rates):
    """The point is at `R(a s) e + R(b s) c`; the face lies across z."""
    base, tip, height = np.array([0.04, 0.0]), np.array([0.03, 0.005]), 0.02
    chain = np.array([[rates[0], *base], [rates[1], 0.0, 0.0]])

    def over(s):
        return sum(v[0] * np.sin(r * s) + v[1] * np.cos(r * s) for r, v in zip(rates, (base, tip), strict=True))

    face = [(-1.0, -1.0, height), (1.0, -1.0, height), (0.0, 1.0, height)]
    found = swept([(tip[0], 0.0, tip[1])], face, chain=chain)
    assert found == pytest.approx(brentq(lambda s: over(s) - height, 0.0, 0.7), abs=1e-8)
    assert 0.0 <= height - over(found) <= 2.0 * TOUCH


@pytest.mark.parametrize("deep", [1e-3, 1e-6])
def test_cores_that_cross_at_the_start_are_said_to_overlap(deep):
    face = [(-0.02, -0.02, 0.05), (0.02, -0.02, 0.05), (0.0, 0.02, 0.05)]
    assert swept([(0.0, 0.0, 0.03), (0.001, 0.0, 0.05 + deep)], face) == OVERLAP
    assert swept([(0.0, 0.0, 0.05 - 0.01 + deep)], face, w=0.01) == OVERLAP
    # No corner and no edge is near: only the crossing tells.
    assert swept([(0.0, 0.0, 0.03), (0.0, 0.0, 0.07)], face, w=deep) == OVERLAP


def test_what_touches_at_the_start_has_met_where_only_balls_are_asked_for():
    """A point on the x axis leaves the face below it."""
    face = [(-0.1, -0.1, -1e-12), (0.1, -0.1, -1e-12), (0.0, 0.1, -1e-12)]
    assert swept([(0.05, 0.0, 0.0)], face) > 0.5


@pytest.mark.parametrize("below", [0.0, 1e-12])
@pytest.mark.parametrize("at", [0.0, 0.5, 1.0, 1.4])
def test_what_leaves_a_face_comes_back_to_it(below, at):
    """A point at an angle below the vertical comes down to the same height at that angle beyond it."""
    x, z = 0.04 * np.cos(at), 0.04 * np.sin(at)
    face = [(-0.1, -0.1, z - below), (0.1, -0.1, z - below), (0.0, 0.1, z - below)]
    assert swept([(x, 0.0, z)], face, best=4.0) == pytest.approx(np.pi - 2.0 * at, abs=1e-8)
    assert swept([(x, 0.0, z)], face, best=3.0 - 2.0 * at) == 3.0 - 2.0 * at


def test_a_pair_that_takes_too_many_planes_ends_where_it_is_free():
    """A point on two joints that turn alike goes round and round, past another one by 1e-6 m."""
    chain = np.array([[1.0, 0.02, 0.0], [1.0, 0.0, 0.0]])
    found = swept([(0.03, 0.0, 0.0)], [(-0.05 - 1e-6, 0.0, 0.0)], chain=chain, best=2000.0)
    assert 0.0 < found < 2000.0
    assert np.hypot(0.05 * np.cos(found) + 0.05 + 1e-6, 0.05 * np.sin(found)) >= 1e-6


def all_but_parallel(rng, sine):
    """Return a place, two directions with this sine between them, and unit vectors across both, aside and up."""
    at, u = rng.normal(size=3) * 0.04, rng.normal(size=3) * 0.02
    across = np.cross(u, rng.normal(size=3))
    across /= np.linalg.norm(across)
    return at, u, u + sine * np.linalg.norm(u) * across, across, np.cross(u, across) / np.linalg.norm(u)


@pytest.mark.parametrize("sine", [1.2e-8, 3e-8, 5e-7])
def test_round_edges_that_touch_and_are_all_but_parallel_do_not_overlap(sine):
    """The plane across such edges is known to 1e-16 / sine only, their distance to the last digit."""
    for seed in range(300):
        rng = np.random.default_rng(seed)
        at, u, v, across, up = all_but_parallel(rng, sine)
        w = 10 ** rng.uniform(-6, -2)
        face = [at + 0.5 * u, at - 0.7 * u, at + 0.1 * across]
        edge = [at + 0.4 * v - w * up, at - 0.6 * v - w * up]
        assert swept(face, edge, w) != OVERLAP


@pytest.mark.parametrize("sine", [3e-9, 1e-8, 1e-7])
def test_sharp_edges_that_touch_and_are_all_but_parallel_do_not_overlap(sine):
    """A face stands on an edge of another; in height they overlap by less than the touch tolerance."""
    for seed in range(100):
        rng = np.random.default_rng(seed)
        at, u, v, across, up = all_but_parallel(rng, sine)
        deep = rng.uniform(0.0, 1e-12)
        above = [at + 0.5 * u, at - 0.7 * u, at + rng.uniform(-0.02, 0.02) * across + rng.uniform(1e-6, 0.02) * up]
        below = [at + 0.4 * v, at - 0.6 * v, at + rng.uniform(-0.02, 0.02) * across - rng.uniform(1e-6, 0.02) * up]
        assert swept(np.array(above) - deep * up, below) != OVERLAP


def test_a_plane_that_is_told_keeps_the_cores_apart_on_the_whole_way():
    rng = np.random.default_rng(5)
    told = met = neither = 0
    for _ in range(600):
        (ka, kb, count), w = rng.integers(1, [4, 4, 3]), float(rng.choice([0.0, 0.003]))
        core, fixed = rng.uniform(-0.03, 0.03, (2, 3, 3))
        fixed[:, 2] += 0.03
        chain = np.column_stack([rng.uniform(0.5, 2.0, count), rng.uniform(-0.02, 0.02, (count, 2))])
        placed, there = np.zeros((6, 3)), np.zeros((6, 3))
        found = sweep_pair(core, ka, fixed, kb, w, chain, count, TOUCH, 0.0, 0.8, placed)
        n = placed[5]
        if found < 0.8:
            met += 1
        elif not n.any():
            neither += 1
        else:
            told += 1
            assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-12)
            for s in np.linspace(0.0, 0.8, 101):
                move_core(core, ka, chain, count, s, there)
                assert plane_gap(there, ka, fixed, kb, *n) >= w
    assert min(told, met, neither) > 30
