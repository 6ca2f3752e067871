"""Whether solids come nearer than a bound, against the smallest gap that another kernel finds and against crossing."""

import fcl
import numpy as np
import pytest

from benchmarks.peers.kernels import box_query
from benchmarks.peers.kernels.box_query import Query, box_trees
from clench.core.pose import rotation_about
from clench.kernels.geometry.bodies import Elements
from kernels.kernel_entries import entry

within = entry(box_query.within)


def soup(rng, count):
    """Return points, segments and triangles, some of them round."""
    points = 0.02 * rng.normal(size=(3 * count, 3))
    rows = rng.permutation(3 * count).reshape(count, 3).astype(np.int32)
    kinds = rng.integers(1, 4, count)
    rows[kinds < 3, 2] = rows[kinds < 3, 1]
    rows[kinds < 2] = rows[kinds < 2, :1]
    return Elements(points, rows, np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.004, count)))


def engine_gap(a, b, T):
    """Return the least distance of elements less their radii, by the other engine, which tells no depth."""
    objects = []
    for solid in (a, b):
        models = []
        for row in solid.elements:
            model = fcl.BVHModel()
            model.beginModel(1, 3)
            model.addSubModel(solid.vertices, row[None])
            model.endModel()
            models.append(model)
        objects.append(models)
    least = np.inf
    for i, one in enumerate(objects[0]):
        for k, other in enumerate(objects[1]):
            placed = fcl.CollisionObject(one, fcl.Transform(T[:, :3], T[:, 3])), fcl.CollisionObject(other)
            apart = fcl.distance(*placed, fcl.DistanceRequest(), fcl.DistanceResult())
            least = min(least, apart - a.radius[i] - b.radius[k])
    return least


def asked(trees, m, r, T, bound):
    query = Query(np.ascontiguousarray(T), np.empty((3, 3)), np.empty((3, 3)), np.empty((512, 2), dtype=np.int64))
    return within(trees, m, trees, r, bound, query)


@pytest.mark.parametrize("seed", range(12))
def test_solids_are_within_what_the_other_engine_measures(seed):
    rng = np.random.default_rng(seed)
    solids = [soup(rng, int(rng.integers(1, 25))) for _ in range(2)]
    trees = box_trees(solids)
    axis = rng.normal(size=3)
    turn = rotation_about(axis / np.linalg.norm(axis), rng.uniform(0, 6))
    for away in (0.03, 0.08, 0.15, 0.4):
        direction = rng.normal(size=3)
        T = np.column_stack([turn, away * direction / np.linalg.norm(direction)])
        gap = engine_gap(*solids, T)
        back = np.column_stack([turn.T, -turn.T @ T[:, 3]])
        for bound in (0.0, 0.001, 0.02, 0.2):
            if abs(gap - bound) > 1e-9:
                assert asked(trees, 0, 1, T, bound) == (gap < bound)
                assert asked(trees, 1, 0, back, bound) == (gap < bound)


def test_a_solid_without_elements_meets_nothing():
    nothing = Elements(np.empty((0, 3)), np.empty((0, 3), np.int32), np.empty(0))
    trees = box_trees([nothing, soup(np.random.default_rng(1), 5)])
    assert not asked(trees, 0, 1, np.eye(4)[:3], 1.0)
    assert not asked(trees, 1, 0, np.eye(4)[:3], 1.0)
    assert asked(trees, 1, 1, np.eye(4)[:3], 0.0)
    assert len(box_trees([]).root) == 0
