"""Mesh files, read through trimesh into plain arrays."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from clench.core.exceptions import FileError
from clench.core.files.file_bytes import read_file
from clench.core.files.file_limits import MESH_BYTES
from clench.core.memory import expect
from clench.core.pose import FloatArray
from clench.models.mesh import IntArray
from clench.models.mesh_parsing import MeshError, arrays_of, parse_mesh

from .topology import compact

#: Below this there is nothing to merge by: the check of sizes will refuse it [-].
SMALLEST_COORDINATE: Final = 1e-100
#: Places are told apart by this fraction of the largest coordinate, rounded up to a power of two [-].
_PLACES: Final = 1e8
#: Odd factors, one per column: a sum of products tells rows apart, next to always.
_FACTORS: Final = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
SUFFIXES: Final = (".obj", ".stl", ".ply", ".off", ".glb")


def read_mesh(path: Path) -> tuple[FloatArray, IntArray]:
    """Read vertices (V, 3) and triangles (T, 3) of a mesh file, in the file's units; a scene becomes one mesh.

    Vertices at one place are merged regardless of texture or normal, so that a closed surface is recognised.

    Raises:
        FileError: the file is missing, a directory, not one of `SUFFIXES`, or no mesh.
    """
    suffix = path.suffix.lower()
    if os.path.exists(path) and not os.path.isdir(path) and suffix not in SUFFIXES:
        raise FileError(path, f"cannot read '{suffix or path.name}'; expected one of {', '.join(SUFFIXES)}.")
    data = read_file(path, MESH_BYTES)
    if not data:
        raise FileError(path, "the file is empty.")
    expect(len(data))
    try:
        vertices, triangles = arrays_of(parse_mesh(data, suffix))
    except (MeshError, FileError) as error:
        raise FileError(path, f"not a readable {suffix[1:].upper()} mesh ({error}).") from None
    if len(vertices) == 0:
        raise FileError(path, f"not a mesh, nothing in it reads as {suffix[1:].upper()}.")
    if len(triangles) == 0:
        raise FileError(path, f"has {len(vertices)} points but no triangles.")
    return merged(vertices, triangles)


def merged(vertices: ArrayLike, triangles: ArrayLike) -> tuple[FloatArray, IntArray]:
    """Return a mesh whose vertices at one place (to 1e-8 of the largest coordinate) are one vertex.

    Vertices that no triangle names are dropped.

    Coordinates that are not finite and indices out of range are left for the check to report.
    """
    points, faces = np.asarray(vertices, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    if not np.isfinite(points).all() or faces.size == 0 or faces.min() < 0 or faces.max() >= len(points):
        return points, faces
    largest = float(np.abs(points).max(initial=0.0))
    if largest < SMALLEST_COORDINATE:
        return points, faces
    used, faces = compact(faces)
    points = points[used]
    # Powers of two scale exactly; coordinates far from 1 overflow the rounding to whole numbers.
    scaled = np.ldexp(points, -int(np.frexp(largest)[1]))
    scaled *= _PLACES
    first, place = _distinct_rows(np.round(scaled, out=scaled).astype(np.int64))
    if len(first) == len(points):
        return points, faces
    return points[first], place[faces]


def _distinct_rows(rows: IntArray) -> tuple[IntArray, IntArray]:
    """Return the first row of each kind, in order, and for every row the number of its kind.

    Args:
        rows: shape (N, 3).
    """
    each = np.arange(len(rows))
    keys = (rows.view(np.uint64) * _FACTORS).sum(axis=1, dtype=np.uint64)
    ordered = np.sort(keys)
    if not (ordered[1:] == ordered[:-1]).any():
        return each, each
    order = np.argsort(keys)
    same = np.concatenate([[False], keys[order[1:]] == keys[order[:-1]]])
    if (rows[order[1:]] != rows[order[:-1]]).any(axis=1)[same[1:]].any():
        # Different rows have equal keys: next to never, unless the rows were made for it.
        order = np.lexsort(rows.T)
        same = np.concatenate([[False], (rows[order[1:]] == rows[order[:-1]]).all(axis=1)])
    starts = np.flatnonzero(~same)
    first = np.minimum.reduceat(order, starts)
    kind = np.empty(len(rows), dtype=np.int64)
    kind[order] = first[np.cumsum(~same) - 1]
    is_first = kind == each
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[kind]
