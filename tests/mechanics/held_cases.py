"""Grasps for tests of mechanics: random ones around a sphere, and a small hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clench.core.pose import FloatArray
from clench.mechanics.grasp.contacts import ContactSet, make_contacts
from clench.mechanics.grasp.held import HeldObject, held_by_contacts


def directions(rng: np.random.Generator, count: int) -> FloatArray:
    d = rng.normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def random_contacts(rng: np.random.Generator, count: int, model: str = "point") -> ContactSet:
    """Contacts near a unit sphere, that push inwards, a little askew."""
    n = directions(rng, count)
    askew = n + 0.1 * rng.normal(size=(count, 3))
    return make_contacts(-n + 0.1 * rng.normal(size=(count, 3)), askew, 0.5, model=model, torsion=0.1)


def random_held(rng: np.random.Generator, count: int, joints: int = 4, limit: float = np.inf, model: str = "point"):
    """Contacts moved by imagined joints of arms of a few centimetres."""
    held = held_by_contacts(random_contacts(rng, count, model), np.zeros(3), 1.0)
    return with_joints(held, rng.normal(size=(count * held.contacts.width, joints)) * 0.05, limit)


def with_joints(held: HeldObject, jacobian: FloatArray, limit: float) -> HeldObject:
    count = jacobian.shape[1]
    names = tuple(f"joint_{k}" for k in range(count))
    dofs = replace(held.dofs, names=names, joints=tuple(range(count)), limits=np.full(count, limit))
    return replace(held, jacobian=jacobian, dofs=dofs)


def around_the_equator(rng: np.random.Generator, joints: int = 3) -> HeldObject:
    """Three fingers around a unit sphere that grip well, moved by imagined joints."""
    angles = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0 + 0.2 * rng.normal(size=3)
    n = -np.stack([np.cos(angles), np.sin(angles), 0.1 * rng.normal(size=3)], axis=1)
    held = held_by_contacts(make_contacts(-n, n, 0.8), np.zeros(3), 1.0)
    return with_joints(held, rng.normal(size=(9, joints)) * 0.05, np.inf)
