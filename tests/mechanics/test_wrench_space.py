"""Epsilon and volume: closed forms, a second computation, invariance, degenerate sets."""

from __future__ import annotations

import itertools
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from clench.core.pose import FloatArray, rotation_about
from clench.mechanics.epsilon import wrench_space
from clench.mechanics.epsilon.wrench_space import epsilon_l1, epsilon_linf, volume_l1
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.grasp_map import edge_wrenches

from .held_cases import directions, random_contacts


def planar_wrenches(positions: FloatArray, normals: FloatArray, friction: float, length: float) -> FloatArray:
    """Both edges of planar friction cones as (fx, fy, torque / length), shape (C, 2, 3)."""
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    forces = np.stack([normals + friction * tangents, normals - friction * tangents], axis=1)
    torque = positions[:, None, 0] * forces[..., 1] - positions[:, None, 1] * forces[..., 0]
    return np.concatenate([forces, torque[..., None] / length], axis=2)


def epsilon_by_programs(wrenches: FloatArray, starts: FloatArray) -> float:
    """Shoot rays from 0: a linear program finds the facet they leave by. Go on along its normal until nothing changes.

    The nearest facet is one whose own normal leaves by it; starts must be many enough to find it.
    """
    points = wrenches.reshape(-1, wrenches.shape[-1])
    best = np.inf
    for start in starts:
        direction, last = start, np.inf
        while True:
            # The facet with normal y / |y| at distance 1 / |y| that the ray meets: y maximises y d under y w <= 1.
            answer = linprog(-direction, A_ub=points, b_ub=np.ones(len(points)), bounds=(None, None))
            if answer.status == 3:
                return 0.0  # 0 is not inside
            assert answer.status == 0
            distance = 1.0 / np.linalg.norm(answer.x)
            if distance >= last - 1e-12:
                break
            direction, last = answer.x * distance, distance
        best = min(best, last)
    return best


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5, 0.9])
def test_two_fingers_on_a_disk(friction: float) -> None:
    ends = np.array([[-1.0, 0.0], [1.0, 0.0]])
    wrenches = planar_wrenches(ends, -ends, friction, 1.0)
    # A tetrahedron with its corners on those of the box (1, mu, mu).
    assert epsilon_l1(wrenches).radius == pytest.approx(friction / np.sqrt(2.0 + friction**2), abs=1e-12)
    assert volume_l1(wrenches) == pytest.approx(8.0 / 3.0 * friction**2, abs=1e-12)


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5])
def test_three_fingers_on_a_disk(friction: float) -> None:
    angles = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    places = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    wrenches = planar_wrenches(places, -places, friction, 1.0)
    # An antiprism of two triangles at torque +mu and -mu, turned against each other by twice the friction angle.
    around, lean = np.sqrt(1.0 + friction**2), np.arctan(friction)
    side, corner = around / 2.0, around * np.cos(np.pi / 3.0 - 2.0 * lean)
    tilt = (corner - side) / (2.0 * friction)
    expected = min(friction, (side + corner) / 2.0 / np.sqrt(1.0 + tilt**2))
    assert epsilon_l1(wrenches).radius == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("width", "height"), [(0.02, 0.01), (0.02, 0.05)])
def test_two_fingers_on_a_planar_box(width: float, height: float) -> None:
    ends, mu = np.array([[-width, 0.0], [width, 0.0]]), 0.4
    length = float(np.hypot(width, height))
    wrenches = planar_wrenches(ends, -np.sign(ends), mu, length)
    expected = 1.0 / np.sqrt(1.0 + 1.0 / mu**2 + (length / (mu * width)) ** 2)
    assert epsilon_l1(wrenches).radius == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("half", "length"), [(0.03, 0.03), (0.03, 0.05)])
@pytest.mark.parametrize(("friction", "torsion"), [(0.5, 0.002), (0.5, 0.03), (0.2, 0.2)])
def test_two_soft_fingers_on_a_sphere_or_a_box(half: float, length: float, friction: float, torsion: float) -> None:
    ends = np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])
    contacts = make_contacts(ends, -ends, friction, model="soft", torsion=torsion)
    edges = 40
    found = epsilon_l1(edge_wrenches(contacts, np.zeros(3), length, edges)).radius
    # With round cones: the worst wrench turns the object about the line of the fingers, or pulls and turns one of them.
    arm, twist = half / length, torsion / length
    round_cones = max(1.0 / (friction * arm) ** 2 + 1.0 / twist**2, 1.0 + (1.0 + 1.0 / arm**2) / friction**2) ** -0.5
    assert np.cos(np.pi / edges) * round_cones - 1e-12 <= found <= round_cones + 1e-12


@pytest.mark.parametrize("friction", [1e-3, 1e-4])
@pytest.mark.parametrize("arm", [1.0, 0.7])
def test_three_fingers_around_a_sphere_with_little_friction(friction: float, arm: float) -> None:
    """For little friction epsilon is mu / sqrt(1 + 4 / arm^2), arm being the radius over the length scale.

    A finger at p with inward normal -p and tangents t, z exerts (-p + a t + b z, arm (a z - b t)), |(a, b)| <= mu. The
    farthest y with y w <= 1 for all of them: its part along the plane of the fingers shifts the load to one of them,
    s_i = 1 + y p_i, with sum 3; the others are of size 1 / mu and obey |(y_vz, y_z - arm y_v t_i)| <= s_i / mu. Being
    convex, its length is largest at a corner, s = (0, 0, 3): there y_z = 1 / mu and |y_v| = 2 / (arm mu).
    """
    angles = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    p = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    wrenches = edge_wrenches(make_contacts(p, -p, friction), np.zeros(3), 1.0 / arm, 8)
    expected = friction / np.sqrt(1.0 + 4.0 / arm**2)
    assert epsilon_l1(wrenches).radius == pytest.approx(expected, rel=1.2 * friction)


@pytest.mark.parametrize("friction", [1e-3, 1e-4])
@pytest.mark.parametrize(("half", "apart"), [(0.5, 0.4), (0.8, 0.3)])
def test_a_thumb_against_two_fingers_on_a_box_with_little_friction(friction: float, half: float, apart: float) -> None:
    """For little friction epsilon is mu / sqrt(1 + 1 / B^2 + 4 / C^2): thumb at -B x, fingers at B x ± C y.

    As on the sphere: loads s with s_0 / 2 + (s_1 + s_2) / 4 = 1, and y of size 1 / mu with |y_z + B y_vy| <= s_0 / mu,
    |y_z - B y_vy ± C y_vx| <= s_i / mu. The longest is at s = (0, 4, 0): (1, 1 / B, 2 / C) / mu.
    """
    p = np.array([[-half, 0.0, 0.0], [half, apart, 0.0], [half, -apart, 0.0]])
    inward = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    wrenches = edge_wrenches(make_contacts(p, inward, friction), np.zeros(3), 1.0, 8)
    expected = friction / np.sqrt(1.0 + 1.0 / half**2 + 4.0 / apart**2)
    assert epsilon_l1(wrenches).radius == pytest.approx(expected, rel=1.2 * friction)


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_three_fingers_agree_with_linear_programs(friction: float, shape: str) -> None:
    angles = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    p = np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    inward = -p
    if shape == "box":
        p = np.array([[-0.5, 0.0, 0.0], [0.5, 0.4, 0.0], [0.5, -0.4, 0.0]])
        inward = np.sign(-p) * [1.0, 0.0, 0.0]
    wrenches = edge_wrenches(make_contacts(p, inward, friction), np.zeros(3), 1.0, 6)
    starts = np.vstack([-wrenches.reshape(-1, 6), np.random.default_rng(1).normal(size=(40, 6))])
    found = epsilon_l1(wrenches).radius
    assert found > 0.03
    assert found == pytest.approx(epsilon_by_programs(wrenches, starts), abs=1e-6)


def test_linf_of_few_fingers_is_the_hull_of_all_sums() -> None:
    rng = np.random.default_rng(3)
    for count in (2, 3):
        wrenches = planar_wrenches(*(directions(rng, count)[:, :2] for _ in range(2)), 0.6, 1.0)
        ends = np.concatenate([wrenches, np.zeros((count, 1, 3))], axis=1)
        sums = np.array([sum(pick) for pick in itertools.product(*ends)])
        assert epsilon_linf(wrenches).radius == pytest.approx(epsilon_l1(sums).radius, abs=1e-10)
    contacts = random_contacts(rng, 3)
    wrenches = edge_wrenches(contacts, np.zeros(3), 1.0, 4)
    ends = np.concatenate([wrenches, np.zeros((3, 1, 6))], axis=1)
    sums = np.array([sum(pick) for pick in itertools.product(*ends)])
    assert epsilon_linf(wrenches).radius == pytest.approx(epsilon_l1(sums).radius, abs=1e-9)


def test_hull_and_linear_programs_agree() -> None:
    rng = np.random.default_rng(0)
    positive = 0
    for trial in range(8):
        contacts = random_contacts(rng, 3 + trial % 4, "soft" if trial % 3 == 0 else "point")
        wrenches = edge_wrenches(contacts, np.zeros(3), 1.0, 6)
        found = epsilon_l1(wrenches).radius
        points = wrenches.reshape(-1, 6)
        starts = np.vstack([-points, rng.normal(size=(30, 6))])
        assert found == pytest.approx(epsilon_by_programs(wrenches, starts), abs=1e-6)
        positive += found > 0.01
    assert positive >= 2


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    angle=st.floats(-3.0, 3.0),
    scale=st.floats(1e-3, 1e3),
    model=st.sampled_from(["point", "soft"]),
)
def test_frames_and_units_do_not_matter(seed: int, angle: float, scale: float, model: str) -> None:
    rng = np.random.default_rng(seed)
    contacts = random_contacts(rng, 5, model)
    center, edges = rng.normal(size=3) * 0.1, 24
    before = epsilon_l1(edge_wrenches(contacts, center, 1.2, edges)).radius
    R, shift = rotation_about(directions(rng, 1)[0], angle), rng.normal(size=3)
    moved = make_contacts(
        scale * (contacts.positions @ R.T + shift),
        contacts.normals @ R.T,
        contacts.friction,
        model=model,
        torsion=scale * 0.1,
    )
    after = epsilon_l1(edge_wrenches(moved, scale * (R @ center + shift), scale * 1.2, edges)).radius
    turned = edge_wrenches(contacts, center, 1.2, edges).reshape(-1, 2, 3) @ R.T
    assert epsilon_l1(turned.reshape(-1, 6)).radius == pytest.approx(before, abs=1e-9)
    # The edges of the cones turn with the tangents, which do not turn with the frame: only round cones are invariant.
    assert after == pytest.approx(before, rel=1.0 - np.cos(np.pi / edges), abs=2e-3)


def test_scale_alone_changes_nothing() -> None:
    contacts = random_contacts(np.random.default_rng(5), 6)
    small = make_contacts(contacts.positions * 1e-3, contacts.normals, 0.5)
    one = epsilon_l1(edge_wrenches(contacts, np.zeros(3), 1.2, 8)).radius
    assert epsilon_l1(edge_wrenches(small, np.zeros(3), 1.2e-3, 8)).radius == pytest.approx(one, abs=1e-12)


def test_more_friction_more_fingers_and_more_edges_never_hurt() -> None:
    rng = np.random.default_rng(8)
    n = directions(rng, 6)
    for count in (3, 4, 5):
        values = []
        for friction in (0.2, 0.4, 0.8):
            contacts = make_contacts(-n[:count], n[:count], friction)
            values.append(epsilon_l1(edge_wrenches(contacts, np.zeros(3), 1.0, 8)).radius)
            more = make_contacts(-n[: count + 1], n[: count + 1], friction)
            assert epsilon_l1(edge_wrenches(more, np.zeros(3), 1.0, 8)).radius >= values[-1] - 1e-9
            finer = epsilon_l1(edge_wrenches(contacts, np.zeros(3), 1.0, 16)).radius
            assert finer >= values[-1] - 1e-9
        assert values == sorted(values)


def test_flat_and_one_sided_sets_have_no_ball() -> None:
    ends = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    flat = edge_wrenches(make_contacts(ends, -ends, 0.5), np.zeros(3), 1.0, 8)
    assert epsilon_l1(flat).radius == epsilon_linf(flat).radius == volume_l1(flat) == 0.0
    n = directions(np.random.default_rng(2), 8)
    n[:, 2] = np.abs(n[:, 2]) + 1.0
    one_sided = edge_wrenches(make_contacts(-n, n, 0.3), np.zeros(3), 1.0, 8)
    assert epsilon_l1(one_sided).radius == 0.0
    assert volume_l1(one_sided) > 0.0


def test_the_weakest_direction_touches_the_ball() -> None:
    wrenches = edge_wrenches(random_contacts(np.random.default_rng(4), 8), np.zeros(3), 1.0, 8)
    ball = epsilon_l1(wrenches)
    assert ball.radius > 0.05
    assert ball.weakest is not None
    assert (wrenches.reshape(-1, 6) @ ball.weakest).max() == pytest.approx(ball.radius, abs=1e-9)


def test_volume_of_a_cross_polytope() -> None:
    for size in (3, 6):
        corners = np.vstack([np.eye(size), -np.eye(size)])
        assert volume_l1(corners) == pytest.approx(2.0**size / factorial(size), rel=1e-12)
        assert epsilon_l1(corners).radius == pytest.approx(size**-0.5, abs=1e-12)


def test_same_input_same_output() -> None:
    wrenches = edge_wrenches(random_contacts(np.random.default_rng(6), 12), np.zeros(3), 1.0, 8)
    assert epsilon_l1(wrenches).radius == epsilon_l1(wrenches.copy()).radius


@pytest.mark.parametrize("size", [3, 6])
def test_a_cube_of_any_dimension_reaches_1_to_all_sides(size: int) -> None:
    """Many corners lie in one facet, so rounding decides how Qhull parts it."""
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=size)))
    turned = np.linalg.qr(np.random.default_rng(3).normal(size=(size, size)))[0]
    for points in (corners, corners @ turned):
        normals, offsets = wrench_space._facets(points)
        assert offsets.min() == pytest.approx(1.0, abs=1e-9)
        assert (points @ normals.T).max(axis=0) == pytest.approx(offsets, abs=1e-9)
    assert volume_l1(corners) == pytest.approx(2.0**size, rel=1e-9)


def test_facets_that_leave_a_point_outside_are_not_taken(monkeypatch) -> None:
    """Qhull's fast way may miss points; then the careful one decides."""
    from scipy import spatial

    points, asked = np.random.default_rng(6).normal(size=(30, 4)), []
    whole = spatial.ConvexHull

    def missing(given: FloatArray, qhull_options: str):
        asked.append(qhull_options)
        return whole(given[:-5] if "Q0" in qhull_options else given, qhull_options=qhull_options)

    expected = wrench_space._hull(points).volume
    monkeypatch.setattr(spatial, "ConvexHull", missing)
    assert wrench_space._hull(points).volume == pytest.approx(expected, rel=1e-12)
    assert asked == ["Qt Q0", "Qt Qx"]
