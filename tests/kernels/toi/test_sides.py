"""How far items of two bodies lie apart along a direction: elements exactly, nodes no farther than what they hold."""

import numpy as np
import pytest

from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.toi import sides as measured
from kernels.kernel_entries import entry
from kernels.toi.test_toi_bodies import pose

sides_of, gap_over, span = entry(measured.sides_of), entry(measured.gap_over), entry(measured.span)


def soup(rng, count):
    """Return a body of triangles, segments and points, each grown."""
    points = rng.normal(size=(3 * count, 3))
    elements = np.arange(3 * count).reshape(count, 3)
    elements[::3, 2] = elements[::3, 1]
    elements[1::3, 1:] = elements[1::3, :1]
    return pack_bodies([Elements(points, elements.astype(np.int32), rng.uniform(0.0, 0.1, count))])


def held(body, item):
    """Return the elements that an item holds."""
    if item < 0:
        return [-1 - item]
    if body.count[item]:
        return range(body.first[item], body.first[item] + body.count[item])
    return [*held(body, item + 1), *held(body, body.right[item])]


def extent(body, item, T, n):
    along = [
        ((body.vertices[body.elements[e]] @ T[:, :3].T + T[:, 3]) @ n)[:, None] + [-body.radius[e], body.radius[e]]
        for e in held(body, item)
    ]
    return np.vstack(along).min(), np.vstack(along).max()


@pytest.mark.parametrize("seed", range(8))
def test_items_are_as_far_apart_as_seen(seed):
    rng = np.random.default_rng(seed)
    one, other = soup(rng, 24), soup(rng, 15)
    T, R = pose(rng, rng.normal(size=3)), pose(rng, rng.normal(size=3))
    tight = 0
    for _ in range(60):
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        sides = sides_of(tuple(n), T, R)
        a = int(rng.integers(-len(one.elements), len(one.node)))
        b = int(rng.integers(-len(other.elements), len(other.node)))
        seen, true = gap_over(one, a, other, b, sides), extent(one, a, T, n)[0] - extent(other, b, R, n)[1]
        assert seen <= true + 1e-12
        if a < 0 and b < 0:
            assert seen == pytest.approx(true, abs=1e-12)
            tight += 1
        low, high = span(one, a, *sides.one)
        assert low + T[:, 3] @ n <= extent(one, a, T, n)[0] + 1e-12
        assert high + T[:, 3] @ n >= extent(one, a, T, n)[1] - 1e-12
    assert tight > 3
