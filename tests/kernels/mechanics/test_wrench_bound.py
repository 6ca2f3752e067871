"""The ball of wrenches that the closed form promises is resisted: linear programs find forces for all of it."""

import numpy as np
import pytest
from scipy.optimize import linprog

from clench.kernels.mechanics.wrench_bound import resisted_ball

EDGES = 6


def around_a_ball(count, friction):
    """Return grasp map, edges, faces and reach of fingers around a ball of radius 1, and some torsion."""
    angles = np.arange(EDGES) * 2.0 * np.pi / EDGES
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    half = angles + np.pi / EDGES
    edges = np.column_stack([np.ones(EDGES), friction * ring, np.zeros(EDGES)])
    edges = np.vstack([edges, [[1.0, 0.0, 0.0, 0.1], [1.0, 0.0, 0.0, -0.1]]])
    # A pyramid over a ring, and two tips along the torsion: |t| / friction + |torsion| / 0.1 <= normal force.
    faces = []
    for a in half:
        out = np.array([np.cos(a), np.sin(a)]) / (friction * np.cos(np.pi / EDGES))
        faces += [[1.0, *-out, -10.0], [1.0, *-out, 10.0]]
    G = np.zeros((6, 4 * count))
    rng = np.random.default_rng(count)
    for i in range(count):
        turn = 2.0 * np.pi * i / count
        p = np.array([np.cos(turn), np.sin(turn), 0.3 * (-1.0) ** i])
        p /= np.linalg.norm(p)
        u = np.cross(p, rng.normal(size=3))
        u /= np.linalg.norm(u)
        for k, axis in enumerate((-p, u, np.cross(-p, u))):
            G[:3, 4 * i + k], G[3:, 4 * i + k] = axis, np.cross(p, axis)
        G[3:, 4 * i + 3] = -p
    reach = np.tile([1.0, friction, friction, 0.1], (count, 1))
    return G, np.tile(edges, (count, 1, 1)), np.tile(np.array(faces), (count, 1, 1)), reach


def resists(G, edges, caps, most, wrench):
    """Say whether forces inside the cones, capped, exert a wrench."""
    count, each, width = edges.shape
    spread = np.zeros((count * width, count * each))
    for i in range(count):
        spread[i * width : (i + 1) * width, i * each : (i + 1) * each] = edges[i].T
    bounded = np.vstack([caps @ spread, -caps @ spread])
    found = linprog(
        np.zeros(count * each), A_ub=bounded, b_ub=np.tile(most, 2), A_eq=G @ spread, b_eq=wrench, bounds=(0, None)
    )
    return found.status == 0


@pytest.mark.parametrize(("count", "friction"), [(3, 0.5), (4, 0.3), (5, 0.8)])
def test_what_is_promised_is_resisted_in_every_direction(count, friction):
    G, edges, faces, reach = around_a_ball(count, friction)
    caps, most = np.zeros((count, 4 * count)), np.full(count, 2.0)
    caps[np.arange(count), 4 * np.arange(count)] = 1.0
    found = resisted_ball(G, edges, faces, reach, caps, most, 4)
    assert found > 0.01
    rng = np.random.default_rng(0)
    wrenches = rng.normal(size=(60, 6))
    wrenches /= np.linalg.norm(wrenches, axis=1, keepdims=True)
    assert all(resists(G, edges, caps, most, 0.999 * found * w) for w in wrenches)
    # It is a bound, and not a bad one; what the caps allow grows with them; more rounds lose nothing.
    assert not all(resists(G, edges, caps, most, 4.0 * found * w) for w in wrenches)
    assert resisted_ball(G, edges, faces, reach, caps, 3.0 * most, 4) == pytest.approx(3.0 * found, rel=1e-9)
    assert found >= resisted_ball(G, edges, faces, reach, caps, most, 1)


def test_nothing_is_promised_where_nothing_is_resisted():
    G, edges, faces, reach = around_a_ball(3, 0.5)
    caps, most = np.ones((1, 12)), np.ones(1)
    # One finger cannot balance; two of them exert no torque about the line between them without torsion.
    # Copies, as the kernel would be compiled anew for views.
    one, few = np.ascontiguousarray(G[:, :4]), np.ascontiguousarray(caps[:, :4])
    assert resisted_ball(one, edges[:1], faces[:1], reach[:1], few, most, 3) == 0.0
    flat = np.ascontiguousarray(G[:, [0, 1, 2, 3] * 3])
    assert resisted_ball(flat, edges, faces, reach, caps, most, 3) == 0.0
    # Without caps there is no largest wrench.
    assert resisted_ball(G, edges, faces, reach, caps[:0], most[:0], 3) == np.inf
