"""Read the shapes of every link for the three collision sources."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.core.pose import Pose
from clench.models.hand.findings import Finding, FindingCode
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind

from .compiled import CompiledModel

#: Geometry in the first groups is drawn by default in MuJoCo's viewers.
_DRAWN_GROUPS = 3

Shapes = dict[CollisionSource, tuple[Shape, ...]]


class ShapeReader:
    """Read shapes body by body; meshes that several geoms use are shared."""

    def __init__(self, compiled: CompiledModel) -> None:
        self.compiled = compiled
        self.findings: list[Finding] = []
        self._raw: dict[int, TriangleMesh] = {}
        self._hulls: dict[int, TriangleMesh] = {}

    def shapes(self, body: int) -> Shapes:
        """Return the shapes of a body, in its frame, by collision source."""
        m = self.compiled.model
        start = int(m.body_geomadr[body])
        geoms = [g for g in range(start, start + int(m.body_geomnum[body])) if self._is_solid(g)]
        colliding = [g for g in geoms if collides(m, g)]
        drawn = [g for g in geoms if not collides(m, g)] or [g for g in geoms if m.geom_group[g] < _DRAWN_GROUPS]
        return {
            CollisionSource.ENGINE: tuple(self._shape(g, hull=True) for g in colliding),
            CollisionSource.RAW: tuple(self._shape(g, hull=False) for g in colliding),
            CollisionSource.VISUAL: tuple(self._shape(g, hull=False) for g in drawn),
        }

    def _is_solid(self, g: int) -> bool:
        kind = int(self.compiled.model.geom_type[g])
        if kind in _kinds():
            return True
        body = self.compiled.body_name(int(self.compiled.model.geom_bodyid[g]))
        self.findings.append(
            Finding(
                FindingCode.SHAPE_LEFT_OUT,
                f"Link '{body}' has a plane, height field or distance field; it is left out.",
                "Give the link a mesh or a simple shape if it is to touch anything there.",
                links=(body,),
            )
        )
        return False

    def _shape(self, g: int, *, hull: bool) -> Shape:
        m = self.compiled.model
        kind = _kinds()[int(m.geom_type[g])]
        name = str(m.geom(g).name)
        mesh = None
        size = tuple(float(x) for x in m.geom_size[g])
        if kind is ShapeKind.MESH:
            number = int(m.geom_dataid[g])
            mesh = self._hull(number) if hull else self._triangles(number)
            name = name or str(m.mesh(number).name)
            size = (0.0, 0.0, 0.0)
        elif kind is ShapeKind.SPHERE:
            size = (size[0], 0.0, 0.0)
        elif kind in (ShapeKind.CAPSULE, ShapeKind.CYLINDER):
            size = (size[0], size[1], 0.0)
        body = self.compiled.body_name(int(m.geom_bodyid[g]))
        return Shape(
            kind=kind,
            size=(size[0], size[1], size[2]),
            pose=Pose(m.geom_pos[g], m.geom_quat[g]),
            mesh=mesh,
            name=name or f"{body}/{kind}{g - int(m.body_geomadr[m.geom_bodyid[g]])}",
        )

    def _triangles(self, mesh: int) -> TriangleMesh:
        if mesh not in self._raw:
            m = self.compiled.model
            v, f = int(m.mesh_vertadr[mesh]), int(m.mesh_faceadr[mesh])
            vertices = m.mesh_vert[v : v + int(m.mesh_vertnum[mesh])]
            self._raw[mesh] = TriangleMesh(vertices, m.mesh_face[f : f + int(m.mesh_facenum[mesh])])
        return self._raw[mesh]

    def _hull(self, mesh: int) -> TriangleMesh:
        if mesh not in self._hulls:
            graph = int(self.compiled.model.mesh_graphadr[mesh])
            raw = self._triangles(mesh)
            self._hulls[mesh] = _computed_hull(raw) if graph < 0 else self._stored_hull(raw, graph)
        return self._hulls[mesh]

    def _stored_hull(self, raw: TriangleMesh, graph: int) -> TriangleMesh:
        """Return the hull that MuJoCo collides, from its vertex graph."""
        data = self.compiled.model.mesh_graph[graph:]
        vertices, faces = int(data[0]), int(data[1])
        start = 2 + 2 * vertices + vertices + 3 * faces
        return _compact(raw.vertices, np.array(data[start : start + 3 * faces]).reshape(-1, 3))


def collides(model: Any, geom: int) -> bool:
    """Return whether a geom can collide with anything."""
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


def bodies_without_collision(compiled: CompiledModel, bodies: list[int], palm: int) -> set[int]:
    """Return bodies that collide with their visual geometry: bodies of moving groups without collision geometry.

    A group is a set of bodies fixed to each other. A group with some collision geometry is left as its author made it.
    Bodies before the palm are left alone too.
    """
    m = compiled.model
    groups: dict[int, list[int]] = {}
    for body in bodies:
        if body >= palm:
            groups.setdefault(int(m.body_weldid[body]), []).append(body)
    bare: set[int] = set()
    for members in groups.values():
        geoms = {b: range(int(m.body_geomadr[b]), int(m.body_geomadr[b]) + int(m.body_geomnum[b])) for b in members}
        if not any(collides(m, g) for spans in geoms.values() for g in spans):
            bare.update(b for b, spans in geoms.items() if len(spans) and b > 0)
    return bare


def _computed_hull(raw: TriangleMesh) -> TriangleMesh:
    from scipy.spatial import ConvexHull

    return _compact(raw.vertices, ConvexHull(raw.vertices).simplices)


def _compact(vertices: np.ndarray, triangles: np.ndarray) -> TriangleMesh:
    """Keep the vertices in use and turn every triangle of a convex surface outwards."""
    used, local = np.unique(triangles, return_inverse=True)
    kept = vertices[used]
    faces = local.reshape(-1, 3)
    a, b, c = kept[faces[:, 0]], kept[faces[:, 1]], kept[faces[:, 2]]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - kept.mean(axis=0)) < 0.0
    faces = np.where(inward[:, None], faces[:, ::-1], faces)
    return TriangleMesh(kept, faces)


def _kinds() -> dict[int, ShapeKind]:
    import mujoco

    g = mujoco.mjtGeom
    return {
        int(g.mjGEOM_SPHERE): ShapeKind.SPHERE,
        int(g.mjGEOM_CAPSULE): ShapeKind.CAPSULE,
        int(g.mjGEOM_CYLINDER): ShapeKind.CYLINDER,
        int(g.mjGEOM_BOX): ShapeKind.BOX,
        int(g.mjGEOM_ELLIPSOID): ShapeKind.ELLIPSOID,
        int(g.mjGEOM_MESH): ShapeKind.MESH,
    }
