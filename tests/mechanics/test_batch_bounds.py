"""Bounds of epsilon for many grasps at once: those of each grasp by itself, and never above what is exact.

`epsilon_bounds(first, position, normal, friction, center, length)` takes the columns of `clench.BatchContacts`: the
contacts of grasp i are the rows from `first[i]` up to `first[i + 1]`, normals point out of the object. Friction is one
number, or one for each contact; the centre of mass has shape (3,), or (N, 3) where objects differ.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.mechanics.epsilon import batch_bounds
from clench.mechanics.epsilon.epsilon_quality import epsilon, epsilon_bound
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.held import HeldObject, held_by_contacts

#: Positions [m], outward normals, and friction of the contacts of one grasp.
Contacts = tuple[np.ndarray, np.ndarray, np.ndarray]
#: Length scale of the grasps [m].
LENGTH = 0.08


def random_contacts(rng: np.random.Generator, count: int) -> Contacts:
    """Return contacts on a bent ellipsoid, some of them pushed from nearly opposite sides."""
    out = rng.normal(size=(count, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    normals = out + 0.2 * rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return out * rng.uniform(0.02, LENGTH, size=3), normals, rng.uniform(0.2, 1.2, size=count)


def on_a_ring(count: int, friction: float = 0.6) -> Contacts:
    """Return contacts around a cylinder: their normals lie in one plane."""
    angles = 2.0 * np.pi * np.arange(count) / max(count, 1)
    out = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
    return 0.03 * out, out, np.full(count, friction)


def at_one_point(rng: np.random.Generator, count: int) -> Contacts:
    _, normals, friction = random_contacts(rng, count)
    return np.tile(rng.normal(size=3) * 0.03, (count, 1)), normals, friction


def repeated(rng: np.random.Generator, count: int) -> Contacts:
    """Return one contact several times."""
    one = random_contacts(rng, 1)
    return tuple(np.repeat(part, count, axis=0) for part in one)  # type: ignore[return-value]


def one_way(rng: np.random.Generator, count: int) -> Contacts:
    """Return contacts on one side of a plate: they only push."""
    normals = np.tile([0.0, 0.0, 1.0], (count, 1))
    return rng.uniform(-0.05, 0.05, size=(count, 3)), normals, np.full(count, 0.6)


def collinear(count: int) -> Contacts:
    """Return contacts on a line, pushed along it from either end: nothing resists a turn about it."""
    x = np.linspace(-0.05, 0.05, count)
    normals = np.where(x[:, None] < 0.0, [[-1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]])
    return np.column_stack([x, np.zeros(count), np.zeros(count)]), normals, np.full(count, 0.8)


def opposing_corners(count: int, friction: float) -> Contacts:
    """Return contacts at corners of a box, along one axis from both sides: a good grasp with two parallel normals."""
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])[:count]
    return signs * [0.02, 0.03, 0.05], signs * [1.0, 0.0, 0.0], np.full(len(signs), friction)


def held(contacts: Contacts, center: np.ndarray) -> HeldObject:
    position, outward, friction = contacts
    return held_by_contacts(make_contacts(position, -outward, friction), center, LENGTH)


def bounds(grasps: Sequence[Contacts], center: np.ndarray) -> np.ndarray:
    """Return the bounds of all grasps by one call."""
    first = np.concatenate([[0], np.cumsum([len(position) for position, _, _ in grasps])])
    position, normal, friction = (np.concatenate([g[k] for g in grasps]) for k in range(3))
    found = batch_bounds.epsilon_bounds(first, position, normal, friction, center, LENGTH)
    assert found.shape == (len(grasps),)
    assert found.dtype == np.float64
    return np.asarray(found)


def degenerate(rng: np.random.Generator) -> list[Contacts]:
    return [
        *(random_contacts(rng, count) for count in (0, 1, 2)),
        *(make(rng, count) for make in (at_one_point, repeated, one_way) for count in (2, 3, 5)),
        *(on_a_ring(count) for count in (2, 3, 4, 8)),
        *(collinear(count) for count in (2, 3, 6)),
        *(opposing_corners(8, friction) for friction in (1e-3, 0.1, 0.6, 3.0)),
        opposing_corners(4, 0.6),
        random_contacts(rng, 0),
    ]


def check_against_single(grasps: Sequence[Contacts], center: np.ndarray) -> None:
    centers = np.broadcast_to(center, (len(grasps), 3))
    singles = [epsilon_bound(held(g, c)) for g, c in zip(grasps, centers, strict=True)]
    np.testing.assert_allclose(bounds(grasps, center), singles, rtol=1e-6, atol=1e-12)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_each_is_that_of_its_grasp_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grasps = [random_contacts(rng, int(count)) for count in rng.integers(0, 16, size=20)]
    check_against_single(grasps, rng.normal(size=3) * 0.02)
    check_against_single(grasps, rng.normal(size=(20, 3)) * 0.02)


def test_degenerate_grasps_have_the_bounds_of_each_alone() -> None:
    rng = np.random.default_rng(0)
    grasps = degenerate(rng)
    check_against_single(grasps, np.zeros(3))
    order = rng.permutation(len(grasps))
    check_against_single([grasps[i] for i in order], np.zeros(3))


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_no_bound_is_above_what_is_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grasps = [random_contacts(rng, int(count)) for count in rng.integers(0, 12, size=10)]
    center = rng.normal(size=3) * 0.01
    exact = np.array([epsilon(held(g, center)).radius for g in grasps])
    found = bounds(grasps, center)
    assert np.all(found >= 0.0)
    assert np.all(found <= exact + 1e-9)


def test_no_bound_of_a_degenerate_grasp_is_above_what_is_exact() -> None:
    grasps = degenerate(np.random.default_rng(1))
    exact = np.array([epsilon(held(g, np.zeros(3))).radius for g in grasps])
    found = bounds(grasps, np.zeros(3))
    assert np.all(found >= 0.0)
    assert np.all(found <= exact + 1e-9)


def test_what_holds_nothing_is_zero_and_what_holds_well_is_not() -> None:
    rng = np.random.default_rng(2)
    nothing = [
        *(random_contacts(rng, count) for count in (0, 1, 2)),
        *(make(rng, 4) for make in (at_one_point, repeated, one_way)),
        collinear(4),
    ]
    assert bounds(nothing, np.zeros(3)).tolist() == [0.0] * len(nothing)
    good = [opposing_corners(8, 0.6), on_a_ring(8)]
    exact = np.array([epsilon(held(g, np.zeros(3))).radius for g in good])
    assert np.all(exact > 0.01)
    assert np.all(bounds(good, np.zeros(3)) > 0.2 * exact)


def test_one_friction_stands_for_all_contacts() -> None:
    grasps = [on_a_ring(5, 0.7), opposing_corners(8, 0.7)]
    position, normal = (np.concatenate([g[k] for g in grasps]) for k in range(2))
    found = batch_bounds.epsilon_bounds(np.array([0, 5, 13]), position, normal, 0.7, np.zeros(3), LENGTH)
    np.testing.assert_array_equal(found, bounds(grasps, np.zeros(3)))


def test_a_grasp_has_the_same_bits_whatever_stands_beside_it() -> None:
    rng = np.random.default_rng(3)
    grasps = [random_contacts(rng, int(count)) for count in rng.integers(0, 12, size=30)]
    together = bounds(grasps, np.zeros(3))
    assert together[7:8].tobytes() == bounds(grasps[7:8], np.zeros(3)).tobytes()
    assert together[::-1].tobytes() == bounds(grasps[::-1], np.zeros(3)).tobytes()


def test_no_grasps_have_no_bounds() -> None:
    empty = np.empty((0, 3))
    found = batch_bounds.epsilon_bounds(np.zeros(1, dtype=np.int64), empty, empty, np.empty(0), np.zeros(3), LENGTH)
    assert found.shape == (0,)
