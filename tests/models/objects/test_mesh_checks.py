"""Mesh checks: winding, holes, cavities, degenerate triangles, solids that touch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import ObjectError
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mesh_checks import check_mesh, unit_warnings
from clench.models.objects.topology import edge_defects, winding_number
from clench.models.shapes import Shape, ShapeKind
from clench.models.tessellation import tessellate


def box(half=1.0, at=(0.0, 0.0, 0.0)):
    return tessellate(Shape(ShapeKind.BOX, (half, half, half)), 1e-3).transformed(Pose(at))


def flipped(mesh):
    return TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])


def checked(mesh):
    return check_mesh(mesh.vertices, mesh.triangles, "m")


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_a_good_mesh_is_left_as_it_is():
    result = checked(box())
    assert (result.closed, result.warnings) == (True, ())
    assert volume(result.mesh) == pytest.approx(8.0)


def test_an_inverted_mesh_is_turned():
    result = checked(flipped(box()))
    assert result.closed
    assert result.warnings == ("m: its triangles were wound inwards and have been turned.",)
    assert volume(result.mesh) == pytest.approx(8.0)


def test_one_inverted_part_of_two_is_turned():
    result = checked(TriangleMesh.joined([box(), flipped(box(at=(5.0, 0.0, 0.0)))]))
    assert result.closed
    assert result.warnings == ("m: 1 of its 2 parts were wound inwards and have been turned.",)
    assert volume(result.mesh) == pytest.approx(16.0)


def test_a_cavity_is_wound_inwards_and_stays_so():
    result = checked(TriangleMesh.joined([box(2.0), flipped(box(1.0))]))
    assert (result.closed, result.warnings) == (True, ())
    assert volume(result.mesh) == pytest.approx(64.0 - 8.0)


def test_a_hole_is_said_and_the_mesh_is_open():
    mesh = box()
    result = check_mesh(mesh.vertices, mesh.triangles[1:], "m")
    assert not result.closed
    assert len(result.mesh.triangles) == 11
    assert result.warnings[0].startswith("m: not watertight, 3 edges with a triangle on one side only")


def test_one_flipped_triangle_is_inconsistent_winding():
    mesh = box()
    triangles = mesh.triangles.copy()
    triangles[0] = triangles[0][::-1]
    result = check_mesh(mesh.vertices, triangles, "m")
    assert not result.closed
    assert result.warnings[0].startswith("m: winding is inconsistent at 3 edges")


def test_a_wall_inside_gives_edges_with_three_triangles():
    mesh = box()
    result = check_mesh(mesh.vertices, [*mesh.triangles, [0, 2, 7], [0, 7, 5]], "m")
    assert not result.closed
    assert any("with more than two triangles" in warning for warning in result.warnings)


def test_two_boxes_that_share_an_edge_get_vertices_of_their_own():
    joined = TriangleMesh.joined([box(), box(at=(2.0, 2.0, 0.0))])
    vertices, index = np.unique(joined.vertices, axis=0, return_inverse=True)
    triangles = index.ravel()[joined.triangles]
    assert edge_defects(triangles).crowded == 1
    result = check_mesh(vertices, triangles, "m")
    assert (result.closed, result.warnings) == (True, ())
    assert len(vertices) == 14
    assert len(result.mesh.vertices) == 16
    assert volume(result.mesh) == pytest.approx(16.0)


def test_a_flap_left_by_a_collapsed_edge_is_dropped():
    mesh = box()
    flap = [[0, 1, 8], [1, 0, 8]]
    result = check_mesh([*mesh.vertices, [0.0, 0.0, 3.0]], [*mesh.triangles, *flap], "m")
    assert result.closed
    assert result.warnings == ("m: dropped 2 triangles lying back to back.",)
    assert len(result.mesh.vertices) == 8


def test_a_sheet_with_two_faces_encloses_nothing():
    result = check_mesh(np.eye(3), [[0, 1, 2], [2, 1, 0]], "m")
    assert not result.closed
    assert "encloses no volume" in result.warnings[0]
    assert len(result.mesh.triangles) == 2


def test_repeated_and_collapsed_triangles_are_dropped():
    mesh = box()
    result = check_mesh(mesh.vertices, [*mesh.triangles, [0, 0, 1], mesh.triangles[0][[1, 2, 0]]], "m")
    assert result.closed
    assert result.warnings == (
        "m: dropped 1 triangle naming one vertex twice.",
        "m: dropped 1 triangle repeating another one.",
    )
    assert len(result.mesh.triangles) == 12


def test_a_sliver_is_dropped_and_the_surface_stays_closed():
    """A point on an edge of the box, joined by triangles without area: closed before, closed in space afterwards."""
    mesh = box()
    a, b = mesh.triangles[0][:2]
    middle = (mesh.vertices[a] + mesh.vertices[b]) / 2
    c = mesh.triangles[0][2]
    triangles = [*mesh.triangles[1:], [a, 8, c], [8, b, c], [a, b, 8]]
    result = check_mesh([*mesh.vertices, middle], triangles, "m")
    assert result.closed
    assert result.warnings == ("m: dropped 1 triangle without area.",)
    assert volume(result.mesh) == pytest.approx(8.0)


@pytest.mark.parametrize("triangles", [[[0, 0, 1]], [[0, 1, 2]]])
def test_nothing_but_degenerate_triangles(triangles):
    with pytest.raises(ObjectError, match="m: every triangle is degenerate"):
        check_mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], triangles, "m")


def test_far_from_the_origin_nothing_changes():
    result = checked(box(0.01, at=(1e4, -1e4, 1e4)))
    assert (result.closed, result.warnings) == (True, ())


@pytest.mark.parametrize(
    ("extent", "words"), [(2.1, "a scale of 0.001"), (1.9, None), (1.1e-3, None), (0.9e-3, "another scale")]
)
def test_units(extent, words):
    found = unit_warnings(np.array([[0.0, 0.0, 0.0], [0.0, extent, 0.0]]), "m")
    assert bool(found) == (words is not None)
    assert all(words in sentence for sentence in found)


@pytest.mark.parametrize("text", ["cylinder:r=0.03,h=5e-324", "capsule:r=0.03,h=5e-324", "sphere:r=1e-14"])
def test_lengths_of_nothing_are_refused(text):
    """Half of the smallest number is none, and no flat cylinder has normals on its side."""
    with pytest.raises(ObjectError, match=r"expected lengths from 1e-13 to 1e\+09 m, got "):
        GraspObject.load(text)


def test_the_input_is_never_changed():
    mesh = flipped(box())
    vertices, triangles = mesh.vertices.copy(), mesh.triangles.copy()
    check_mesh(vertices, triangles, "m")
    assert (vertices == mesh.vertices).all()
    assert (triangles == mesh.triangles).all()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_order_of_triangles_and_their_first_corner_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    mesh = TriangleMesh.joined([box(2.0), flipped(box(1.0)), flipped(box(at=(6.0, 0.0, 0.0)))])
    rolls = rng.integers(0, 3, len(mesh.triangles))[:, None]
    turned = np.take_along_axis(mesh.triangles, (rolls + np.arange(3)) % 3, axis=1)
    result = check_mesh(mesh.vertices, rng.permutation(turned), "m")
    assert result.closed
    assert volume(result.mesh) == pytest.approx(64.0 - 8.0 + 8.0)


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_the_winding_number_is_one_inside_and_zero_outside(point):
    mesh = box()
    reach = np.abs(point).max()
    if abs(reach - 1.0) > 1e-6:
        assert winding_number(np.array(point), mesh.vertices, mesh.triangles) == pytest.approx(
            float(reach < 1.0), abs=1e-6
        )


@pytest.mark.parametrize("triangles", [[[0.0, 1.0, float("nan")]], [[0, 1, 10**30]], [[0.5, 1.0, 2.0]]])
def test_indices_that_are_no_whole_numbers(triangles):
    with pytest.raises(ObjectError, match=r"thing: (expected whole|expected arrays|a triangle names)"):
        check_mesh(np.eye(3), triangles, "thing")
