"""The tree holds every triangle once, in boxes that nest, for any mesh."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from clench.kernels.geometry.bodies import pack_triangles
from clench.kernels.trees import bvh, node_boxes, tree_growth
from clench.kernels.trees.bvh import LEAF_SIZE, STACK_SIZE, build_tree, feature_owners
from clench.kernels.trees.connectivity import connected_parts, owned_features
from kernels.kernel_solids import ball, torus


def depth_of(tree, node=0):
    todo, deepest = [(node, 1)], 0
    while todo:
        node, depth = todo.pop()
        deepest = max(deepest, depth)
        if tree.count[node] == 0:
            todo += [(node + 1, depth + 1), (tree.right[node], depth + 1)]
    return deepest


def check(tree, vertices, triangles):
    assert sorted(tree.original) == list(range(len(triangles)))
    np.testing.assert_array_equal(tree.triangles, np.asarray(triangles)[tree.original])
    covered = np.zeros(len(triangles), dtype=int)
    for node in range(len(tree.low)):
        if tree.count[node]:
            assert tree.count[node] <= LEAF_SIZE
            assert tree.skip[node] == node + 1
            mine = slice(tree.first[node], tree.first[node] + tree.count[node])
            covered[mine] += 1
            corners = tree.vertices[tree.triangles[mine]].reshape(-1, 3)
            np.testing.assert_array_equal(tree.low[node], corners.min(axis=0))
            np.testing.assert_array_equal(tree.high[node], corners.max(axis=0))
        else:
            children = [node + 1, tree.right[node]]
            assert tree.skip[children[0]] == children[1]
            assert tree.skip[node] == tree.skip[children[1]]
            np.testing.assert_array_equal(tree.low[node], tree.low[children].min(axis=0))
            np.testing.assert_array_equal(tree.high[node], tree.high[children].max(axis=0))
    assert (covered == 1).all()
    assert depth_of(tree) <= STACK_SIZE


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 200), st.integers(0, 2**31), st.sampled_from([1e-6, 1.0, 1e3]))
def test_tree_holds_random_triangles(size, seed, scale):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(size + 2, 3)) * scale
    triangles = rng.integers(0, size + 2, (size, 3))
    check(build_tree(vertices, triangles), vertices, triangles)


@pytest.mark.parametrize("spread", ["same place", "line", "geometric"])
def test_depth_is_bounded_for_awkward_spreads(spread):
    size = 3000
    offsets = np.zeros((size, 3))
    if spread == "line":
        offsets[:, 1] = np.arange(size)
    if spread == "geometric":
        offsets[:, 2] = 2.0 ** -np.minimum(np.arange(size), 1000.0)
    vertices = (offsets[:, None] + np.eye(3)[None] * 1e-9).reshape(-1, 3)
    triangles = np.arange(3 * size).reshape(-1, 3)
    check(build_tree(vertices, triangles), vertices, triangles)


def test_empty_mesh_has_no_nodes():
    tree = build_tree(np.empty((0, 3)), np.empty((0, 3), dtype=int))
    assert len(tree.low) == len(tree.triangles) == len(feature_owners(tree)) == 0


def test_normals_point_outwards_and_are_zero_without_area():
    mesh = ball(2)
    tree = build_tree(mesh.vertices, mesh.triangles)
    centers = tree.vertices[tree.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", tree.normals, centers) > 0.9).all()
    np.testing.assert_allclose(np.linalg.norm(tree.normals, axis=1), 1.0, atol=1e-15)
    needle = build_tree([[0, 0, 0], [1, 2, 3], [2, 4, 6]], [[0, 1, 2]])
    np.testing.assert_array_equal(needle.normals, np.zeros((1, 3)))


def test_bodies_follow_their_triangles():
    mesh = ball(3)
    body = np.arange(len(mesh.triangles)) % 7
    tree = build_tree(mesh.vertices, mesh.triangles, body)
    np.testing.assert_array_equal(tree.body, body[tree.original])


def test_every_feature_has_one_owner():
    mesh = torus(2.0, 0.5)
    tree = build_tree(mesh.vertices, mesh.triangles)
    owners = feature_owners(tree)
    vertices, edges = [], []
    for mask, triangle in zip(owners, tree.triangles, strict=True):
        for k in range(3):
            if mask & (1 << k):
                vertices.append(triangle[k])
            if mask & (8 << k):
                edges.append(tuple(sorted((triangle[k], triangle[(k + 1) % 3]))))
    assert sorted(vertices) == list(range(len(mesh.vertices)))
    sides = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert sorted(edges) == sorted(map(tuple, np.unique(sides, axis=0).tolist()))


@pytest.mark.parametrize(
    ("vertices", "triangles", "body", "message"),
    [
        ([[0, 0, np.nan]], [[0, 0, 0]], None, "finite"),
        ([[0, 0, 0]], [[0, 0, 1]], None, "from 0 to 0"),
        ([[0, 0, 0]], [[0, -1, 0]], None, "from 0 to 0"),
        ([[0, 0, 0]], [[0, 0, 0]], [1, 2], "one per triangle"),
    ],
)
def test_bad_input_is_refused(vertices, triangles, body, message):
    with pytest.raises(ValueError, match=message):
        build_tree(vertices, triangles, body)


@pytest.mark.parametrize("threads", [1, 3])
def test_a_tree_has_the_same_bits_for_any_number_of_threads(monkeypatch, threads):
    """A large mesh is parted into works for threads; the result is that of parting it in one."""
    rng = np.random.default_rng(7)
    count = 2000
    vertices = np.cumsum(rng.normal(size=(count + 2, 3)), axis=0)
    triangles = rng.permutation(np.arange(count)[:, None] + np.arange(3))
    whole = pack_triangles(build_tree(vertices, triangles))
    monkeypatch.setattr(tree_growth, "_PART", 100)
    monkeypatch.setattr(tree_growth, "ROWS", 300)
    monkeypatch.setattr(node_boxes, "_NODES", 50)
    for module in (tree_growth, node_boxes, bvh):
        monkeypatch.setattr(module, "core_count", lambda: threads)
    tree = build_tree(vertices, triangles)
    check(tree, vertices, triangles)
    parted = pack_triangles(tree)
    # Triangles of a mesh have no hulls, and no grid yet: the last fields.
    assert len(parted.hulls.points) == len(whole.hulls.points) == 0
    for name, mine, other in zip(parted._fields[:-2], parted, whole, strict=False):
        np.testing.assert_array_equal(mine, other, err_msg=name)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 60), st.integers(3, 40), st.integers(0, 2**31))
def test_parts_are_those_that_common_vertices_connect(size, count, seed):
    triangles = np.random.default_rng(seed).integers(0, count, (size, 3))
    pairs = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    assert connected_parts(triangles, count).tolist() == [int(np.argmax(label == each)) for each in label]


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 60), st.integers(3, 12), st.integers(0, 2**31))
def test_the_first_triangle_with_a_feature_owns_it(size, count, seed):
    triangles = np.random.default_rng(seed).integers(0, count, (size, 3)).astype(np.int32)
    seen, masks = set(), np.zeros(size, dtype=np.uint8)
    for t, triangle in enumerate(triangles.tolist()):
        sides = [(triangle[k], triangle[(k + 1) % 3]) for k in range(3)]
        features = [*((v,) for v in triangle), *((*sorted(side), "edge") for side in sides)]
        for bit, feature in enumerate(features):
            masks[t] |= 0 if feature in seen else 1 << bit
            seen.add(feature)
    np.testing.assert_array_equal(owned_features(triangles, count), masks)
