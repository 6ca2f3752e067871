"""The smallest gap between bodies against the other engine, and against closed forms for round ones."""

from __future__ import annotations

import fcl
import numpy as np
import pytest

from clench.base.pose import rotation_about
from clench.kernels.bodies import Elements, pack_bodies
from clench.kernels.nearness import smallest_gap


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
