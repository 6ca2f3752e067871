"""Whether boxes that share faces, edges and corners cut into each other: their volumes in common tell."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clench.kernels.geometry.core_distance as closest
from clench.core.pose import Pose
from clench.kernels.geometry import crossing
from clench.kernels.geometry.crossing import DEEP
from clench.models.shapes import Shape, ShapeKind
from kernels.kernel_entries import entry

CELL = 0.01
cross, touch = entry(closest.crosses), entry(crossing.only_touch)


def box(low, high, turn, away):
    """Return the triangles of a box between two corners, turned and moved, (12, 3, 3)."""
    low, high = CELL * np.asarray(low, dtype=float), CELL * np.asarray(high, dtype=float)
    mesh = Shape(ShapeKind.BOX, tuple(0.5 * (high - low)), Pose(0.5 * (low + high))).to_mesh()
    return np.ascontiguousarray((mesh.vertices @ turn.T + away)[mesh.triangles])


def cut(one, other):
    """Say whether any two triangles cross by more than a touch, as `bodies_overlap` does."""
    return any(cross(a, 3, b, 3) and not touch(a, 3, b, 3) for a in one for b in other)


@pytest.mark.parametrize("seed", range(8))
def test_boxes_on_a_lattice_cut_into_each_other_where_they_have_volume_in_common(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix() if seed else np.eye(3)
    away = rng.normal(size=3) * 0.1 if seed else np.zeros(3)
    one = box((0, 0, 0), (2, 2, 2), turn, away)
    seen = {True: 0, False: 0}
    for _ in range(60):
        low = rng.integers(-2, 3, size=3)
        high = low + rng.integers(1, 4, size=3)
        within = (low >= 0).all() and (high <= 2).all()
        around = (low <= 0).all() and (high >= 2).all()
        if within or around:
            continue  # what lies inside another is told by where one of its points is
        common = bool((np.minimum(high, 2) > np.maximum(low, 0)).all())
        assert cut(one, box(low, high, turn, away)) == common, (low, high)
        seen[common] += 1
    assert min(seen.values()) >= 8


@pytest.mark.parametrize("deep", [1e-12, 1e-10, 0.5 * DEEP, 2.0 * DEEP, 1e-7, 1e-4])
def test_a_box_that_sinks_into_another_cuts_it_from_the_touch_on(deep):
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    sunk = deep / CELL
    one, other = box((0, 0, 0), (2, 2, 2), turn, 0.0), box((0.5, 0.5, 2 - sunk), (1.5, 1.5, 4), turn, 0.0)
    assert cut(one, other) == (deep > DEEP)
