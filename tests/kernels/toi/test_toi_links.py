"""Pairs of cores, one of which moves behind joints whose axes are not parallel, against another engine's distances."""

import numpy as np
import pytest

from clench.kernels.toi import toi_bounds as earliest
from clench.kernels.toi.separating import OVERLAP
from kernels.kernel_entries import entry
from kernels.plain_sweeps import sweep_pair, walk_core
from kernels.toi.test_spatial_motion import drawn, placed
from oracle.width import Core, gap

walk_ball = entry(earliest.walk_ball)
TOUCH = 1e-11
BEST = 1.2


def engine_core(points):
    """Return a point, a segment or a triangle for the other engine."""
    points = np.asarray(points, dtype=float)
    corners = np.vstack([points, points[-1:], points[-1:]])[:3]
    return Core(corners, np.array([[0, 1, 2]]), 0.0)


def distance(core, chain, fixed, s):
    """Return the distance of the cores where the chain has moved by `s`; -1 where they cross."""
    return gap(engine_core(placed(core, chain, s)), np.eye(4), engine_core(fixed), np.eye(4))


def swept(core, chain, fixed, w=0.0):
    rows = [np.ascontiguousarray(np.resize(np.asarray(c, dtype=float), (3, 3))) for c in (core, fixed)]
    return sweep_pair(rows[0], len(core), rows[1], len(fixed), w, chain, len(chain), TOUCH, 0.0, BEST, np.zeros((6, 3)))


@pytest.mark.parametrize("corners", [1, 2, 3])
@pytest.mark.parametrize("others", [1, 2, 3])
def test_nothing_is_passed_and_nothing_is_left_open(corners, others):
    met = 0
    for seed in range(24):
        core, chain, _, s = drawn(1000 * corners + 100 * others + seed)
        rng = np.random.default_rng(seed)
        # What rests is near the way of the core, so that it is met more often than not.
        near = placed(core[:corners], chain, 0.4 * s).mean(axis=0)
        fixed = near + rng.uniform(-0.01, 0.01, (others, 3))
        w = float(rng.choice([0.002, 0.006])) if corners + others < 5 or seed % 2 else 0.0
        found = swept(core[:corners], chain, fixed, w)
        if found == OVERLAP:
            assert distance(core[:corners], chain, fixed, 0.0) < w
            continue
        for t in np.linspace(0.0, max(found - 1e-6, 0.0), 60):
            assert distance(core[:corners], chain, fixed, t) >= w - 1e-9
        if found < BEST:
            met += 1
            assert abs(distance(core[:corners], chain, fixed, found) - w) <= 1e-9
    assert met >= 3


@pytest.mark.parametrize("above", [0.0, 1e-12, -1e-12])
def test_a_corner_that_touches_a_face_leaves_it_until_it_comes_back(above):
    """The face has no inside: the corner is held by it where it is known to be on the side from which it comes."""
    seen = set()
    for seed in range(40):
        core, chain, n, _ = drawn(seed)
        start = placed(core[:1], chain, 0.0)[0]
        u = np.cross(n, [1.0, 0.3, -0.2])
        u /= np.linalg.norm(u)
        v = np.cross(n, u)
        face = start - above * n + 0.5 * np.array([u, -0.5 * u + 0.8 * v, -0.5 * u - 0.8 * v])
        travels = np.geomspace(1e-9, BEST, 120)
        heights = [(placed(core[:1], chain, t)[0] - start) @ n for t in travels]
        way = np.sign(heights[0])
        found = swept(core[:1], chain, face)
        if above * way < 0.0:
            assert abs((placed(core[:1], chain, found)[0] - start) @ n) <= abs(above)
            seen.add("held")
            continue
        back = np.flatnonzero(way * np.array(heights) < -1e-9)
        assert found == pytest.approx(travels[back[0]] if len(back) else BEST, rel=0.25)
        seen.add("came back" if len(back) else "left")
    assert seen == {"left", "came back", *(["held"] if above else [])}


def test_a_walk_never_passes_a_ball():
    seen = set()
    for seed in range(120):
        core, chain, _, s = drawn(seed)
        rng = np.random.default_rng(seed)
        other = placed(core[:1], chain, 0.6 * s)[0] + rng.uniform(-0.02, 0.02, 3)
        reach, limit = float(rng.uniform(0.003, 0.03)), float(rng.uniform(0.2, 2.0))
        found = walk_ball(core, other[None].copy(), reach, chain, len(chain), 0.0, limit, np.empty((6, 3)))
        away = [np.linalg.norm(placed(core[:1], chain, t)[0] - other) for t in np.linspace(0.0, min(found, limit), 40)]
        assert min(away) >= reach - 1e-12 or found == 0.0
        if found == 0.0:
            assert away[0] <= 1.125 * reach + 1e-12
        assert found < limit or found == np.inf
        seen.add("free" if found == np.inf else "near" if away[-1] <= 1.126 * reach else "gave up")
    assert {"free", "near"} <= seen


def test_a_walk_goes_on_where_it_is_told_to():
    """What is known to be free already is not looked at again: a ball that was passed there does not stop it."""
    core, chain, _, _ = drawn(1)
    other = placed(core[:1], chain, 0.3)
    first = walk_ball(core, other.copy(), 1e-3, chain, len(chain), 0.0, 1.0, np.empty((6, 3)))
    after = walk_ball(core, other.copy(), 1e-3, chain, len(chain), 0.4, 1.0, np.empty((6, 3)))
    assert first < 0.3 < 0.4 < after


@pytest.mark.parametrize("corners", [1, 2, 3])
@pytest.mark.parametrize("others", [1, 2, 3])
def test_a_walk_never_passes_a_core(corners, others):
    seen = set()
    for seed in range(40):
        core, chain, _, s = drawn(1000 * corners + 100 * others + seed)
        rng = np.random.default_rng(seed)
        if seed % 2:
            chain = np.array([[rng.choice([-1.5, 1.0]), 0.0, 0.0]])  # one joint, about y
        moved = placed if seed % 2 == 0 else turned
        fixed = moved(core[:corners], chain, 0.4 * s).mean(axis=0) + rng.uniform(-0.02, 0.02, (others, 3))
        w, near = float(rng.uniform(0.0, 0.006)), float(rng.uniform(1e-6, 0.004))
        rows = [np.ascontiguousarray(np.resize(c, (3, 3))) for c in (core[:corners], fixed)]
        begin = float(rng.choice([0.0, 0.1]))
        found = walk_core(rows[0], corners, rows[1], others, w, chain, len(chain), near, begin, BEST, np.empty((6, 3)))
        away = [
            gap(engine_core(moved(core[:corners], chain, t)), np.eye(4), engine_core(fixed), np.eye(4)) - w
            for t in np.linspace(begin, min(found, BEST), 40)
        ]
        assert begin <= found < BEST or found == np.inf
        # Where it does not get on it says nothing.
        assert min(away) >= -1e-12 or found == begin
        seen.add("free" if found == np.inf else "near" if away[-1] <= near + 1e-12 else "gave up")
    assert {"free", "near"} <= seen


def turned(core, chain, s):
    """Turn about the y axis."""
    c, d = np.cos(chain[0, 0] * s), np.sin(chain[0, 0] * s)
    return np.asarray(core) @ np.array([[c, 0.0, d], [0.0, 1.0, 0.0], [-d, 0.0, c]])
