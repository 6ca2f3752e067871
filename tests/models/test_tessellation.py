"""Triangles of round shapes: closed, outward, on the surface, within the deviation; and convex hulls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import ObjectError
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects.topology import edge_defects
from clench.models.shapes import Shape, ShapeKind
from clench.models.tessellation import MAX_SEGMENTS, circle, convex_hull, revolve, tessellate

LENGTH = st.floats(1e-3, 0.2)
ROUND = (ShapeKind.SPHERE, ShapeKind.CAPSULE, ShapeKind.CYLINDER, ShapeKind.ELLIPSOID)
RNG = np.random.default_rng(0)


def made(kind, a, b, c):
    size = {
        ShapeKind.SPHERE: (a, 0.0, 0.0),
        ShapeKind.CAPSULE: (a, b, 0.0),
        ShapeKind.CYLINDER: (a, b, 0.0),
    }.get(kind, (a, b, c))
    return Shape(kind, size)


def signed_volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def exact_volume(shape):
    a, b, c = shape.size
    return {
        ShapeKind.SPHERE: 4 / 3 * np.pi * a**3,
        ShapeKind.CAPSULE: 4 / 3 * np.pi * a**3 + 2 * np.pi * a * a * b,
        ShapeKind.CYLINDER: 2 * np.pi * a * a * b,
        ShapeKind.BOX: 8 * a * b * c,
        ShapeKind.ELLIPSOID: 4 / 3 * np.pi * a * b * c,
    }[shape.kind]


def depth_inside(shape, points):
    """Return the distance of inner points to the surface; for ellipsoids an upper bound by the radial projection."""
    a, b, _ = shape.size
    match shape.kind:
        case ShapeKind.SPHERE:
            return a - np.linalg.norm(points, axis=1)
        case ShapeKind.CAPSULE:
            core = np.zeros_like(points)
            core[:, 2] = np.clip(points[:, 2], -b, b)
            return a - np.linalg.norm(points - core, axis=1)
        case ShapeKind.CYLINDER:
            return np.minimum(a - np.linalg.norm(points[:, :2], axis=1), b - np.abs(points[:, 2]))
        case ShapeKind.ELLIPSOID:
            reach = np.linalg.norm(points / shape.size, axis=1)
            return np.linalg.norm(points, axis=1) * (1.0 / reach - 1.0)


@settings(max_examples=30, deadline=None)
@given(kind=st.sampled_from(ROUND), a=LENGTH, b=LENGTH, c=LENGTH, fraction=st.floats(1e-3, 0.9))
def test_round_shapes_are_closed_inscribed_and_within_the_deviation(kind, a, b, c, fraction):
    shape = made(kind, a, b, c)
    # Below 2e-5 of the largest size the number of facets is capped (another test); 1e-4 keeps this one small.
    deviation = max(fraction * min(v for v in shape.size if v > 0), 1e-4 * max(shape.size))
    mesh = tessellate(shape, deviation)
    assert edge_defects(mesh.triangles).none
    assert 0 < signed_volume(mesh) < exact_volume(shape)
    scale = max(shape.size)
    assert np.abs(depth_inside(shape, mesh.vertices)).max() < 1e-12 * scale
    weights = RNG.dirichlet(np.ones(3), size=(3, len(mesh.triangles)))
    inner = np.einsum("stk,tkx->stx", weights, mesh.vertices[mesh.triangles]).reshape(-1, 3)
    depth = depth_inside(shape, inner)
    assert depth.min() > -1e-12 * scale
    assert depth.max() <= deviation * (1 + 1e-9)


def test_a_finer_deviation_gives_more_triangles_up_to_a_bound():
    ball = Shape(ShapeKind.SPHERE, (0.05, 0.0, 0.0))
    counts = [len(tessellate(ball, d).triangles) for d in (1e-2, 1e-3, 1e-4)]
    assert counts == sorted(set(counts))
    finest = len(tessellate(ball, 1e-12).triangles)
    assert counts[-1] < finest <= MAX_SEGMENTS**2


def test_a_box_is_exact():
    shape = Shape(ShapeKind.BOX, (0.01, 0.02, 0.03))
    mesh = tessellate(shape, 1e-3)
    assert len(mesh.triangles) == 12
    assert edge_defects(mesh.triangles).none
    assert signed_volume(mesh) == pytest.approx(exact_volume(shape), rel=1e-12)


def test_a_mesh_is_returned_as_it_is_and_posed_by_to_mesh():
    mesh = tessellate(Shape(ShapeKind.BOX, (0.01, 0.02, 0.03)), 1e-3)
    shape = Shape(ShapeKind.MESH, mesh=mesh, pose=Pose([1.0, 2.0, 3.0]))
    assert tessellate(shape, 1e-3) is mesh
    np.testing.assert_allclose(shape.to_mesh().vertices, mesh.vertices + np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize("deviation", [0.0, -1e-3, float("nan"), float("inf")])
def test_a_deviation_must_be_above_zero(deviation):
    with pytest.raises(ObjectError, match="expected a deviation above 0 m"):
        tessellate(Shape(ShapeKind.SPHERE, (0.05, 0.0, 0.0)), deviation)


@pytest.mark.parametrize(
    "shape",
    [
        Shape(ShapeKind.SPHERE, (0.0, 0.0, 0.0)),
        Shape(ShapeKind.CYLINDER, (-0.1, 1.0, 0.0)),
        Shape(ShapeKind.ELLIPSOID, (0.1, 0.1, 0.0)),
        Shape(ShapeKind.BOX, (0.1, float("nan"), 0.1)),
    ],
)
def test_a_shape_of_no_size_is_refused(shape):
    with pytest.raises(ObjectError, match="above 0 m"):
        tessellate(shape, 1e-3)


@pytest.mark.parametrize("count", [4, 12, 100])
def test_the_circle_is_a_circle_to_the_last_digits(count):
    points = circle(count)
    np.testing.assert_allclose(np.hypot(*points.T), 1.0, atol=1e-15)
    angles = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    np.testing.assert_allclose(np.diff(angles), 2 * np.pi / count, atol=1e-14)
    assert (points[[0, count // 4, count // 2]] == [[1, 0], [0, 1], [-1, 0]]).all()


def test_a_revolved_cone_has_the_volume_of_its_pyramid():
    mesh = revolve([(0.0, 0.0), (0.1, 0.0), (0.0, 0.3)], circle(48))
    section = 0.5 * 48 * np.sin(2 * np.pi / 48) * 0.1**2
    assert edge_defects(mesh.triangles).none
    assert signed_volume(mesh) == pytest.approx(section * 0.3 / 3, rel=1e-12)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6), count=st.integers(4, 200), scale=st.sampled_from([1e-4, 1.0, 1e3]), far=st.booleans()
)
def test_the_hull_is_closed_outward_convex_and_holds_every_point(seed, count, scale, far):
    points = scale * (np.random.default_rng(seed).normal(size=(count, 3)) + (100.0 if far else 0.0))
    hull = convex_hull(TriangleMesh(points, []))
    assert edge_defects(hull.triangles).none
    a, b, c = (hull.vertices[hull.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    above = np.einsum("tx,ptx->pt", normal, points[:, None] - a)
    assert above.max() < 1e-9 * np.ptp(points)
    assert set(map(tuple, hull.vertices)) <= set(map(tuple, points))


@pytest.mark.parametrize("scale", [1e-5, 1.0])
def test_the_hull_of_a_fine_cube_is_the_cube(scale):
    grid = np.linspace(0.0, scale, 5)
    points = np.array(np.meshgrid(grid, grid, grid)).reshape(3, -1).T
    hull = convex_hull(TriangleMesh(points, []))
    assert signed_volume(hull) == pytest.approx(scale**3, rel=1e-9)
    assert edge_defects(hull.triangles).none


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.zeros((0, 3)), "at least 4 vertices, got 0"),
        (np.eye(3), "at least 4 vertices, got 3"),
        (np.zeros((5, 3)), "the mesh is flat"),
        ([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]], "the mesh is flat"),
    ],
)
def test_flat_meshes_have_no_hull(points, words):
    with pytest.raises(ObjectError, match=words):
        convex_hull(TriangleMesh(points, []))
