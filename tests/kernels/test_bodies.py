"""The balls of a body's tree hold what lies below them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.bodies import Elements, pack_bodies


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
