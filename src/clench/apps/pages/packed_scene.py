"""Pack meshes and motions into the data of a page: small numbers, as text."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray, Pose
from clench.core.showing.visible_text import visible
from clench.models.appearance import Solid, SolidKind
from clench.models.mesh import TriangleMesh

#: Corners are whole steps from the lowest one, at most so many: 2 µm on a link of 13 cm.
_STEPS: Final = (1 << 16) - 1
#: Points that say how large a solid is.
_SAMPLE: Final = 400


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses of all solids over time.

    Args:
        poses: in the world, at even times, shape (F, N, 4, 4). duration: from the first to the last [s].
    """

    poses: FloatArray
    duration: float


@dataclass(frozen=True, eq=False)
class Mark:
    """Where a contact is: position [m] and unit normal out of the object, shape (3,) each."""

    position: FloatArray
    normal: FloatArray


def packed_solid(solid: Solid) -> dict[str, Any]:
    """Return the mesh of a solid, its corners merged and rounded to a 65535th of its size."""
    mesh = solid.mesh
    low = mesh.vertices.min(axis=0, initial=np.inf) if len(mesh.vertices) else np.zeros(3)
    step = (np.ptp(mesh.vertices, axis=0) if len(mesh.vertices) else np.zeros(3)) / _STEPS
    corners, triangles = _merged(mesh, low, step)
    wide = len(corners) > _STEPS
    return {
        "name": visible(solid.name),
        "kind": solid.kind.value,
        "color": solid.color,
        "low": low.tolist(),
        "step": step.tolist(),
        "wide": wide,
        "vertices": _text(corners.astype("<u2")),
        "triangles": _text(triangles.astype("<u4" if wide else "<u2")),
    }


def packed_motion(motion: Motion) -> list[str]:
    """Return the poses of every solid as positions and quaternions (wxyz); one of a solid that stands still."""
    tracks = []
    for poses in motion.poses.transpose(1, 0, 2, 3):
        still = np.allclose(poses, poses[0], rtol=0.0, atol=1e-9)
        rows = [(*pose.position, *pose.wxyz) for pose in map(Pose.from_matrix, poses[:1] if still else poses)]
        track = np.array(rows)
        for k in range(1, len(track)):  # the same side of the sphere, so that poses between two are near both
            if track[k, 3:] @ track[k - 1, 3:] < 0.0:
                track[k, 3:] *= -1.0
        tracks.append(_text(track.astype("<f4")))
    return tracks


def packed_view(solids: Sequence[Solid], poses: FloatArray, marks: Sequence[Mark]) -> dict[str, Any]:
    """Return from where a scene is seen at first: middle and radius [m] of hand and object, and the direction.

    The viewer is across from the palm, a little above, and to the side of the line along which contacts are spread.
    """
    kinds = (SolidKind.HAND, SolidKind.OBJECT)
    placed = [
        corners @ T[:3, :3].T + T[:3, 3]
        for solid, T in zip(solids, poses, strict=True)
        if solid.kind in kinds and len(corners := _some(solid.mesh.vertices))
    ]
    points = np.concatenate(placed) if placed else np.zeros((1, 3))
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    palm = next((T[:3, 3] for s, T in zip(solids, poses, strict=True) if s.kind is SolidKind.HAND), middle)
    places = np.array([mark.position for mark in marks]).reshape(-1, 3)
    away = (places.mean(axis=0) if len(places) else middle) - palm
    spread = np.linalg.svd(places - places.mean(axis=0))[2][0] if len(places) > 1 else np.array([0.0, 1.0, 0.0])
    aside = np.cross(_unit(away), spread)
    towards = _unit(_unit(away) * 0.35 + _unit(aside) * (1.0 if aside[2] >= 0.0 else -1.0))
    towards[2] = np.clip(towards[2], 0.25, 0.7)
    return {
        "middle": middle.tolist(),
        "radius": float(np.linalg.norm(points - middle, axis=1).max()) or 0.1,
        "towards": _unit(towards).tolist(),
    }


def _merged(mesh: TriangleMesh, low: FloatArray, step: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rounded corners, each place once, and the triangles that are left, shape (T, 3)."""
    rounded = np.round((mesh.vertices - low) / np.where(step > 0.0, step, 1.0)).astype(np.int64).reshape(-1, 3)
    corners, index = np.unique(rounded, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[mesh.triangles]
    a, b, c = triangles.T
    return corners, triangles[(a != b) & (b != c) & (c != a)]


def _some(vertices: FloatArray) -> FloatArray:
    return vertices[:: max(len(vertices) // _SAMPLE, 1)]


def _unit(vector: FloatArray) -> FloatArray:
    size = float(np.linalg.norm(vector))
    unit: FloatArray = vector / size if size > 1e-9 else np.array([0.6, -0.7, 0.4])
    return unit


def _text(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
