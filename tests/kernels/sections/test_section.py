"""Sections equal those of independent engines, and the table of signs holds."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clench.kernels.sections.section import cut, cut_mesh
from clench.kernels.trees.bvh import build_tree
from clench.models.mesh import TriangleMesh
from kernels.kernel_solids import ball, box, hull, moved, star, torus

IDENTITY = np.eye(4)


def lengths(segments):
    return np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])


def area(segments):
    """Area by the divergence theorem: needs the outward normals."""
    middle = 0.5 * (segments[:, :2] + segments[:, 2:4])
    return 0.5 * float(np.sum(lengths(segments) * np.einsum("ij,ij->i", middle, segments[:, 4:])))


def is_loop(segments):
    """Say whether every end point is met an even number of times, compared bit for bit."""
    ends = np.vstack([segments[:, :2], segments[:, 2:4]]) + 0.0
    return bool((np.unique(ends, axis=0, return_counts=True)[1] % 2 == 0).all())


def random_mesh(seed, kind):
    if kind == "torus":
        return torus(0.05, 0.02, major_sections=24, minor_sections=12)
    return star(seed, 0.05) if kind == "star" else hull(seed, 0.05)


def other_area(mesh, offset):
    """Area of the section at y = offset, by manifold3d; it slices across z."""
    import manifold3d

    turned = np.ascontiguousarray(mesh.vertices[:, [2, 0, 1]])
    solid = manifold3d.Manifold(manifold3d.Mesh64(turned, mesh.triangles.astype(np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    return solid.slice(offset).area()


def other_length(mesh, offset):
    """Length of the section at y = offset, by trimesh."""
    import trimesh

    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    lines = trimesh.intersections.mesh_plane(solid, [0, 1, 0], [0, offset, 0])
    return float(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum()) if len(lines) else 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from(["hull", "star", "torus"]),
    st.floats(-0.04, 0.04),
    st.sampled_from([1e-6, 1.0, 1e3]),
    st.booleans(),
)
def test_length_and_area_equal_those_of_other_engines(seed, kind, offset, scale, mirrored):
    mesh = random_mesh(seed, kind)
    if mirrored:
        mesh = TriangleMesh(mesh.vertices * [1, -1, 1], mesh.triangles[:, ::-1])
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    T[:3, 3] = np.random.default_rng(seed).normal(size=3) * 0.01
    scaled = T.copy()
    scaled[:3, 3] *= scale
    segments, _ = cut_mesh(TriangleMesh(mesh.vertices * scale, mesh.triangles), scaled, offset * scale)
    placed = moved(mesh, T)
    assert area(segments) == pytest.approx(other_area(placed, offset) * scale**2, rel=1e-6, abs=1e-9 * scale**2)
    assert lengths(segments).sum() == pytest.approx(other_length(placed, offset) * scale, rel=1e-6, abs=1e-7 * scale)
    assert is_loop(segments)


def expected_rows(signs):
    """Read the table of signs."""
    above, on, below = signs.count(1), signs.count(0), signs.count(-1)
    return 1 if (on == 2 and above + below == 1) or (above and below) else 0


@pytest.mark.parametrize("signs", list(itertools.product([-1, 0, 1], repeat=3)))
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_table_of_signs(signs, mirror):
    vertices = np.array([[0.0, signs[0], 0.0], [1.0, signs[1], 0.3], [0.2, signs[2], 1.0]])
    vertices[:, 1] *= 0.7 * mirror
    mesh = build_tree(vertices, [[0, 1, 2]])
    segments, sources = cut_mesh(mesh, IDENTITY, 0.0)
    assert len(segments) == len(sources) == expected_rows(signs)
    for ax, az, bx, bz, nx, nz in segments:
        for x, z in ((ax, az), (bx, bz)):
            weights = np.linalg.solve(np.vstack([vertices.T[[0, 2]], np.ones(3)]), [x, z, 1.0])
            assert weights.min() >= -1e-12
            assert weights @ vertices[:, 1] == pytest.approx(0.0, abs=1e-12)
        assert np.hypot(nx, nz) == pytest.approx(1.0, abs=1e-15)
        assert nx * (bx - ax) + nz * (bz - az) == pytest.approx(0.0, abs=1e-15)
        assert nx * mesh.normals[0, 0] + nz * mesh.normals[0, 2] > 0.0


@pytest.mark.parametrize("offset", [-0.5, 0.5])
def test_plane_in_a_face_gives_its_border_once_per_side(offset):
    segments, _ = cut_mesh(box(2.0, 1.0, 3.0), IDENTITY, offset)
    assert lengths(segments).sum() == pytest.approx(10.0, abs=1e-12)
    assert area(segments) == pytest.approx(6.0, abs=1e-12)


def test_plane_through_vertices_of_a_ball():
    mesh = ball(3, 0.05)
    assert (np.abs(mesh.vertices[:, 1]) < 1e-14).sum() > 10
    through, _ = cut_mesh(mesh, IDENTITY, 0.0)
    beside, _ = cut_mesh(mesh, IDENTITY, 1e-9)
    # Edges in the plane come twice, once from each neighbour.
    unique = np.unique(np.sort(through[:, :4].reshape(-1, 2, 2).round(12), axis=1).reshape(-1, 4), axis=0)
    assert len(unique) > 10
    assert area(beside) == pytest.approx(np.pi * 0.05**2, rel=1e-2)
    assert lengths(beside).sum() == pytest.approx(2 * np.pi * 0.05, rel=1e-2)
    assert np.abs(np.hypot(*through[:, :2].T) - 0.05).max() < 0.05 * 1e-2


def test_neighbours_give_the_same_point_even_where_their_vertices_are_apart():
    mesh = ball(3, 0.05)
    soup = TriangleMesh(mesh.vertices[mesh.triangles], np.arange(mesh.triangles.size))
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=4).as_matrix()
    segments, _ = cut_mesh(soup, T, 0.0123)
    assert len(segments) > 50
    assert is_loop(segments)


def test_mirrored_plane_gives_the_mirrored_section_bit_for_bit():
    mesh = star(5, 0.05)
    segments, _ = cut_mesh(mesh, IDENTITY, 0.01)
    flipped, _ = cut_mesh(mesh, np.diag([1.0, -1.0, 1.0, 1.0]), -0.01)
    np.testing.assert_array_equal(flipped, segments)
    mirrored, _ = cut_mesh(TriangleMesh(mesh.vertices * [1, -1, 1], mesh.triangles[:, ::-1]), IDENTITY, -0.01)
    assert area(mirrored) == pytest.approx(area(segments), rel=1e-12)
    points = np.vstack([segments[:, :2], segments[:, 2:4]])
    mirrored_points = np.vstack([mirrored[:, :2], mirrored[:, 2:4]])
    np.testing.assert_array_equal(np.unique(points, axis=0), np.unique(mirrored_points, axis=0))


@pytest.mark.parametrize("reach", [0.0, 0.02, 0.045, 0.0485, 0.06])
def test_reach_leaves_out_exactly_what_is_farther(reach):
    mesh = star(3, 0.05)
    T = np.eye(4)
    T[0, 3] = 0.03
    everything, sources = cut_mesh(mesh, T, 0.01)
    near, near_sources = cut_mesh(mesh, T, 0.01, reach)
    a, b = everything[:, :2], everything[:, 2:4]
    s = np.clip(-np.einsum("ij,ij->i", a, b - a) / np.einsum("ij,ij->i", b - a, b - a), 0, 1)[:, None]
    expected = np.linalg.norm(a + s * (b - a), axis=1) <= reach
    np.testing.assert_array_equal(near, everything[expected])
    np.testing.assert_array_equal(near_sources, sources[expected])


def cut_rows(tree, offsets, capacity):
    """Cut by some of several planes; return what `cut` does, and what it wrote."""
    segments, sources = np.full((len(offsets), capacity, 6), np.nan), np.full((len(offsets), capacity), -1)
    counts = np.full((len(offsets), 3), 7)
    T = np.eye(4)[:3].copy()
    wanted = cut(tree, T, np.array(offsets), (1, len(offsets)), np.inf, segments, sources, counts, 1, capacity)
    return wanted, segments, sources, counts


def test_small_buffers_say_how_much_is_needed():
    mesh = ball(3)
    tree = build_tree(mesh.vertices, mesh.triangles)
    wanted, segments, _, counts = cut_rows(tree, [9.0, 0.1, 0.9], 10)
    assert wanted > 10
    assert counts[0, 0] == 0
    again, everything, _, enough = cut_rows(tree, [9.0, 0.1, 0.9], wanted)
    assert again == 0
    assert enough[0, 0] == wanted
    np.testing.assert_array_equal(segments[0], everything[0, :10])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.lists(st.floats(-0.06, 0.06), min_size=1, max_size=6))
def test_planes_cut_at_once_give_what_each_gives_alone(seed, offsets):
    mesh = star(seed, 0.05)
    tree = build_tree(mesh.vertices, mesh.triangles)
    wanted, segments, sources, counts = cut_rows(tree, [0.0, *offsets], 512)
    assert wanted == 0
    for row, offset in enumerate(offsets):
        alone, triangles = cut_mesh(tree, IDENTITY, offset)
        np.testing.assert_array_equal(segments[row, : counts[row, 0]], alone)
        np.testing.assert_array_equal(tree.original[sources[row, : counts[row, 0]]], triangles)
    assert np.isnan(segments[-1]).all()


def test_no_triangles_and_triangles_without_area_give_nothing():
    assert len(cut_mesh(build_tree(np.empty((0, 3)), np.empty((0, 3), dtype=int)), IDENTITY, 0.0)[0]) == 0
    assert len(cut_mesh(build_tree([[0, -1, 0], [0, 0.2, 0], [0, 1, 0]], [[0, 1, 2]]), IDENTITY, 0.0)[0]) == 0


def test_open_mesh_is_not_closed_by_guessing():
    mesh = box(2.0, 1.0, 3.0)
    lid = (mesh.vertices[mesh.triangles][:, :, 0] > 0.9).all(axis=1)
    segments, _ = cut_mesh(TriangleMesh(mesh.vertices, mesh.triangles[~lid]), IDENTITY, 0.1)
    assert lengths(segments).sum() == pytest.approx(7.0, abs=1e-12)
