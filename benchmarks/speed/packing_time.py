"""The benchmark of packing: a fine sphere and a scan load and are packed; times, memory, and checks of the answers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import clench
from clench.closing.collision.packed_object import (
    OBJECT_CACHE,
    PackedObject,
    pack_object,
    packed_size,
    set_object_cache,
)
from clench.core.pose import FloatArray
from clench.models.mesh import TriangleMesh
from clench.models.objects.mesh_file import merged
from clench.models.objects.topology import winding_number

from ..bench_report import BenchReport, describe_place
from .answer_checks import triangle_distances

#: Radius of the sphere, and about that of the scan [m].
RADIUS: Final = 0.035
#: Standard deviation of the noise of the scan [m].
NOISE: Final = 1e-5
#: Largest difference of two right answers [m].
AGREEMENT: Final = 1e-12
#: Triangles of a mesh that is packed first, so that nothing is compiled or loaded in the timed calls.
_FIRST: Final = 20_000


@dataclass(frozen=True)
class PackingBench:
    """What is packed: meshes of so many triangles, how often, and how many points are checked."""

    triangles: int
    passes: int
    points: int
    seed: int


def bench_packing(asked: PackingBench, files: tuple[Path, ...]) -> BenchReport:
    """Time loading and packing of a sphere, of a scan, and of files; check distances against all triangles.

    Args:
        asked: what is packed. files: meshes besides.
    """
    report = BenchReport(values={"benchmark": "packing", **describe_place()})
    report.values |= {"passes": asked.passes, "checked_points": asked.points, "seed": asked.seed}
    # No object stays packed but the last one, so that the meshes do not pile up.
    set_object_cache(0)
    try:
        _measure_all(report, asked, files)
    finally:
        set_object_cache(OBJECT_CACHE)
    report.values["answers_right"] = not report.errors
    return report


def _measure_all(report: BenchReport, asked: PackingBench, files: tuple[Path, ...]) -> None:
    for mesh in (sphere_mesh(_FIRST), scan_mesh(_FIRST, asked.seed)):
        pack_object(_load(mesh))
    for name, mesh in (("sphere", sphere_mesh(asked.triangles)), ("scan", scan_mesh(asked.triangles, asked.seed))):
        _measure(report, name, partial(_load, mesh), asked)
    for number, path in enumerate(files):
        _measure(report, f"file_{number}_{path.stem}", partial(clench.GraspObject.load, path), asked)


def _load(mesh: TriangleMesh) -> clench.GraspObject:
    return clench.GraspObject.from_meshes([(mesh.vertices, mesh.triangles)])


def _measure(report: BenchReport, key: str, load: Callable[[], clench.GraspObject], asked: PackingBench) -> None:
    """Add the quickest times of a mesh, its memory, and what is wrong with its answers."""
    loads, packs = list[tuple[float, float]](), list[tuple[float, float]]()
    for _ in range(asked.passes):
        obj, times = _timed(load)
        loads.append(times)
        packed, times = _timed(partial(pack_object, obj))
        packs.append(times)
    for stage, times_of in (("load", loads), ("pack", packs)):
        report.values[f"{key}_{stage}_s"] = min(wall for wall, _ in times_of)
        report.values[f"{key}_{stage}_processor_s"] = min(processor for _, processor in times_of)
    count_of, size = len(packed.tree.triangles), packed_size(packed)
    report.values |= {f"{key}_triangles": count_of, f"{key}_packed_mb": size / 1e6}
    report.values[f"{key}_bytes_per_triangle"] = size / max(count_of, 1)
    report.errors.extend(f"{key}: {wrong}" for wrong in _wrong_answers(packed, asked))


def _wrong_answers(packed: PackedObject, asked: PackingBench) -> list[str]:
    """Compare the distances of points near the surface with those from all triangles."""
    from clench.kernels.geometry.mesh_distance import signed_distance

    tree, rng, wrong = packed.tree, np.random.default_rng(asked.seed), []
    corners = tree.vertices[tree.triangles]
    near = corners[rng.integers(0, len(corners), asked.points), 0]
    for point in near + rng.normal(scale=0.1 * packed.size, size=near.shape):
        expected = float(triangle_distances(corners, point).min())
        if packed.closed and winding_number(point, tree.vertices, tree.triangles.astype(np.int64)) > 0.5:
            expected = -expected
        found = float(signed_distance(tree, tuple(point.tolist()), packed.closed))
        if abs(found - expected) > AGREEMENT:
            wrong.append(f"a point is {found:.9g} m from the surface, by all triangles {expected:.9g} m.")
    return wrong


def sphere_mesh(triangles: int) -> TriangleMesh:
    """Return a sphere with about so many triangles of about the same size: a cube's grids, blown up."""
    side = max(1, round((triangles / 12) ** 0.5))
    t = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))
    a, b = np.meshgrid(t, t, indexing="ij")
    number = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    halves = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points, faces = list[FloatArray](), list[NDArray[np.int64]]()
    for axis in range(3):
        for sign in (1.0, -1.0):
            grid = np.empty((*a.shape, 3))
            grid[..., axis], grid[..., (axis + 1) % 3], grid[..., (axis + 2) % 3] = sign, a * sign, b
            faces.append(halves + len(points) * number.size)
            points.append(grid.reshape(-1, 3))
    vertices, joined = merged(np.concatenate(points), np.concatenate(faces))
    return TriangleMesh(RADIUS * vertices / np.linalg.norm(vertices, axis=1, keepdims=True), joined)


def scan_mesh(triangles: int, seed: int) -> TriangleMesh:
    """Return a bumpy closed surface with noise, whose vertices and triangles are in random order."""
    ball, rng = sphere_mesh(triangles), np.random.default_rng(seed)
    x, y, z = ball.vertices.T / RADIUS
    bumps = 1.0 + 0.15 * np.sin(5.0 * x) * np.cos(4.0 * y) + 0.05 * np.sin(20.0 * z)
    vertices = ball.vertices * bumps[:, None] + rng.normal(scale=NOISE, size=ball.vertices.shape)
    order = rng.permutation(len(vertices))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return TriangleMesh(vertices[order], rng.permutation(place[ball.triangles]))


def _timed(call: Callable[[], Any]) -> tuple[Any, tuple[float, float]]:
    """Return what a call returns, and how long it took: wall time and processor time [s]."""
    wall, processor = time.perf_counter(), time.process_time()
    result = call()
    return result, (time.perf_counter() - wall, time.process_time() - processor)
