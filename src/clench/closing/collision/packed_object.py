"""Pack an object once: every triangle in one tree in the object's frame, and the round shapes apart."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from numbers import Integral
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clench.core.caching.keeping import Keeper, KeptBySize
from clench.core.exceptions import CommandError
from clench.core.memory import expect, in_parts
from clench.core.pose import FloatArray, Pose
from clench.core.threads import core_count, share_out
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import Body, BodyRole, GraspObject
from clench.models.parts import part_points
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import shape_mesh

if TYPE_CHECKING:
    from clench.kernels.geometry.bodies import BodyArrays, Elements
    from clench.kernels.trees.bvh import MeshTree

#: Cylinders and ellipsoids are swept as inscribed polyhedra that are off by this fraction of their size at most [-].
SWEEP_DEVIATION: Final = 2e-5
#: Default memory for objects that stay packed, see `set_object_cache` [bytes].
OBJECT_CACHE: Final = 512_000_000
ROUND_POLYHEDRA: Final = (ShapeKind.CYLINDER, ShapeKind.ELLIPSOID)
#: Number of each kind of round shape in `RoundShapes.kind`.
ROUND_KINDS: Final = {ShapeKind.SPHERE: 0, ShapeKind.CAPSULE: 1, ShapeKind.CYLINDER: 2, ShapeKind.ELLIPSOID: 3}


class RoundShapes(NamedTuple):
    """The round shapes of an object, whose sections are exact curves.

    Args:
        kind: `ROUND_KINDS`, shape (M,).
        size: half sizes [m] as `ShapeKind` says, shape (M, 3).
        T_object_shape: shape (M, 3, 4).
        body: index of the body of each, shape (M,).
    """

    kind: NDArray[np.int32]
    size: FloatArray
    T_object_shape: FloatArray
    body: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class PackedObject(Keeper):
    """The object data that the kernels read, in the object's own frame. It never moves and never changes.

    Kernels fill in the grid of distances of `bodies`, whose values depend on nothing but the object.

    Args:
        tree: triangles of meshes and boxes.
        rounds: spheres, capsules, cylinders and ellipsoids.
        full_tree: all shapes as triangles, round ones inscribed, off by `tessellation_deviation` at most.
        full_owners: `feature_owners` of `full_tree`.
        bodies: everything as the elements of one body, for sweeps. element_body: index of the body of each
            element.
        closed: every body is watertight with outward normals, so one-sided tests are exact.
        body_closed: the same for each body.
        body_names, body_roles: of the bodies that `tree.body` and `rounds.body` number.
        center: middle of the box around the graspable bodies [m], shape (3,).
        radius: of the ball around `center` that holds everything [m]. size: the same for the graspable bodies [m].
        points: one of every connected part, (N, 3).
        geometry_hash: SHA-256 over the arrays, hexadecimal.
    """

    tree: MeshTree
    rounds: RoundShapes
    full_tree: MeshTree
    full_owners: NDArray[np.uint8]
    bodies: BodyArrays
    element_body: NDArray[np.int32]
    closed: bool
    body_closed: tuple[bool, ...]
    body_names: tuple[str, ...]
    body_roles: tuple[BodyRole, ...]
    center: FloatArray
    radius: float
    size: float
    points: FloatArray
    geometry_hash: str

    @property
    def round_sizes(self) -> list[tuple[ShapeKind, tuple[float, ...]]]:
        """Kind and half sizes of every round shape [m]."""
        kinds = {number: kind for kind, number in ROUND_KINDS.items()}
        return [(kinds[int(k)], tuple(size)) for k, size in zip(self.rounds.kind, self.rounds.size, strict=True)]


def pack_object(obj: GraspObject) -> PackedObject:
    """Pack an object's bodies for the kernels; the pose plays no part, and the same bodies are packed once.

    Objects stay packed as long as they fit into the memory that `set_object_cache` gives them.
    """
    bodies, source = obj.bodies, CollisionSource(obj.collision_source)
    packed: PackedObject = _packed.get((bodies, source), partial(_pack, bodies, source))
    return packed


def set_object_cache(size: int) -> None:
    """Set the memory for packed objects [bytes], 512 MB by default; the latest ones stay.

    The first solve with an object packs its triangles into trees, which takes some ten milliseconds. Later solves use
    the packed object. A mesh takes about 200 bytes per triangle. The object used last stays, however large it is.

    Args:
        size: [bytes]; 0 keeps the last object alone.

    Raises:
        CommandError: not a whole number of at least 0.
    """
    if isinstance(size, bool) or not isinstance(size, Integral) or size < 0:
        raise CommandError(f"set_object_cache: expected a whole number of bytes of at least 0, got {size!r}.")
    _packed.resize(int(size))


def role_body(obj: GraspObject, role: BodyRole) -> BodyArrays:
    """Return the bodies of one role as one body, in the object's frame; cached like the results of `pack_object`."""
    if all(body.role is role for body in obj.bodies):
        return pack_object(obj).bodies
    source = CollisionSource(obj.collision_source)
    found: BodyArrays = _packed.get((obj.bodies, source, role), partial(_pack_role, obj.bodies, source, role))
    return found


def _pack_role(bodies: tuple[Body, ...], source: CollisionSource, role: BodyRole) -> BodyArrays:
    from clench.kernels.geometry.bodies import join_elements, pack_bodies, with_grid

    shapes = [shape for body in bodies if body.role is role for shape in body.shapes]
    return with_grid(pack_bodies([join_elements([shape_elements(shape, source) for shape in shapes])]))


def shape_elements(shape: Shape, source: CollisionSource) -> Elements:
    """Return a shape as convex elements in its body's or link's frame: a sphere is a point, a capsule a segment."""
    from clench.kernels.geometry.bodies import Elements

    a, b, _ = shape.size
    if shape.kind in (ShapeKind.SPHERE, ShapeKind.CAPSULE):
        half = b if shape.kind is ShapeKind.CAPSULE else 0.0
        ends = np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]) @ shape.pose.rotation.T + shape.pose.position
        core = [0, 1, 1] if half > 0.0 else [0, 0, 0]
        return Elements(ends, np.array([core], dtype=np.int32), np.array([a]))
    if shape.kind in ROUND_POLYHEDRA:
        mesh = shape.to_mesh(SWEEP_DEVIATION * max(shape.size))
    else:
        mesh = shape_mesh(shape, source)
    return Elements(mesh.vertices, np.asarray(mesh.triangles, dtype=np.int32), np.zeros(len(mesh.triangles)))


def hash_hand(hand: Hand, source: CollisionSource) -> str:
    """Return a SHA-256 over the hand's kinematics and its shapes of one collision source, hexadecimal."""
    return hand.kept(("hash", source), lambda: _hash_hand(hand, source))


def _hash_hand(hand: Hand, source: CollisionSource) -> str:
    digest = hashlib.sha256()
    digest.update(f"{hand.palm} {sorted(hand.fixed_links)}".encode())
    for link in hand.links:
        digest.update(f"|{link.parent} {link.joint} {link.pad_indentation!r}".encode())
        digest.update(np.ascontiguousarray(link.T_parent_link, dtype=np.float64).tobytes())
        for shape in link.shapes.get(source, ()):
            _hash_shape(digest, shape)
    for joint in hand.joints:
        numbers = [*joint.axis, *joint.anchor, joint.lower, joint.upper, joint.reference]
        digest.update(np.array(numbers, dtype=np.float64).tobytes())
    for c in hand.couplings:
        digest.update(f"|{c.leader} {c.follower} {c.ratio!r} {c.offset!r} {c.breakaway}".encode())
    return digest.hexdigest()


def packed_size(packed: PackedObject | BodyArrays) -> int:
    """Return the memory of the arrays of something packed [bytes]; arrays that two trees share count once."""
    found: dict[int, int] = {}

    def count(value: Any) -> None:
        if isinstance(value, np.ndarray):
            found[id(value)] = value.nbytes
        elif isinstance(value, tuple):
            for part in value:
                count(part)

    count(tuple(vars(packed).values()) if isinstance(packed, PackedObject) else packed)
    return sum(found.values())


#: Packed objects, by bodies and collision source, and the bodies of one role.
_packed: Final[KeptBySize[Any]] = KeptBySize(OBJECT_CACHE, packed_size)


def _pack(bodies: tuple[Body, ...], source: CollisionSource) -> PackedObject:
    from clench.kernels.geometry.bodies import pack_triangles, with_grid
    from clench.kernels.trees.bvh import feature_owners

    placed = [(number, shape) for number, body in enumerate(bodies) for shape in body.shapes]
    expect(sum(shape.mesh.triangles.nbytes for _, shape in placed if shape.mesh is not None))
    flat = [(n, shape_mesh(s, source)) for n, s in placed if s.kind not in ROUND_KINDS]
    curved = [(n, shape_mesh(s, source)) for n, s in placed if s.kind in ROUND_KINDS]
    # With `engine` every mesh became a convex hull, which is always closed.
    closed = tuple(body.closed or source is CollisionSource.ENGINE for body in bodies)
    tree = _tree(flat, not all(closed))
    full_tree = _tree(flat + curved, not all(closed)) if curved else tree
    made = _at_once(
        bodies=lambda: _bodies(placed, source) if curved else (pack_triangles(tree), tree.body),
        owners=lambda: feature_owners(full_tree),
        points=lambda: part_points(full_tree),
        digest=lambda: hash_bodies(bodies, source),
    )
    graspable = [n for n, body in enumerate(bodies) if body.role is BodyRole.GRASPABLE]
    everything = _corners(full_tree, slice(None))
    held = everything if len(graspable) == len(bodies) else _corners(full_tree, np.isin(full_tree.body, graspable))
    center = _middle(held)
    return PackedObject(
        tree=tree,
        rounds=_rounds([(n, s) for n, s in placed if s.kind in ROUND_KINDS]),
        full_tree=full_tree,
        full_owners=made["owners"],
        bodies=with_grid(made["bodies"][0]),
        element_body=made["bodies"][1],
        closed=all(closed),
        body_closed=closed,
        body_names=tuple(body.name for body in bodies),
        body_roles=tuple(body.role for body in bodies),
        center=center,
        radius=_reach(everything, center),
        size=_reach(held, center),
        points=made["points"],
        geometry_hash=made["digest"],
    )


def _at_once(**makers: Callable[[], Any]) -> dict[str, Any]:
    """Return the values of functions by name; threads share the functions."""
    made = dict[str, Any]()

    def make(name: str) -> None:
        made[name] = makers[name]()

    share_out(make, makers, core_count())
    return made


def _bodies(placed: list[tuple[int, Shape]], source: CollisionSource) -> tuple[BodyArrays, NDArray[np.int32]]:
    """Return shapes, some of them round, as the elements of one body, and which body of the object each is of."""
    from clench.kernels.geometry.bodies import join_elements, pack_bodies

    elements = [shape_elements(shape, source) for _, shape in placed]
    numbers = np.repeat(np.array([n for n, _ in placed], dtype=np.int32), [len(e.elements) for e in elements])
    joined = pack_bodies([join_elements(elements)])
    return joined, numbers[joined.source]


def _corners(tree: MeshTree, triangles: NDArray[np.bool_] | slice) -> FloatArray:
    """Return the vertices that are corners of some triangles [m], shape (N, 3)."""
    named = np.zeros(len(tree.vertices), dtype=bool)
    named[tree.triangles[triangles]] = True
    return tree.vertices[named]


def _tree(parts: list[tuple[int, TriangleMesh]], is_open: bool) -> MeshTree:
    from clench.kernels.trees.bvh import build_tree

    mesh = TriangleMesh.joined([part for _, part in parts])
    numbers = np.array([n for n, _ in parts], dtype=np.int32)
    body = np.repeat(numbers, [len(part.triangles) for _, part in parts])
    return build_tree(mesh.vertices, mesh.triangles, body, is_open)


def _rounds(placed: list[tuple[int, Shape]]) -> RoundShapes:
    return RoundShapes(
        np.array([ROUND_KINDS[s.kind] for _, s in placed], dtype=np.int32),
        np.array([s.size for _, s in placed], dtype=np.float64).reshape(-1, 3),
        np.array([_flat_matrix(s.pose) for _, s in placed], dtype=np.float64).reshape(-1, 3, 4),
        np.array([n for n, _ in placed], dtype=np.int32),
    )


def _flat_matrix(pose: Pose) -> FloatArray:
    return pose.matrix[:3]


def _middle(points: FloatArray) -> FloatArray:
    if len(points) == 0:
        return np.zeros(3)
    center: FloatArray = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return center


def _reach(points: FloatArray, center: FloatArray) -> float:
    """Return how far points are from a centre at most [m]."""
    return max(
        (float(np.linalg.norm(points[some] - center, axis=1).max()) for some in in_parts(len(points))), default=0.0
    )


def hash_bodies(bodies: tuple[Body, ...], source: CollisionSource) -> str:
    """Return a SHA-256 over an object's bodies for one collision source, hexadecimal; its pose plays no part."""
    digest = hashlib.sha256()
    for body in bodies:
        digest.update(f"|{body.role} {source is CollisionSource.ENGINE}".encode())
        for shape in body.shapes:
            _hash_shape(digest, shape)
    return digest.hexdigest()


def _hash_shape(digest: hashlib._Hash, shape: Shape) -> None:
    digest.update(f"/{shape.kind}".encode())
    digest.update(np.array(shape.size, dtype=np.float64).tobytes())
    digest.update(shape.pose.wxyz_xyz.tobytes())
    if shape.mesh is not None:
        digest.update(f"{shape.mesh.vertices.shape} {shape.mesh.triangles.shape}".encode())
        digest.update(np.ascontiguousarray(shape.mesh.vertices).data)
        digest.update(np.ascontiguousarray(shape.mesh.triangles).data)
