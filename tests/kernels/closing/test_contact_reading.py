"""Normals of round shapes at points of their surface: how their distance functions grow."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clench.kernels.closing import contact_reading
from clench.kernels.closing.layout import RoundArrays
from kernels.kernel_entries import entry

put_round_normal = entry(contact_reading.put_round_normal)
SIZE = np.array([0.02, 0.03, 0.05])


def outside(kind, p):
    """Return a function of points (N, 3) that is 0 on the surface and grows along its normal."""
    around = np.hypot(p[:, 0], p[:, 1])
    if kind == "sphere":
        return np.linalg.norm(p, axis=1) - SIZE[0]
    if kind == "capsule":
        return np.hypot(around, np.maximum(np.abs(p[:, 2]) - SIZE[1], 0.0)) - SIZE[0]
    if kind == "cylinder":
        return np.maximum(around - SIZE[0], np.abs(p[:, 2]) - SIZE[1])
    return np.linalg.norm(p / SIZE, axis=1) - 1.0


def on_surface(kind, rng):
    """Return a point of the surface, by bisection along a ray from the middle."""
    ray = rng.normal(size=3)
    low, high = 0.0, 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if outside(kind, (middle * ray)[None])[0] > 0.0:
            high = middle
        else:
            low = middle
    return low * ray


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder", "ellipsoid"])
def test_a_normal_is_the_direction_of_growth(kind):
    rng = np.random.default_rng(0)
    number = np.array([["sphere", "capsule", "cylinder", "ellipsoid"].index(kind)])
    for seed in range(60):
        own, place = (Rotation.random(random_state=2 * seed + k).as_matrix() for k in range(2))
        pose = np.column_stack([own, rng.normal(size=3)])
        T = np.column_stack([place, rng.normal(size=3)])
        p = on_surface(kind, rng)
        h = 1e-7
        steps = np.vstack([p + h * np.eye(3), p - h * np.eye(3)])
        values = outside(kind, steps)
        growth = values[:3] - values[3:]
        position = place @ (own @ p + pose[:, 3]) + T[:, 3]
        found = np.zeros(3)
        put_round_normal(RoundArrays(number, SIZE[None], np.ascontiguousarray(pose)[None]), 0, T, position, found)
        np.testing.assert_allclose(found, place @ own @ growth / np.linalg.norm(growth), atol=1e-5)
