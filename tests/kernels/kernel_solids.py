"""Solids as triangle meshes, and the same as other engines want them."""

import numpy as np

from clench.models.mesh import TriangleMesh


def ball(subdivisions=3, radius=1.0):
    import trimesh

    return plain(trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius))


def torus(major, minor, *, major_sections=32, minor_sections=16):
    import trimesh

    return plain(trimesh.creation.torus(major, minor, major_sections=major_sections, minor_sections=minor_sections))


def box(*sizes):
    import trimesh

    return plain(trimesh.creation.box(sizes))


def hull(seed, size):
    import trimesh

    return plain(trimesh.convex.convex_hull(np.random.default_rng(seed).normal(size=(30, 3)) * size))


def star(seed, size):
    base = ball(2, size)
    lengths = np.random.default_rng(seed).uniform(0.5, 1.5, (len(base.vertices), 1))
    return TriangleMesh(base.vertices * lengths, base.triangles)


def plain(mesh):
    return TriangleMesh(mesh.vertices, mesh.faces)


def moved(mesh, T, scale=1.0):
    return TriangleMesh((mesh.vertices @ T[:3, :3].T + T[:3, 3]) * scale, mesh.triangles)


def bounding_volumes(mesh):
    import fcl

    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices), len(mesh.triangles))
    model.addSubModel(mesh.vertices, mesh.triangles)
    model.endModel()
    return model


def gap(a, T_a, b, T_b):
    """Return the distance between two bounding volumes at poses, by fcl; 0 when they meet."""
    import fcl

    return fcl.distance(
        fcl.CollisionObject(a, fcl.Transform(T_a[:3, :3], T_a[:3, 3])),
        fcl.CollisionObject(b, fcl.Transform(T_b[:3, :3], T_b[:3, 3])),
        fcl.DistanceRequest(),
        fcl.DistanceResult(),
    )
