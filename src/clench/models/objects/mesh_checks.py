"""Check a mesh before its use: numbers, degenerate triangles, holes, winding, units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.exceptions import ObjectError
from clench.core.memory import expect, in_parts
from clench.core.numbers import real_array
from clench.core.pose import FloatArray
from clench.core.tolerances import LARGEST_LENGTH, SMALLEST_LENGTH
from clench.models.mesh import IntArray, TriangleMesh
from clench.models.shapes import Shape

from .topology import compact, components, edge_defects, parted, winding_number, without_flaps

#: Objects larger than this probably have units of millimetres [m]; smaller than `SMALL`, something else is wrong.
LARGE: Final = 2.0
#: Factor for lengths in millimetres.
MILLIMETRE: Final = 1e-3
SMALL: Final = 1e-3
#: Coordinates of meshes are below this before they are scaled to metres, in every unit [-].
LARGEST_COORDINATE: Final = 1e15
#: A triangle is degenerate when its height is below this fraction of its longest side [-].
DEGENERATE_HEIGHT: Final = 1e-10
#: A component encloses nothing when its volume is below this fraction of its size cubed [-].
NO_VOLUME: Final = 1e-12


@dataclass(frozen=True)
class CheckedMesh:
    """A mesh that is fit to use: whether it is closed and wound outwards, and warnings about it."""

    mesh: TriangleMesh
    closed: bool
    warnings: tuple[str, ...]


def check_mesh(vertices: ArrayLike, triangles: ArrayLike, name: str) -> CheckedMesh:
    """Check the arrays of a mesh and repair defects that have one repair.

    Degenerate and repeated triangles are dropped, parts that are wound inwards are turned. `closed` is true when every
    edge has exactly two uses, in opposite directions, and every part of the surface is wound outwards.

    Args:
        vertices: [m], shape (V, 3). triangles: shape (T, 3). name: for messages.

    Raises:
        ObjectError: wrong shape, empty, not finite, an index out of range, only degenerate triangles.
    """
    points, faces = mesh_arrays(vertices, triangles, name)
    warnings: list[str] = []
    faces = _without_repeats(faces, name, warnings)
    faces, closed = _manifold(faces, len(points), name, warnings)
    used, faces = compact(faces)
    points = points[used % len(points)]
    if closed:
        faces, closed = _wound_outwards(points, faces, name, warnings)
    # Slivers with three different corners enclose nothing, so dropping them leaves the surface closed.
    faces = _without_slivers(points, faces, name, warnings)
    used, faces = compact(faces)
    return CheckedMesh(TriangleMesh(points[used], faces), closed, tuple(warnings))


def unit_warnings(vertices: FloatArray, name: str, scale: float = 1.0) -> tuple[str, ...]:
    """Return a sentence when the size of an object looks as if its units were others than metres.

    Args:
        vertices: [m], shape (V, 3). name: for messages. scale: that it was loaded with [-].
    """
    extent = float(np.ptp(vertices, axis=0).max())
    if extent > LARGE:
        return (f"{name} is {extent:.4g} m across: {smaller(scale)}.",)
    if extent < SMALL:
        return (f"{name} is only {extent:.4g} m across: {larger(scale)}.",)
    return ()


def smaller(scale: float) -> str:
    """Return the advice for an object that is too large, by the scale that it was loaded with [-]."""
    advised = f"load it with a scale of {MILLIMETRE * scale:g} (--scale {MILLIMETRE * scale:g})"
    if scale == 1.0:
        return f"if its lengths are in millimetres, {advised}"
    return f"if the scale of {scale:g} makes it a thousand times too large, {advised}"


def larger(scale: float) -> str:
    """Return the advice for an object that is too small, by the scale that it was loaded with [-]."""
    if scale == 1.0:
        return "if its units are not metres, load it with another scale (--scale)"
    advised = f"load it with a scale of {scale / MILLIMETRE:g} (--scale {scale / MILLIMETRE:g})"
    return f"if the scale of {scale:g} makes it a thousand times too small, {advised}"


def check_size(shape: Shape, name: str) -> None:
    """Check that a shape has the size of a thing, in metres.

    Raises:
        ObjectError: names its size and the expected size.
    """
    if shape.mesh is not None:
        sizes = [float(np.ptp(shape.mesh.vertices, axis=0).max())]
    else:
        sizes = list(shape.size[: shape.kind.lengths])
    if not sizes or min(sizes) < SMALLEST_LENGTH or max(sizes) > LARGEST_LENGTH:
        raise ObjectError(
            f"{name}: expected lengths from {SMALLEST_LENGTH:g} to {LARGEST_LENGTH:g} m, "
            f"got {', '.join(f'{size:.4g}' for size in sizes) or 'none'}."
        )


def mesh_arrays(vertices: ArrayLike, triangles: ArrayLike, name: str) -> tuple[FloatArray, IntArray]:
    """Return vertices (V, 3) and triangles (T, 3) as arrays of the right kind.

    Raises:
        ObjectError: wrong shape, empty, not finite, an index out of range.
    """
    points = real_array(vertices)
    if points is None or real_array(triangles) is None:
        raise ObjectError(f"{name}: expected arrays of numbers for vertices (V, 3) and triangles (T, 3).")
    indices = np.asarray(triangles)
    with np.errstate(invalid="ignore"):  # what is no number is refused below
        faces = indices.astype(np.int64)
    expect(points.nbytes + faces.nbytes)
    if points.size == 0 or faces.size == 0:
        missing = "vertices" if points.size == 0 else "triangles"
        raise ObjectError(f"{name}: the mesh is empty, it has no {missing}.")
    if points.ndim != 2 or points.shape[1] != 3:
        raise ObjectError(f"{name}: expected vertices of shape (V, 3), got {points.shape}.")
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise ObjectError(f"{name}: expected triangles of shape (T, 3), got {faces.shape}.")
    bad = int(np.count_nonzero(~np.isfinite(points).all(axis=1)))
    if bad:
        raise ObjectError(
            f"{name}: {bad} of {len(points)} vertices are NaN or infinite; expected finite numbers in metres."
        )
    largest = float(np.abs(points).max())
    if largest > LARGEST_COORDINATE:
        raise ObjectError(f"{name}: expected coordinates up to {LARGEST_COORDINATE:g}, got {largest:.4g}.")
    if not np.array_equal(indices, faces):
        raise ObjectError(f"{name}: expected whole numbers as vertex indices of triangles.")
    outside = (faces < 0) | (faces >= len(points))
    if outside.any():
        first = int(np.flatnonzero(outside.any(axis=1))[0])
        raise ObjectError(
            f"{name}: triangle {first} names vertex {faces[outside][0]}, but there are {len(points)} vertices."
        )
    return points, faces


def _without_repeats(faces: IntArray, name: str, warnings: list[str]) -> IntArray:
    """Drop triangles that name a vertex twice, and duplicates."""
    distinct = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    if not distinct.all():
        warnings.append(
            f"{name}: dropped {_count(int(np.count_nonzero(~distinct)), 'triangle')} naming one vertex twice."
        )
        faces = faces[distinct]
    if not len(faces):
        raise ObjectError(f"{name}: every triangle is degenerate.")
    if not _some_repeat(faces):
        return faces
    start = np.argmin(faces, axis=1)
    each = np.arange(len(faces))
    turned = np.column_stack([faces[each, (start + k) % 3] for k in range(3)])
    _, first = np.unique(turned, axis=0, return_index=True)
    if len(first) < len(faces):
        warnings.append(f"{name}: dropped {_count(len(faces) - len(first), 'triangle')} repeating another one.")
        faces = faces[np.sort(first)]
    return faces


def _some_repeat(faces: IntArray) -> bool:
    """Say whether triangles may repeat others, given that each names three vertices."""
    a, b, c = (faces[:, k].astype(np.uint64) for k in range(3))
    size, least, most = np.uint64(faces.max() + 1), np.minimum(a, b), np.maximum(a, b)
    middle = np.minimum(np.maximum(least, c), most)
    least, most = np.minimum(least, c), np.maximum(most, c)
    upwards = ((a < b) ^ (b < c)) ^ (c < a)
    # Sums that overflow are still equal for equal triangles: without equal sums, there are no equal triangles.
    keys = ((least * size + middle) * size + most) * np.uint64(2) + upwards
    keys.sort()
    return bool((keys[1:] == keys[:-1]).any())


def _without_slivers(points: FloatArray, faces: IntArray, name: str, warnings: list[str]) -> IntArray:
    """Drop triangles without area, whose normal would be noise."""
    fine = np.concatenate([_have_area(points, faces[some]) for some in in_parts(len(faces))])
    if not fine.any():
        raise ObjectError(f"{name}: every triangle is degenerate.")
    if not fine.all():
        warnings.append(f"{name}: dropped {_count(int(np.count_nonzero(~fine)), 'triangle')} without area.")
    kept: IntArray = faces[fine]
    return kept


def _have_area(points: FloatArray, faces: IntArray) -> NDArray[np.bool_]:
    a, b, c = (points[faces[:, k]] for k in range(3))
    u, v, w = b - a, c - b, a - c
    area2 = np.sqrt(_squares(_crossed(u, -w)))
    longest2 = np.maximum(np.maximum(_squares(u), _squares(v)), _squares(w))
    fine: NDArray[np.bool_] = area2 > DEGENERATE_HEIGHT * longest2
    return fine


def _squares(vectors: FloatArray) -> FloatArray:
    squares: FloatArray = np.einsum("ij,ij->i", vectors, vectors)
    return squares


def _crossed(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return cross products of rows; `np.cross` takes three times as long."""
    out = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[:, k] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return out


def _manifold(faces: IntArray, vertices: int, name: str, warnings: list[str]) -> tuple[IntArray, bool]:
    """Return triangles and whether the surface is closed; report the defects otherwise.

    Edges with more than two uses have two harmless causes, which are undone here. Flaps are two triangles back to back,
    left after rounding collapsed a short edge. Solids that share an edge get vertices of their own.
    """
    defects = edge_defects(faces)
    if defects.crowded:
        flat = without_flaps(faces)
        for repaired in (flat, parted(faces, vertices), parted(flat, vertices)) if len(flat) else ():
            if edge_defects(repaired).none:
                if len(repaired) < len(faces):
                    dropped = _count(len(faces) - len(repaired), "triangle")
                    warnings.append(f"{name}: dropped {dropped} lying back to back.")
                return repaired, True
    consequence = "it is used as an open surface, from both sides."
    if defects.holes:
        edges = _count(defects.holes, "edge")
        warnings.append(f"{name}: not watertight, {edges} with a triangle on one side only; {consequence}")
    if defects.crowded:
        warnings.append(f"{name}: {_count(defects.crowded, 'edge')} with more than two triangles; {consequence}")
    if defects.twisted:
        warnings.append(f"{name}: winding is inconsistent at {_count(defects.twisted, 'edge')}; {consequence}")
    return faces, defects.none


def _wound_outwards(points: FloatArray, faces: IntArray, name: str, warnings: list[str]) -> tuple[IntArray, bool]:
    """Turn the components of a closed surface that are inside out; a component inside another one is a cavity."""
    component = components(faces, len(points))
    # About the middle of the bounding box, so that an object far from the origin loses no digits.
    centered = points - (points.min(axis=0) + points.max(axis=0)) / 2.0
    parts = np.concatenate([_spanned(centered, faces[some]) for some in in_parts(len(faces))])
    volume = np.bincount(component, weights=parts)
    size = float(np.ptp(points, axis=0).max())
    if (np.abs(volume) < NO_VOLUME * size**3).any():
        warnings.append(f"{name}: a part of its surface encloses no volume; it is used from both sides.")
        return faces, False
    faces = faces.copy()
    turned = 0
    for k in np.flatnonzero(volume < 0):
        mine = component == k
        others = ~mine & (volume[component] > 0)
        inside = others.any() and winding_number(points[faces[mine][0]].mean(axis=0), points, faces[others]) > 0.5
        if not inside:
            faces[mine] = faces[mine][:, ::-1]
            turned += 1
    if turned:
        what = "its triangles were" if turned == len(volume) else f"{turned} of its {len(volume)} parts were"
        warnings.append(f"{name}: {what} wound inwards and have been turned.")
    return faces, True


def _spanned(points: FloatArray, faces: IntArray) -> FloatArray:
    """Return the signed volume between each triangle and the origin."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    volume: FloatArray = np.einsum("ij,ij->i", a, _crossed(b, c)) / 6.0
    return volume


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
