"""Cores that touch exactly at the start: they go on where they part, and stop where they would overlap."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.plain_sweeps import sweep_pair

TOUCH = 1e-11
BEST = 0.5


def sweep(core, fixed, w=0.0, rate=1.0, best=BEST):
    """Return how far `core` turns about the origin's y axis before it meets `fixed`."""
    chain = np.array([[rate, 0.0, 0.0]])
    rows = [np.vstack([c, np.tile(c[-1], (3 - len(c), 1))]) for c in (core, fixed)]
    return sweep_pair(rows[0], len(core), rows[1], len(fixed), w, chain, 1, TOUCH, 0.0, best, np.zeros((6, 3)))


def turned(core, angle):
    """Return a core turned from x towards z."""
    c, d = np.cos(angle), np.sin(angle)
    return core @ np.array([[c, 0.0, d], [0.0, 1.0, 0.0], [-d, 0.0, c]])


def apart(a, b):
    """Return the gap of two triangles across the best plane between them, negative where there is none."""
    edges = [[t[(k + 1) % 3] - t[k] for k in range(3)] for t in (a, b)]
    normals = [np.cross(e[0], e[1]) for e in edges]
    axes = [*normals, *(np.cross(u, v) for u, v in itertools.product(*edges))]
    axes += [np.cross(n, e) for n in normals for es in edges for e in es]
    best = -np.inf
    for n in (n / np.linalg.norm(n) for n in axes if np.linalg.norm(n) > 1e-12):
        best = max(best, (a @ n).min() - (b @ n).max(), (b @ n).min() - (a @ n).max())
    return best


def corner_on_face(rng):
    """Return a triangle and one that has a corner on its inside and lies on one side of it."""
    face = rng.normal(size=(3, 3)) * 0.02 + rng.normal(size=3) * 0.05
    n = np.cross(face[1] - face[0], face[2] - face[0])
    n /= np.linalg.norm(n)
    foot = rng.dirichlet([2.0, 2.0, 2.0]) @ face
    other = foot + rng.normal(size=(3, 3)) * 0.02
    other += n * np.abs(rng.uniform(0.002, 0.02, (3, 1))) - n * ((other - foot) @ n)[:, None]
    other[0] = foot
    return face, other


def edge_on_edge(rng):
    """Return two triangles with an edge each that cross, on opposite sides of the plane along both."""
    at, u, v = rng.normal(size=3) * 0.05, *rng.normal(size=(2, 3)) * 0.02
    n = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    third = rng.normal(size=(2, 3)) * 0.01
    third -= np.outer(third @ n, n)
    a = at + np.array([u * rng.uniform(0.2, 1), -u * rng.uniform(0.2, 1), third[0] + n * rng.uniform(0.002, 0.02)])
    b = at + np.array([v * rng.uniform(0.2, 1), -v * rng.uniform(0.2, 1), third[1] - n * rng.uniform(0.002, 0.02)])
    # The edges' cross product looks from one to the other, or back.
    return (a, b) if rng.random() < 0.5 else (a[[1, 0, 2]], b)


def corner_on_corner(rng):
    """Return two triangles that share a corner and lie on opposite sides of a plane."""
    at, n = rng.normal(size=3) * 0.05, rng.normal(size=3)
    n /= np.linalg.norm(n)
    spread = rng.normal(size=(2, 2, 3)) * 0.02
    spread -= (spread @ n)[..., None] * n
    a = at + np.vstack([np.zeros(3), spread[0] + n * rng.uniform(0.001, 0.02, (2, 1))])
    b = at + np.vstack([np.zeros(3), spread[1] - n * rng.uniform(0.001, 0.02, (2, 1))])
    return a, b


@pytest.mark.parametrize("touching", [corner_on_face, edge_on_edge, corner_on_corner])
@given(seed=st.integers(0, 10**6), swapped=st.booleans(), back=st.booleans())
@settings(max_examples=150, deadline=None)
def test_triangles_part_or_stop(touching, seed, swapped, back):
    a, b = touching(np.random.default_rng(seed))
    if swapped:
        a, b = b, a
    rate = -1.0 if back else 1.0
    gaps = [apart(turned(a, rate * s), b) for s in (1e-6, 1e-5, 1e-4)]
    found = sweep(a, b, rate=rate)
    if min(gaps) > 1e-9:
        assert found > 1e-5
    elif max(gaps) < -1e-9:
        assert found < 1e-6
    if 0.0 < found < BEST:
        assert apart(turned(a, rate * found), b) > -1e-9


def test_edges_that_part_while_the_plane_along_both_goes_through_the_axis_of_z():
    """The part of its normal along z changes its sign on the first step, which is a few millionths of a radian."""
    parted = 0
    for seed in range(400):
        rng = np.random.default_rng([8, seed])
        angle = rng.uniform(0.0, 7.0)
        n = np.array([np.cos(angle), np.sin(angle), rng.uniform(-1e-5, 1e-5)])
        n /= np.linalg.norm(n)
        u, v, *rest = (w - (w @ n) * n for w in rng.normal(size=(4, 3)) * 0.02)
        at = rng.normal(size=3) * 0.05
        a = at + np.array([u * rng.uniform(0.2, 1), -u * rng.uniform(0.2, 1), rest[0] + n * rng.uniform(0.002, 0.02)])
        b = at + np.array([v * rng.uniform(0.2, 1), -v * rng.uniform(0.2, 1), rest[1] - n * rng.uniform(0.002, 0.02)])
        if min(apart(turned(a, s), b) for s in (1e-6, 1e-5, 1e-4)) > 1e-9:
            assert sweep(a, b) > 1e-5
            parted += 1
    assert parted > 100


@pytest.mark.parametrize("rate", [1.0, -1.0])
@pytest.mark.parametrize("behind", [-0.01, 0.03])
def test_a_face_on_both_sides_of_its_pivot_tilts_off_a_ball(rate, behind):
    face = np.array([[behind, -0.01, 0.0], [0.06, -0.01, 0.0], [0.06, 0.01, 0.0]])
    ball = np.array([[0.05, -0.002, 0.01]])
    found = sweep(face, ball, w=0.01, rate=rate)
    assert found == (BEST if rate < 0.0 else 0.0)


def test_sides_of_boxes_edge_to_edge():
    a = np.array([[0.02, -0.01, 0.0], [0.02, 0.01, 0.0], [0.03, 0.0, 0.0]])
    b = np.array([[0.02, -0.01, 0.0], [0.02, 0.012, 0.0], [0.02, 0.0, -0.01]])
    assert sweep(a, b) == BEST
    assert sweep(a, b, rate=-1.0) < 1e-6


def test_sides_of_boxes_corner_to_corner_in_one_plane_part():
    a = np.array([[0.02, 0.0, 0.0], [0.02, 0.01, 0.0], [0.03, 0.0, 0.0]])
    b = np.array([[0.02, 0.0, 0.0], [0.02, -0.01, 0.0], [0.01, 0.0, 0.0]])
    assert sweep(a, b) == BEST
    assert sweep(a, b, rate=-1.0) == BEST


@pytest.mark.parametrize("count", [1, 2])
def test_a_wall_across_the_axis_stops_nothing_that_slides_along_it(count):
    wall = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 0.0, 2.0]])
    core = np.array([[0.01, 1e-9, 0.0], [0.05, 0.01, 0.0], [0.05, 0.01, 0.01]])
    chain = np.array([[1.0, 0.02, 0.0], [1.8, 0.0, 0.0]])[2 - count :]
    found = sweep_pair(core, 3, wall, 3, 0.0, chain, count, TOUCH, 0.0, BEST, np.zeros((6, 3)))
    assert found == BEST


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("turn", [0.05, 0.3, 1.2])
def test_what_slides_on_a_wall_is_not_stopped_by_a_side_of_one_of_its_triangles(count, flat, turn):
    """The wall lies across the axis; the core comes from beside the triangle, with a corner or a face on the wall."""
    height = 0.0 if flat else 0.01
    core = np.array([[0.05, 0.0, 0.0], [0.05, height, -0.01], [0.03, height, 0.0]])
    c, d = np.cos(turn), np.sin(turn)
    wall = np.array([[0.0, 0.0, 0.0], [0.1 * c, 0.0, 0.1 * d], [-0.05, 0.0, 0.1]])
    chain = np.array([[0.7, 0.001, 0.0], [1.0, 0.0, 0.0]])[2 - count :]
    found = sweep_pair(core, 3, wall, 3, 0.0, chain, count, TOUCH, 0.0, 2.0, np.zeros((6, 3)))
    assert found == 2.0


def test_what_slides_on_a_wall_stops_at_a_step_of_it():
    core = np.array([[0.05, 0.0, 0.0], [0.05, 0.01, -0.01], [0.03, 0.01, 0.0]])
    step = np.array([[0.0, -0.01, 0.03], [0.1, -0.01, 0.03], [0.05, 0.01, 0.03]])
    found = sweep(core, step, best=2.0)
    assert found == pytest.approx(np.arcsin(0.6), abs=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_corner_that_comes_down_stops_what_another_corner_lets_go(seed):
    """One corner lies on a wide face and leaves it or slides; on two joints, another comes down as the core tilts."""
    rng = np.random.default_rng(seed)
    tilting = 0
    for _ in range(300):
        chain = np.array([[rng.uniform(-1.0, 1.0), *rng.normal(size=2) * 0.03], [rng.uniform(-1.0, 1.0), 0.0, 0.0]])
        at = rng.normal(size=2) * 0.03
        rise = [0.0, rng.uniform(1e-4, 0.01), 0.03]
        core = np.array([[at[0] + rng.uniform(-0.03, 0.03) * (k > 0), 0.01 * k, at[1] + rise[k]] for k in range(3)])
        below = chain[0, 2] + core[0, 2]
        face = np.array([[-1.0, -1.0, below], [1.0, -1.0, below], [0.0, 2.0, below]])
        found = sweep_pair(core, 3, face, 3, 0.0, chain, 2, TOUCH, 0.0, 1.5, np.zeros((6, 3)))
        s = np.linspace(0.0, found, 300)[:, None]
        base = np.sin(chain[0, 0] * s) * chain[0, 1] + np.cos(chain[0, 0] * s) * chain[0, 2]
        heights = base + np.sin(chain[1, 0] * s) * core[:, 0] + np.cos(chain[1, 0] * s) * core[:, 2] - below
        assert heights.min() > -1e-10
        tilting += 0.0 < found < 1.5 and heights[-1].argmin() > 0
    assert tilting > 5
