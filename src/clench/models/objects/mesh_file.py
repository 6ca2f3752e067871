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

#: Below this there is nothing to merge by: the check of sizes will refuse it [-].
SMALLEST_COORDINATE: Final = 1e-100
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

    Coordinates that are not finite and indices out of range are left for the check to report.
    """
    import trimesh

    points, faces = np.asarray(vertices, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    if not np.isfinite(points).all() or faces.size == 0 or faces.min() < 0 or faces.max() >= len(points):
        return points, faces
    largest = float(np.abs(points).max(initial=0.0))
    if largest < SMALLEST_COORDINATE:
        return points, faces
    # Powers of two scale exactly; coordinates far from 1 overflow the rounding to whole numbers.
    exponent = int(np.frexp(largest)[1])
    scaled = np.ldexp(points, -exponent)
    mesh = trimesh.Trimesh(scaled, faces, process=False, validate=False)
    try:
        mesh.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=8)
    except OverflowError:
        # A coordinate far larger than all others overflows trimesh's packing of rows into whole numbers.
        rounded = np.round(scaled * 1e8).astype(np.int64)
        _, first, place = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        return points[first], place.reshape(-1)[faces]
    return np.ldexp(np.array(mesh.vertices, dtype=np.float64), exponent), np.array(mesh.faces, dtype=np.int64)
