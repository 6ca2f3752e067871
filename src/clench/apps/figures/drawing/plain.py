"""Paint a scene without OpenGL: triangles from the farthest to the nearest, each in one colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clench.core.pose import FloatArray
from clench.models.appearance import Solid, SolidKind, rgb
from clench.models.mesh import TriangleMesh

from .camera import Camera, Picture


def paint(
    solids: Sequence[Solid], meshes: Sequence[TriangleMesh], poses: FloatArray, shown: Sequence[int], camera: Camera
) -> Picture:
    """Return the picture of some solids by a camera.

    Triangles that pass through each other, or are large beside their neighbours, may cover nearer ones. Obstacles
    are painted first, because a table is larger than everything on it.

    Args:
        solids: of the scene. meshes: that stand for those of the solids. poses: of the solids. shown: numbers of the
            solids to paint. camera: the view.
    """
    from PIL import Image, ImageDraw

    corners, owner = _triangles(meshes, poses, shown)
    p = camera.project(corners)
    behind = np.array([solids[k].kind is not SolidKind.OBSTACLE for k in owner], dtype=np.int64)
    order = np.lexsort((p[..., 2].mean(axis=1), behind))
    canvas = Image.new("I", (camera.width, camera.height), -1)
    draw = ImageDraw.Draw(canvas)
    for k in order.tolist():
        draw.polygon(p[k, :, :2].ravel().tolist(), fill=k)
    seen = np.asarray(canvas, dtype=np.int64)
    colors = np.vstack([_shaded(corners, owner, solids, camera), np.ones((1, 3))]).astype(np.float32)
    normals = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    slope = np.divide(-normals[:, :2], normals[:, 2:], out=np.zeros((len(p), 2)), where=np.abs(normals[:, 2:]) > 1e-9)
    nearness = np.full(seen.shape, -np.inf)
    row, column = np.nonzero(seen >= 0)
    t = seen[row, column]
    away = np.column_stack([column + 0.5, row + 0.5]) - p[t, 0, :2]
    depth = p[t, 0, 2] + (slope[t] * away).sum(axis=1)
    nearness[row, column] = np.clip(depth, p[t, :, 2].min(axis=1), p[t, :, 2].max(axis=1))
    return Picture(nearness, np.append(owner, -1)[seen], colors[seen])


def _triangles(
    meshes: Sequence[TriangleMesh], poses: FloatArray, shown: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Return the corners of all triangles in the world [m], shape (T, 3, 3), and the solid of each, shape (T,)."""
    corners, owner = [np.empty((0, 3, 3))], [np.empty(0, dtype=np.int64)]
    for k in shown:
        mesh, T = meshes[k], poses[k]
        corners.append((mesh.vertices @ T[:3, :3].T + T[:3, 3])[mesh.triangles])
        owner.append(np.full(len(mesh.triangles), k))
    return np.concatenate(corners), np.concatenate(owner)


def _shaded(corners: FloatArray, owner: FloatArray, solids: Sequence[Solid], camera: Camera) -> FloatArray:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(sizes > 0.0, sizes, 1.0)
    facing = np.where((normals @ camera.towards)[:, None] < 0.0, -normals, normals)
    key = camera.towards - 0.55 * camera.right + 0.75 * camera.up
    light = 0.42 + 0.50 * np.maximum(facing @ (key / np.linalg.norm(key)), 0.0) + 0.14 * (facing @ camera.towards)
    colors = np.array([rgb(solid.color) for solid in solids]).reshape(-1, 3)[owner.astype(np.int64)]
    lit: FloatArray = np.clip(colors * light[:, None], 0.0, 1.0)
    return lit
