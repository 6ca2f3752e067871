"""The moments of a node are those of its triangles, as cubature over each of them gives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.trees.bvh import build_tree
from clench.kernels.trees.node_moments import AREA, COLUMNS, RADIUS, SECOND, SPREAD, VECTOR


def triangles_below(tree, node):
    leaves = [n for n in range(node, tree.skip[node]) if tree.count[n]]
    return tree.vertices[
        np.concatenate([tree.triangles[tree.first[n] : tree.first[n] + tree.count[n]] for n in leaves])
    ]


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 60), st.integers(0, 2**31), st.sampled_from([1e-3, 1.0, 1e3]), st.sampled_from([0.0, 1.0, 1e3]))
def test_moments_are_integrals(size, seed, scale, away):
    rng = np.random.default_rng(seed)
    vertices = (rng.normal(size=(size + 2, 3)) + away) * scale
    tree = build_tree(vertices, rng.integers(0, size + 2, (size, 3)), is_open=True)
    assert tree.moments.shape == (len(tree.low), COLUMNS)
    for node, row in enumerate(tree.moments):
        corners = triangles_below(tree, node) - row[:3]
        a, b, c = corners.transpose(1, 0, 2)
        vector = 0.5 * np.cross(b - a, c - a)
        area = np.linalg.norm(vector, axis=1)
        # Three points integrate polynomials of degree two over a triangle exactly.
        at = np.stack([0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)], axis=1)
        small = 1e-9 * scale
        assert row[AREA] == pytest.approx(area.sum(), abs=small * scale)
        np.testing.assert_allclose(row[VECTOR : VECTOR + 3], vector.sum(axis=0), atol=small * scale)
        second = np.einsum("tki,tj->ij", at, vector) / 3.0
        second = 0.5 * (second + second.T) - np.trace(second) / 3.0 * np.eye(3)
        expected = [second[0, 0], second[1, 1], second[2, 2], second[0, 1], second[0, 2], second[1, 2]]
        np.testing.assert_allclose(row[SECOND : SECOND + 6], expected, atol=small * scale**2)
        spread = (np.einsum("tkj,tkj->t", at, at) / 3.0) @ area
        # Far from the origin, coordinates round more, and the bound leaves room for it.
        room = 1e-11 * area.sum() * row[RADIUS] * np.abs(vertices).max()
        assert spread * (1.0 - 1e-13) <= row[SPREAD] <= spread * (1.0 + 1e-9) + room
        # The centre is the centre of area: sums of spreads of children rely on it.
        np.testing.assert_allclose(np.einsum("tkj,t->j", at, area) / 3.0, 0.0, atol=small * scale**2)
        lengths = np.linalg.norm(corners.reshape(-1, 3), axis=1)
        assert lengths.max() <= row[RADIUS] <= np.linalg.norm(tree.high[node] - tree.low[node]) * (1.0 + 1e-12)


def test_triangles_without_area_have_a_centre():
    tree = build_tree(np.array([[0.0, 0.0, 0.0], [2.0, 4.0, 6.0]]), [[0, 1, 1], [0, 0, 1]], is_open=True)
    np.testing.assert_array_equal(tree.moments[0, :3], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(tree.moments[0, 3:14], 0.0)
    assert tree.moments[0, RADIUS] == pytest.approx(np.sqrt(14.0))


def test_only_open_meshes_of_usual_size_have_moments():
    vertices = np.eye(3)
    assert build_tree(vertices, [[0, 1, 2]]).moments.shape == (0, COLUMNS)
    assert build_tree(np.empty((0, 3)), np.empty((0, 3)), is_open=True).moments.shape == (0, COLUMNS)
    assert build_tree(np.zeros((3, 3)), [[0, 1, 2]], is_open=True).moments.shape == (0, COLUMNS)
    for scale, rows in ((1e-31, 0), (1e-29, 1), (1e29, 1), (1e31, 0)):
        assert build_tree(vertices * scale, [[0, 1, 2]], is_open=True).moments.shape == (rows, COLUMNS)
