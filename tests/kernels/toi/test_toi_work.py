"""The smallest gap between bodies against the other engine, and against closed forms for round ones."""

from __future__ import annotations

import fcl
import numpy as np
import pytest

from clench.core.pose import rotation_about
from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.geometry.core_distance import separation
from clench.kernels.geometry.smallest_gap import link_gap, smallest_gap
from clench.kernels.toi import toi_work as sweeping
from kernels.kernel_entries import entry

make_sweep_work, bodies_overlap = entry(sweeping.make_sweep_work), entry(sweeping.bodies_overlap)


def blob(rng: np.random.Generator, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a soup of triangles: the gap knows no inside."""
    points = size * rng.normal(size=(60, 3))
    return points, rng.permutation(60).reshape(20, 3).astype(np.int32)


def pose(rng: np.random.Generator, at: np.ndarray) -> np.ndarray:
    axis = rng.normal(size=3)
    return np.column_stack([rotation_about(axis / np.linalg.norm(axis), rng.uniform(0, 6)), at])


def engine(points, faces, T) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(faces), len(points))
    model.addSubModel(points, faces)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(T[:, :3], T[:, 3]))


@pytest.mark.parametrize("seed", range(20))
def test_meshes_against_the_other_engine(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = [blob(rng, 0.02) for _ in range(4)]
    packed = [Elements(points, faces, np.zeros(len(faces))) for points, faces in shapes]
    poses = np.stack([pose(rng, 0.3 * rng.normal(size=3) + [0.4, 0, 0]) for _ in range(3)] + [pose(rng, np.zeros(3))])
    links = pack_bodies(packed[:3])
    gap, nearest = smallest_gap(links, np.array([0, 2]), poses[:3], pack_bodies(packed[3:]), poses[3])
    distances = [
        fcl.distance(
            engine(*shapes[k], poses[k]), engine(*shapes[3], poses[3]), fcl.DistanceRequest(), fcl.DistanceResult()
        )
        for k in (0, 2)
    ]
    assert min(distances) > 0.0
    assert gap == pytest.approx(min(distances), abs=1e-9)
    assert nearest == (0, 2)[int(np.argmin(distances))]


def test_a_capsule_and_a_ball() -> None:
    capsule = Elements(np.array([[0.0, 0, 0], [0.1, 0, 0]]), np.array([[0, 1, 1]], np.int32), np.array([0.01]))
    ball = Elements(np.array([[0.0, 0, 0]]), np.zeros((1, 3), np.int32), np.array([0.02]))
    still = np.ascontiguousarray(np.eye(4)[:3])
    away = still.copy()
    away[:, 3] = [0.05, 0.03, 0.04]
    gap, nearest = smallest_gap(pack_bodies([capsule]), np.array([0]), still[None], pack_bodies([ball]), away)
    assert gap == pytest.approx(0.05 - 0.03, abs=1e-15)
    assert nearest == 0


def test_nothing_to_measure() -> None:
    empty = pack_bodies([Elements(np.empty((0, 3)), np.empty((0, 3), np.int32), np.empty(0))])
    still = np.ascontiguousarray(np.eye(4)[:3])
    assert smallest_gap(empty, np.array([0]), still[None], empty, still) == (np.inf, -1)


def to_mesh(point, points, faces, T) -> float:
    """Return how far a point is from the triangles of a placed mesh."""
    at = np.tile(point, (3, 1))
    return min(separation(at, 1, points[f] @ T[:, :3].T + T[:, 3], 3)[0] for f in faces)


@pytest.mark.parametrize("seed", range(5))
def test_where_two_meshes_are_nearest(seed: int) -> None:
    """The point lies on the second one, and across the gap from it there is the first one."""
    rng = np.random.default_rng(seed)
    shapes = [blob(rng, 0.02) for _ in range(2)]
    poses = np.stack([pose(rng, np.array([0.3, 0.1, 0.0])), pose(rng, np.zeros(3))])
    links = pack_bodies([Elements(points, faces, np.zeros(len(faces))) for points, faces in shapes])
    out = np.empty(6)
    gap = link_gap(links, 0, 1, poses, 1e9, 1.0, out)
    assert gap > 0.0
    assert to_mesh(out[:3], *shapes[1], poses[1]) == pytest.approx(0.0, abs=1e-12)
    assert to_mesh(out[:3] + gap * out[3:], *shapes[0], poses[0]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("triangles", [1, 20])
def test_meshes_that_cross_against_the_other_engine(triangles: int) -> None:
    """One large triangle is an element before the other mesh is down to its own."""
    said = {True: 0, False: 0}
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points, faces = blob(rng, 0.02)
        shapes = [(points * (1.0 if triangles > 1 else 5.0), faces[:triangles]), blob(rng, 0.02)]
        poses = np.stack([pose(rng, 0.06 * rng.normal(size=3)), pose(rng, np.zeros(3))])
        links = pack_bodies([Elements(p, f, np.zeros(len(f))) for p, f in shapes])
        work = make_sweep_work(0, 0)
        work.moving[:], work.resting[:] = poses
        engines = [engine(*shapes[k], poses[k]) for k in (0, 1)]
        crossing = fcl.collide(*engines, fcl.CollisionRequest(), fcl.CollisionResult()) > 0
        for flush in (False, True):
            assert bodies_overlap(links, 0, links, 1, 0.0, flush, -1, work) == crossing
        said[crossing] += 1
    assert min(said.values()) > 5
