"""An object is packed once, in its own frame, with every body's number, role and hash."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from block_hands import block_hand

import clench
from clench.closing.collision.packed_object import (
    OBJECT_CACHE,
    ROUND_KINDS,
    hash_hand,
    pack_object,
    packed_size,
    role_body,
)
from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import shape_mesh, tessellation_deviation

ROUND = {
    ShapeKind.SPHERE: (0.03, 0.0, 0.0),
    ShapeKind.CAPSULE: (0.02, 0.05, 0.0),
    ShapeKind.CYLINDER: (0.02, 0.05, 0.0),
    ShapeKind.ELLIPSOID: (0.02, 0.03, 0.05),
}
PLACE = Pose([0.1, -0.2, 0.3], [0.5, 0.5, -0.5, 0.5])


def cross():
    """Return a plus-shaped prism: closed, not convex."""
    one = Shape(ShapeKind.BOX, (0.03, 0.01, 0.01)).to_mesh()
    other = Shape(ShapeKind.BOX, (0.01, 0.03, 0.01)).to_mesh()
    return TriangleMesh.joined([one, other])


def scene(**changes):
    bodies = (
        Body("cross", (Shape(ShapeKind.MESH, mesh=cross(), pose=PLACE),)),
        Body("table", (Shape(ShapeKind.BOX, (1.0, 1.0, 0.1), Pose([0, 0, -0.3])),), role=BodyRole.OBSTACLE),
        Body("rounds", tuple(Shape(kind, size, PLACE) for kind, size in ROUND.items())),
    )
    return replace(GraspObject("scene", bodies), **changes)


def test_flat_shapes_are_triangles_and_round_ones_are_apart():
    packed = pack_object(scene())
    assert len(packed.tree.triangles) == 24 + 12
    assert sorted(set(packed.tree.body)) == [0, 1]
    assert packed.body_names == ("cross", "table", "rounds")
    assert packed.body_roles == (BodyRole.GRASPABLE, BodyRole.OBSTACLE, BodyRole.GRASPABLE)
    assert packed.closed
    rounds = packed.rounds
    assert list(rounds.kind) == [ROUND_KINDS[kind] for kind in ROUND]
    np.testing.assert_array_equal(rounds.size, list(ROUND.values()))
    np.testing.assert_array_equal(rounds.body, [2, 2, 2, 2])
    for matrix in rounds.T_object_shape:
        np.testing.assert_array_equal(matrix, PLACE.matrix[:3])
    assert sorted(set(packed.full_tree.body)) == [0, 1, 2]
    assert len(packed.full_owners) == len(packed.full_tree.triangles) > len(packed.tree.triangles)


def test_vertices_are_in_the_frame_of_the_object_whatever_its_pose():
    packed = pack_object(scene(pose=Pose([5.0, 6.0, 7.0])))
    used = packed.tree.vertices[packed.tree.triangles[packed.tree.body == 0]].reshape(-1, 3)
    expected = PLACE.apply(cross().vertices)
    np.testing.assert_allclose(used.min(axis=0), expected.min(axis=0), atol=1e-15)
    np.testing.assert_allclose(used.max(axis=0), expected.max(axis=0), atol=1e-15)


def test_center_and_radius():
    ball = Body("ball", (Shape(ShapeKind.BOX, (0.1, 0.1, 0.1), Pose([1.0, 2.0, 3.0])),))
    far = Body("wall", (Shape(ShapeKind.BOX, (0.1, 0.1, 0.1), Pose([9.0, 2.0, 3.0])),), role=BodyRole.OBSTACLE)
    packed = pack_object(GraspObject("two", (ball, far)))
    np.testing.assert_allclose(packed.center, [1.0, 2.0, 3.0], atol=1e-12)
    assert packed.radius == pytest.approx(np.sqrt(8.1**2 + 0.02), abs=1e-12)


def test_the_same_bodies_are_packed_once():
    obj = scene()
    packed = pack_object(obj)
    assert pack_object(obj.posed(Pose([1.0, 0.0, 0.0]))) is packed
    other = pack_object(GraspObject("other", (Body("box", (Shape(ShapeKind.BOX, (1.0, 1.0, 1.0)),)),)))
    assert other is not packed
    assert pack_object(obj) is packed
    assert pack_object(replace(obj, bodies=tuple(replace(body) for body in obj.bodies))) is packed
    assert pack_object(replace(obj, collision_source=CollisionSource.ENGINE)) is not packed


def test_engine_means_hulls_which_are_closed():
    opened = Body(
        "open", (Shape(ShapeKind.MESH, mesh=TriangleMesh(cross().vertices, cross().triangles[:-1])),), closed=False
    )
    raw = pack_object(GraspObject("open", (opened,)))
    engine = pack_object(GraspObject("open", (opened,), collision_source=CollisionSource.ENGINE))
    assert not raw.closed
    assert engine.closed
    assert raw.body_closed == (False,)
    assert len(raw.tree.triangles) == 23
    hull = engine.tree.vertices[engine.tree.triangles]
    inner = np.einsum("ij,ikj->ik", engine.tree.normals, cross().vertices[None] - hull[:, :1])
    assert inner.max() < 1e-12


def test_hash_says_what_the_geometry_is():
    obj = scene()
    base = pack_object(obj).geometry_hash
    assert len(base) == 64
    assert pack_object(obj.posed(Pose([1, 2, 3]))).geometry_hash == base
    renamed = replace(obj, bodies=tuple(replace(body, name="x") for body in obj.bodies))
    assert pack_object(renamed).geometry_hash == base
    shifted = replace(obj.bodies[1], shapes=(replace(obj.bodies[1].shapes[0], pose=Pose([0, 0, -0.3 + 1e-9])),))
    freed = replace(obj.bodies[1], role=BodyRole.GRASPABLE)
    bent = TriangleMesh(cross().vertices + 1e-12, cross().triangles)
    remeshed = replace(obj.bodies[0], shapes=(replace(obj.bodies[0].shapes[0], mesh=bent),))
    others = [
        replace(obj, bodies=(obj.bodies[0], shifted, obj.bodies[2])),
        replace(obj, bodies=(obj.bodies[0], freed, obj.bodies[2])),
        replace(obj, bodies=(remeshed, *obj.bodies[1:])),
        replace(obj, bodies=obj.bodies[:2]),
        replace(obj, collision_source=CollisionSource.ENGINE),
    ]
    assert len({base, *(pack_object(other).geometry_hash for other in others)}) == 1 + len(others)


def test_hash_of_a_hand_says_what_its_geometry_is():
    hand = block_hand()
    base = hash_hand(hand, CollisionSource.ENGINE)
    assert hash_hand(block_hand(), CollisionSource.ENGINE) == base
    assert hash_hand(replace(hand, name="other"), CollisionSource.ENGINE) == base
    wider = replace(hand, joints=(replace(hand.joints[0], upper=1.6),))
    padded = replace(hand, links=(replace(hand.links[0], pad_indentation=1e-3), *hand.links[1:]))
    thicker = block_hand(palm=Shape(ShapeKind.BOX, (0.05, 0.03, 0.011)))
    hashes = {hash_hand(h, CollisionSource.ENGINE) for h in (hand, wider, padded, thicker)}
    assert len(hashes) == 4
    assert hash_hand(hand, CollisionSource.RAW) not in hashes


@pytest.mark.parametrize("kind", list(ROUND))
def test_round_shapes_are_inscribed_to_the_stated_deviation(kind):
    shape = Shape(kind, ROUND[kind])
    mesh = shape_mesh(shape, CollisionSource.RAW)
    deviation = tessellation_deviation(shape)
    assert 0.0 < deviation <= 2e-5
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    depths = -np.array([distance_to(kind, ROUND[kind], p) for p in middles])
    assert depths.min() >= -1e-9
    assert depths.max() <= 1.1 * deviation


def distance_to(kind, size, p):
    """Signed distance to a round shape; for the ellipsoid to first order, which is enough near its surface."""
    a, b, _ = size
    if kind is ShapeKind.SPHERE:
        return np.linalg.norm(p) - a
    if kind is ShapeKind.CAPSULE:
        return np.linalg.norm(p - [0, 0, np.clip(p[2], -b, b)]) - a
    if kind is ShapeKind.CYLINDER:
        return max(np.hypot(p[0], p[1]) - a, abs(p[2]) - b)
    value = np.sum((p / size) ** 2) - 1.0
    return value / np.linalg.norm(2.0 * p / np.square(size))


def test_object_of_round_shapes_only_has_no_triangles_but_a_full_tree():
    packed = pack_object(GraspObject("ball", (Body("ball", (Shape(ShapeKind.SPHERE, (0.03, 0, 0)),)),)))
    assert len(packed.tree.triangles) == 0
    assert packed.radius == pytest.approx(0.03, rel=1e-9)
    np.testing.assert_allclose(packed.center, 0.0, atol=1e-12)


@pytest.fixture
def cache():
    """Give the memory of packed objects back its size."""
    yield clench.set_object_cache
    clench.set_object_cache(OBJECT_CACHE)


def cube(side):
    return GraspObject.load(f"box:x={side:g},y={side:g},z={side:g}")


def packed_once_solved(number):
    """Solve with a few cubes in turn, equal in memory; return a function that tells which are still packed."""
    packed = []
    for k in range(number):
        obj = cube(0.01 * (k + 1))
        command = clench.GraspCommand(hand_pose=Pose([0, 0, -0.3]), full_width=False, planes=1, preshape="open")
        clench.solve(block_hand(), obj, command)
        packed.append(weakref.ref(pack_object(obj)))

    def there():
        gc.collect()
        return [k for k, found in enumerate(packed) if found() is not None]

    return there


def test_objects_stay_packed_within_their_memory(cache):
    """A program that goes through many objects holds as many as fit: a million triangles take 0.2 GB."""
    size = packed_size(pack_object(cube(0.01)))
    cache(0)
    cache(5 * size)
    there = packed_once_solved(12)
    assert there() == [7, 8, 9, 10, 11]
    cache(2 * size)
    assert there() == [10, 11]
    cache(0)
    assert there() == [11]


def test_what_is_used_again_stays_packed(cache):
    first = cube(0.055)
    cache(0)
    cache(3 * packed_size(pack_object(first)))
    kept = pack_object(first)
    for k in range(6):
        pack_object(cube(0.01 * (k + 1)))
        assert pack_object(first) is kept


@pytest.mark.parametrize("size", [-1, 0.5, True, "1 GB", None])
def test_a_cache_of_no_size_is_refused(size):
    with pytest.raises(CommandError, match="set_object_cache: expected a whole number of bytes"):
        clench.set_object_cache(size)


def test_forty_objects_stay_packed():
    objects = [GraspObject.load("mug", scale=1.0 + 0.01 * k) for k in range(40)]
    packed = [pack_object(obj) for obj in objects]
    assert [pack_object(obj) for obj in objects] == packed
    assert sum(map(packed_size, packed)) < OBJECT_CACHE


def test_the_bodies_to_grasp_share_their_arrays_with_the_object_where_there_are_no_others():
    mesh = cross()
    alone = GraspObject("cross", (Body("cross", (Shape(ShapeKind.MESH, mesh=mesh),)),))
    assert role_body(alone, BodyRole.GRASPABLE) is pack_object(alone).bodies
    assert len(role_body(alone, BodyRole.OBSTACLE).elements) == 0
    table = Body("table", (Shape(ShapeKind.BOX, (1.0, 1.0, 0.1), Pose([0, 0, -0.3])),), role=BodyRole.OBSTACLE)
    both = alone.with_body(table)
    assert len(role_body(both, BodyRole.GRASPABLE).elements) == len(mesh.triangles)
    assert len(role_body(both, BodyRole.OBSTACLE).elements) == 12


def test_a_mesh_takes_about_two_hundred_bytes_per_triangle():
    ball = Shape(ShapeKind.SPHERE, (0.03, 0.0, 0.0)).to_mesh(1e-6)
    packed = pack_object(GraspObject("ball", (Body("ball", (Shape(ShapeKind.MESH, mesh=ball),)),)))
    assert len(ball.triangles) > 10_000
    assert packed_size(packed) <= 200 * len(ball.triangles)
