"""An independent collision library (python-fcl): exact gaps of a posed hand, and what a query costs there."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import PackedObject
from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray
from clench.models.hand.hand import Finger, Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.models.tessellation import shape_mesh

if TYPE_CHECKING:
    from .kernels.stepped_closing import StepLog

#: How far the triangles of cylinders and ellipsoids lie inside them where gaps are measured [m].
_DEVIATION: Final = 1e-7
#: Far enough that the library sees at its first box that nothing collides [m].
_FAR: Final = 1e3


@dataclass(frozen=True, eq=False)
class _Core:
    """A core with its radius, as the library's tree over triangles, and the ball around it."""

    placed: Any
    radius: float
    middle: FloatArray
    reach: float


class Engine:
    """Measure a hand and an object by python-fcl; nothing here uses this project's kernels, except how deep meshes are.

    Args:
        hand: the hand. obj: the object. packed: the same. source: geometry of the hand.

    Raises:
        CommandError: python-fcl is not installed.
    """

    def __init__(self, hand: Hand, obj: GraspObject, packed: PackedObject, source: CollisionSource) -> None:
        self._fcl = _library()
        self.hand, self.packed, self.source = hand, packed, source
        solid = set(hand.solid_links)
        shapes = [link.shapes.get(source, ()) if i in solid else () for i, link in enumerate(hand.links)]
        self._links = [[self._core(shape, source) for shape in own] for own in shapes]
        objects = [shape for body in obj.bodies for shape in body.shapes]
        of_object = CollisionSource(obj.collision_source)
        self._objects = [self._core(shape, of_object) for shape in objects]
        self._link_trees = [self._tree([shape_mesh(s, source) for s in own]) if own else None for own in shapes]
        self._object_tree = self._tree([shape_mesh(shape, of_object) for shape in objects])

    def finger_gap(self, finger: Finger, poses: FloatArray, T_palm_object: FloatArray, q: FloatArray) -> float:
        """Return the gap between a finger and the object [m], below zero where they overlap.

        Args:
            poses: `T_palm_link` of all links at the posture `q`, (L, 4, 4). T_palm_object: (4, 4).
        """
        return min((self.link_gap(link, poses[link], T_palm_object, q) for link in finger.links), default=np.inf)

    def link_gap(self, link: int, T_palm_link: FloatArray, T_palm_object: FloatArray, q: FloatArray) -> float:
        """Return the gap between a link and the object [m], below zero where they overlap; see `finger_gap`."""
        T = np.linalg.inv(T_palm_object) @ T_palm_link
        least = np.inf
        for core in self._links[link]:
            middle = T[:3, :3] @ core.middle + T[:3, 3]
            for other in self._objects:
                if np.linalg.norm(middle - other.middle) - core.reach - other.reach < least:
                    least = min(least, self._gap(core, other, T))
        if least > -np.inf:
            return float(least)
        deep = hand_depths(self.hand, q, self.packed, T_palm_object, self.source, links=[link])
        return -max([found.depth for found in deep], default=0.0)

    def time_queries(self, log: StepLog, T_palm_object: FloatArray) -> tuple[float, float, float]:
        """Ask the library what a stepper asked; return the time of a collision, of a distance, and of a mere call [s].

        Its triangles of round shapes are as fine as those whose depth is measured. A mere call finds that everything
        is far away. Without a query of a kind its time is 0.
        """
        rows = log.queries[log.queries[:, 0] >= 0]
        base = np.linalg.inv(T_palm_object) @ self.hand.link_poses(log.postures[0]) if len(rows) else np.eye(4)
        placed: list[list[tuple[Any, Any]]] = [[], []]
        for (link, kind, _), q in zip(rows, log.postures, strict=False):
            base = np.linalg.inv(T_palm_object) @ self.hand.link_poses(q)[link]
            placed[kind].append((self._link_trees[link], self._fcl.Transform(base[:3, :3], base[:3, 3])))
        far = self._fcl.Transform(np.array([_FAR, 0.0, 0.0]))
        mere = self._timed(self._fcl.collide, [(tree, far) for tree, _ in placed[0]])
        return self._timed(self._fcl.collide, placed[0]), self._timed(self._distance, placed[1]), mere

    def _timed(self, ask: Any, placed: Sequence[tuple[Any, Any]]) -> float:
        start = time.process_time()
        for tree, T in placed:
            tree.setTransform(T)
            ask(tree, self._object_tree)
        return (time.process_time() - start) / max(len(placed), 1)

    def _distance(self, one: Any, other: Any) -> float:
        return float(self._fcl.distance(one, other))

    def _gap(self, core: _Core, other: _Core, T_object_link: FloatArray) -> float:
        core.placed.setTransform(self._fcl.Transform(T_object_link[:3, :3], T_object_link[:3, 3]))
        found = self._distance(core.placed, other.placed)
        # The library says 0, not how deep, where cores cross.
        return found - core.radius - other.radius if found > 0.0 else -np.inf

    def _core(self, shape: Shape, source: CollisionSource) -> _Core:
        if shape.kind in (ShapeKind.CAPSULE, ShapeKind.SPHERE):
            half = shape.size[1] if shape.kind is ShapeKind.CAPSULE else 0.0
            ends = shape.pose.apply(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]))
            mesh, radius = TriangleMesh(ends, np.array([[0, 1, 1]])), shape.size[0]
        elif shape.kind in (ShapeKind.CYLINDER, ShapeKind.ELLIPSOID):
            mesh, radius = shape.to_mesh(_DEVIATION), 0.0
        else:
            mesh, radius = shape_mesh(shape, source), 0.0
        middle = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
        reach = float(np.linalg.norm(mesh.vertices - middle, axis=1).max()) + radius
        return _Core(self._tree([mesh]), radius, middle, reach)

    def _tree(self, meshes: list[TriangleMesh]) -> Any:
        mesh = TriangleMesh.joined(meshes)
        model = self._fcl.BVHModel()
        model.beginModel(len(mesh.vertices), len(mesh.triangles))
        model.addSubModel(mesh.vertices, mesh.triangles)
        model.endModel()
        return self._fcl.CollisionObject(model)


def _library() -> Any:
    try:
        import fcl
    except ImportError:
        raise CommandError(
            "this benchmark measures gaps with python-fcl, which is not installed; run: pip install python-fcl."
        ) from None
    return fcl
