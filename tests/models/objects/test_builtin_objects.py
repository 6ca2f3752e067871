"""The built-in objects: closed surfaces, and pieces that are convex and fill them."""

import numpy as np
import pytest

from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.objects.mug import BASE, HEIGHT, INNER, OUTER
from clench.models.objects.revolved import convex_pieces
from clench.models.objects.topology import edge_defects, winding_number
from clench.models.shapes import CollisionSource, ShapeKind
from clench.models.tessellation import circle, convex_hull

MESHES = ("mug", "bottle", "screwdriver")


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("name", MESHES)
def test_surfaces_are_closed_outward_and_stand_on_the_ground(name):
    loaded = GraspObject.load(name)
    (body,) = loaded.bodies
    (shape,) = body.shapes
    assert body.closed
    assert loaded.warnings == ()
    assert edge_defects(shape.mesh.triangles).none
    assert volume(shape.mesh) > 0
    assert len(np.unique(shape.mesh.vertices, axis=0)) == len(shape.mesh.vertices)
    assert shape.mesh.vertices[:, 2].min() == 0.0


def test_independent_judges_agree_that_the_surfaces_bound_solids():
    import manifold3d

    for name, genus in (("mug", 1), ("bottle", 0), ("screwdriver", 0)):
        mesh = GraspObject.load(name).bodies[0].shapes[0].mesh
        solid = manifold3d.Manifold(
            manifold3d.Mesh64(vert_properties=mesh.vertices.copy(), tri_verts=mesh.triangles.astype(np.uint64))
        )
        assert solid.status() == manifold3d.Error.NoError
        assert solid.genus() == genus
        assert solid.volume() == pytest.approx(volume(mesh), rel=1e-6)


@pytest.mark.parametrize("name", MESHES)
def test_pieces_are_convex_closed_and_fill_the_surface(name):
    body = GraspObject.load(name).bodies[0]
    for piece in body.pieces:
        assert edge_defects(piece.triangles).none
        assert volume(piece) == pytest.approx(volume(convex_hull(piece)), rel=1e-9)
    # Wedges and handle pieces of the mug bulge a little; bodies of revolution are filled exactly.
    excess = 0.04 if name == "mug" else 1e-9
    whole = volume(body.shapes[0].mesh)
    assert whole * (1 - 1e-9) <= sum(map(volume, body.pieces)) <= whole * (1 + excess)


@pytest.mark.parametrize("name", MESHES)
def test_pieces_and_surface_hold_the_same_points(name):
    body = GraspObject.load(name).bodies[0]
    mesh = body.shapes[0].mesh
    rng = np.random.default_rng(1)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    differing = 0
    points = rng.uniform(low, high, size=(120, 3))
    for point in points:
        inside = winding_number(point, mesh.vertices, mesh.triangles) > 0.5
        held = any(winding_number(point, piece.vertices, piece.triangles) > 0.5 for piece in body.pieces)
        assert held or not inside
        differing += held and not inside
    assert differing <= (4 if name == "mug" else 0)


def test_the_mug_is_hollow_and_its_handle_lets_a_finger_through():
    mesh = GraspObject.load("mug").bodies[0].shapes[0].mesh

    def inside(*point):
        return winding_number(np.array(point), mesh.vertices, mesh.triangles) > 0.5

    assert not inside(0.0, 0.0, HEIGHT / 2)
    assert inside(0.0, 0.0, BASE / 2)
    assert inside(-(OUTER + INNER) / 2, 0.0, HEIGHT / 2)
    assert inside(OUTER + 0.034, 0.0, 0.048)
    assert not inside(OUTER + 0.015, 0.0, 0.048)


def test_the_ball_is_an_exact_sphere():
    (body,) = GraspObject.load("ball").bodies
    assert body.shapes[0].kind is ShapeKind.SPHERE
    assert body.closed


@pytest.mark.parametrize("name", MESHES)
def test_the_engine_sees_the_pieces(name):
    raw, engine = (GraspObject.load(name, collision_source=source).bodies[0] for source in ("raw", "engine"))
    assert GraspObject.load(name, collision_source="engine").collision_source is CollisionSource.ENGINE
    assert len(engine.shapes) == len(raw.pieces)
    assert engine.shapes[0].mesh is engine.pieces[0]


def test_scale_scales_surface_and_pieces():
    one, half = GraspObject.load("mug").bodies[0], GraspObject.load("mug", scale=0.5).bodies[0]
    np.testing.assert_allclose(half.shapes[0].mesh.vertices, one.shapes[0].mesh.vertices / 2, rtol=1e-15)
    np.testing.assert_allclose(half.pieces[3].vertices, one.pieces[3].vertices / 2, rtol=1e-15)


def test_a_profile_with_steps_and_hollows_is_split_where_it_must():
    profile = [(0.1, 0.0), (0.2, 0.1), (0.2, 0.2), (0.1, 0.3), (0.1, 0.4), (0.3, 0.4), (0.3, 0.5)]
    pieces = convex_pieces(profile, circle(12))
    assert [(p.vertices[:, 2].min(), p.vertices[:, 2].max()) for p in pieces] == [(0.0, 0.3), (0.3, 0.4), (0.4, 0.5)]
    assert all(volume(p) == pytest.approx(volume(convex_hull(TriangleMesh(p.vertices, []))), rel=1e-9) for p in pieces)


def test_the_mug_makes_its_pieces_when_they_are_asked_for():
    """Whoever closes a hand around it does not wait for them."""
    mug = GraspObject.load("mug")
    assert not mug.bodies[0].pieces.is_made
    assert len(mug.bodies[0].pieces) > 40
    assert mug.bodies[0].pieces.is_made
