"""The balls of a body's tree hold what lies below them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.memory import AT_ONCE
from clench.kernels.geometry.bodies import Elements, pack_bodies, pack_triangles
from clench.kernels.trees.bvh import build_tree


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 60), st.integers(0, 2**31), st.booleans())
def test_a_nodes_ball_holds_all_its_elements_and_no_more_than_its_box_and_largest_radius(count, seed, round_ones):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(3 * count, 3))
    elements = rng.integers(0, 3 * count, size=(count, 3)).astype(np.int32)
    radius = rng.random(count) if round_ones else np.zeros(count)
    other = Elements(vertices[:3], np.array([[0, 1, 2]], dtype=np.int32), np.array([0.5]))
    body = pack_bodies([other, Elements(vertices, elements, radius)])

    def below(node):
        if body.right[node] < 0:
            return list(range(body.first[node], body.first[node] + body.count[node]))
        return below(node + 1) + below(body.right[node])

    nodes = range(body.root[1], len(body.node))
    for node in nodes:
        members = below(node)
        points = body.vertices[body.elements[members]]
        center, reach = body.node[node, :3], body.node[node, 3]
        assert (np.linalg.norm(points - center, axis=2) + body.radius[members, None] <= reach).all()
        box = points.reshape(-1, 3)
        largest = 0.5 * np.linalg.norm(np.ptp(box, axis=0)) + body.radius[members].max()
        assert reach <= largest * (1.0 + 1e-9)
    assert sorted(below(body.root[1])) == list(range(1, count + 1))


@pytest.mark.parametrize("count", [0, 1, 7, AT_ONCE + 5])
def test_triangles_of_a_tree_are_the_body_of_the_same_triangles(count):
    rng = np.random.default_rng(count)
    vertices = rng.normal(size=(count + 3, 3))
    triangles = rng.integers(0, count + 3, size=(count, 3)).astype(np.int32)
    found = pack_triangles(build_tree(vertices, triangles))
    expected = pack_bodies([Elements(vertices, triangles, np.zeros(count))])
    for name, mine, other in zip(found._fields[:-2], found, expected, strict=False):
        assert mine.dtype == other.dtype, name
        assert np.array_equal(mine, other), name


def test_a_body_of_many_elements_has_each_ones_ball_and_the_box_around_all():
    rng = np.random.default_rng(3)
    count = AT_ONCE + 100
    vertices, radius = rng.normal(size=(count + 2, 3)), rng.random(count)
    elements = np.column_stack([np.arange(count) + k for k in range(3)]).astype(np.int32)
    elements[::3, 2] = elements[::3, 1]
    body = pack_bodies([Elements(vertices, elements, radius)])
    assert np.array_equal(body.corners, np.where(body.source % 3 == 0, 2, 3))
    away = np.linalg.norm(body.vertices[body.elements] - body.ball[:, None, :3], axis=2).max(axis=1)
    assert np.allclose(body.ball[:, 3], away + body.radius, rtol=1e-9)
    points = vertices[elements]
    low, high = body.box[0, :3] - body.box[0, 3:], body.box[0, :3] + body.box[0, 3:]
    assert np.allclose(low, (points - radius[:, None, None]).min(axis=(0, 1)), atol=1e-8)
    assert np.allclose(high, (points + radius[:, None, None]).max(axis=(0, 1)), atol=1e-8)
