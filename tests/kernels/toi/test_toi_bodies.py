"""Bodies of many elements: what their trees leave out changes nothing, against every pair of elements by itself."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.toi import core_motion, pair_queue
from clench.kernels.toi import separating_planes as parting
from clench.kernels.toi import toi_work as sweeping
from clench.kernels.toi.separating import OVERLAP
from kernels.kernel_entries import entry
from kernels.plain_sweeps import sweep_body, sweep_pair
from kernels.toi.test_spatial_motion import drawn

make_sweep_work = entry(sweeping.make_sweep_work)
take_first, take_in = entry(pair_queue.take_first), entry(pair_queue.take_in)
passes_beside, move_core = entry(parting.passes_beside), entry(core_motion.move_core)
TOUCH = 1e-10


def patch(rng, kind, count):
    """Return elements about the origin: a soup, slivers side by side around a cylinder, a sheet, or rods and balls."""
    if kind == "slivers":
        angles = np.linspace(0.0, 2.0 * np.pi, count + 1)[:-1]
        ring = np.column_stack([np.cos(angles), np.sin(angles)]) * 0.01
        points = np.vstack([np.column_stack([ring, np.full(count, z)]) for z in (-0.03, 0.03)])
        k = np.arange(count)
        m = (k + 1) % count
        return Elements(
            points, np.vstack([np.c_[k, m, k + count], np.c_[m, m + count, k + count]]), np.zeros(2 * count)
        )
    if kind == "sheet":
        side = int(np.sqrt(count)) + 2
        x, y = (v.ravel() for v in np.meshgrid(*[np.linspace(-0.03, 0.03, side)] * 2))
        k = np.array([i * side + j for i in range(side - 1) for j in range(side - 1)])
        points = np.column_stack([x, y, 2.0 * (x**2 - y**2)])
        triangles = np.vstack([np.c_[k, k + 1, k + side], np.c_[k + 1, k + side + 1, k + side]])
        return Elements(points, triangles, np.zeros(len(triangles)))
    points = rng.normal(size=(3 * count, 3)) * 0.015
    elements = np.arange(3 * count).reshape(count, 3)
    if kind == "soup":
        middle = np.repeat(points[::3], 3, axis=0)
        return Elements(middle + 0.3 * (points - middle), elements, np.zeros(count))
    elements[:, 2] = elements[:, 1]
    elements[::3, 1:] = elements[::3, :1]
    points = np.repeat(points[::3], 3, axis=0) + 0.2 * points
    return Elements(points, elements, rng.uniform(0.0005, 0.004, count))


def cores(bodies, T):
    """Return every element: its corners where a pose puts them, (3, 3), how many differ, and its radius."""
    for e in range(len(bodies.elements)):
        corners = bodies.vertices[bodies.elements[e]] @ T[:, :3].T + T[:, 3]
        yield np.ascontiguousarray(corners), int(bodies.corners[e]), float(bodies.radius[e])


def pose(rng, at):
    return np.column_stack([Rotation.random(rng=rng).as_matrix(), at])


def drawn_chain(seed, rng):
    """Return one joint, several about one direction, or several about any; the middle of its way to a body."""
    if seed % 3 == 0:
        return np.array([[float(rng.choice([-1.0, 1.0])), 0.0, 0.0]])
    if seed % 3 == 1:
        return np.column_stack([rng.uniform(-1.5, 1.5, 2), rng.uniform(-0.04, 0.04, (2, 2))])
    return drawn(seed)[1]


KINDS = ["soup", "slivers", "sheet", "round"]


@pytest.mark.parametrize("one", KINDS)
@pytest.mark.parametrize("other", KINDS)
def test_a_body_meets_what_the_first_of_its_elements_meets(one, other):
    met = 0
    for seed in range(18):
        rng = np.random.default_rng([seed, KINDS.index(one), KINDS.index(other)])
        moving = pack_bodies([patch(rng, one, int(rng.integers(1, 16)))])
        resting = pack_bodies([patch(rng, other, int(rng.integers(1, 24)))])
        chain, best = drawn_chain(seed, rng), float(rng.uniform(0.5, 2.0))
        work = make_sweep_work(8, 0)
        away, beside = rng.normal(size=(2, 3))
        work.moving[:] = pose(rng, 0.15 * away / np.linalg.norm(away))
        # What rests is near the way of what moves, so that it is met more often than not.
        on_the_way = np.zeros((6, 3))
        move_core(np.tile(work.moving[:, 3], (3, 1)), 1, chain, len(chain), 0.6 * best, on_the_way)
        work.resting[:] = pose(rng, on_the_way[0] + 0.02 * beside / np.linalg.norm(beside))
        found = sweep_body(moving, 0, resting, 0, chain, len(chain), TOUCH, best, work)
        expected, others = best, list(cores(resting, work.resting))
        for a, ka, wa in cores(moving, work.moving):
            for b, kb, wb in others:
                each = sweep_pair(a, ka, b, kb, wa + wb, chain, len(chain), TOUCH, 0.0, best, np.zeros((6, 3)))
                expected = min(expected, each)
        assert found == pytest.approx(expected, abs=1e-6), (seed, found, expected)
        assert (found == OVERLAP) == (expected == OVERLAP)
        met += 0.0 < found < best
    assert met >= 4


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_what_passes_beside_does_so_wherever_it_turns(seed):
    """Extents along y of elements, and of the boxes around all of them, from a body's corners."""
    rng = np.random.default_rng(seed)
    bodies = [pack_bodies([patch(rng, KINDS[rng.integers(4)], 12)]) for _ in range(2)]
    work = make_sweep_work(8, 0)
    work.moving[:], work.resting[:] = pose(rng, np.zeros(3)), pose(rng, [0.0, rng.uniform(-0.1, 0.1), 0.0])
    spans = []
    for body, T in zip(bodies, (work.moving, work.resting), strict=True):
        rows = [(c[:, 1].min() - w, c[:, 1].max() + w) for c, _, w in cores(body, T)]
        spans.append((min(r[0] for r in rows), max(r[1] for r in rows), rows))
    (low, high, first), (least, most, second) = spans
    assert passes_beside(bodies[0], -1, bodies[1], -1, work) == (
        first[0][0] > second[0][1] or second[0][0] > first[0][1]
    )
    if passes_beside(bodies[0], 0, bodies[1], 0, work):
        assert low > most or least > high
    if max(least - high, low - most) > 0.06:  # farther than any box reaches beyond what it holds
        assert passes_beside(bodies[0], 0, bodies[1], 0, work)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.0, 4.0), min_size=1, max_size=60))
def test_a_queue_gives_the_earliest_first(keys):
    work, size = make_sweep_work(8, 0), 0
    for k, key in enumerate(keys):
        row = 300
        work.keys[row], work.since[row], work.stack[row] = key, -key, (k, 2 * k, k % 2)
        size = take_in(work, size, row)
    given_back = []
    while size:
        size = take_first(work, size)
        k = work.stack[size, 0]
        assert (work.keys[size], work.since[size]) == (keys[k], -keys[k])
        assert tuple(work.stack[size]) == (k, 2 * k, k % 2)
        given_back.append(keys[k])
    assert given_back == sorted(keys)


@pytest.mark.parametrize("rate", [1.0, -1.0])
@pytest.mark.parametrize("joints", [1, 2])
def test_what_touches_at_the_start_does_not_hide_what_overlaps(rate, joints):
    """Tents stand on a floor, which leaves nowhere to go; another one goes through it."""
    grid = np.linspace(0.0, 1.0, 6)
    floor = np.column_stack([0.02 + 0.18 * np.repeat(grid, 6), 0.1 * np.tile(grid, 6) - 0.05, np.zeros(36)])
    k = np.array([6 * i + j for i in range(5) for j in range(5)])
    resting = pack_bodies(
        [Elements(floor, np.vstack([np.c_[k, k + 1, k + 6], np.c_[k + 1, k + 7, k + 6]]), np.zeros(50))]
    )
    tent = np.array([[0.0, 0.0, 0.0], [0.004, 0.002, 0.01], [-0.003, 0.004, 0.01]])
    chain = np.array([[0.1 * rate, 0.01, 0.0], [rate, 0.0, 0.0]])[2 - joints :]
    for seed in range(60):
        rng = np.random.default_rng(seed)
        feet = np.column_stack([rng.uniform([0.04, -0.04], [0.19, 0.04], (12, 2)), np.zeros(12)])
        feet[-1, 2] = -0.004
        moving = pack_bodies(
            [Elements((feet[:, None] + tent).reshape(-1, 3), np.arange(36).reshape(12, 3), np.zeros(12))]
        )
        work = make_sweep_work(8, 0)
        work.moving[:] = work.resting[:] = np.eye(4)[:3]
        assert sweep_body(moving, 0, resting, 0, chain, joints, TOUCH, 1.0, work) == OVERLAP
        assert sweep_body(moving, 0, resting, 0, chain, joints, TOUCH, 0.0, work) == OVERLAP


def crowded():
    """Return how far a body of rods goes behind four joints before it meets another one, see `crowded.json`."""
    given = json.loads((Path(__file__).parent / "crowded.json").read_text())
    bodies = []
    for part in (given["moving"], given["resting"]):
        corners = np.array(part["corners"])
        elements = np.arange(3 * len(corners)).reshape(-1, 3)
        bodies.append(pack_bodies([Elements(corners.reshape(-1, 3), elements, np.array(part["radius"]))]))
    work, chain = make_sweep_work(8, 0), np.array(given["chain"])
    work.moving[:], work.resting[:] = given["T_moving"], given["T_resting"]
    return sweep_body(bodies[0], 0, bodies[1], 0, chain, len(chain), given["touch"], given["best"], work)


def test_what_does_not_fit_the_queue_is_met_as_well():
    """With room for two pairs in the queue, interpreted, as the room of compiled kernels is fixed."""
    code = (
        "from clench.kernels.toi import toi_bodies; from kernels.toi import test_toi_bodies; "
        "toi_bodies.QUEUE = 2; print(test_toi_bodies.crowded())"
    )
    tests = str(Path(__file__).parents[2])
    path = os.pathsep.join([tests, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": path}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert float(done.stdout) == pytest.approx(2.178088, abs=1e-6)
    assert crowded() == pytest.approx(2.178088, abs=1e-6)
