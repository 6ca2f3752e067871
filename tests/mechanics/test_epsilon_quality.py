"""Epsilon within torque limits, and the fast bound: never above what is exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.core.exceptions import CommandError
from clench.mechanics.epsilon.epsilon_quality import epsilon, epsilon_bound, epsilon_within_torques
from clench.mechanics.forces.actuation import least_effort
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.held import held_by_contacts

from .held_cases import around_the_equator, random_held


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(2, 9), model=st.sampled_from(["point", "soft"]))
def test_the_bound_is_one(seed: int, count: int, model: str) -> None:
    held = random_held(np.random.default_rng(seed), count, model=model)
    assert 0.0 <= epsilon_bound(held) <= epsilon(held).radius + 1e-9
    assert epsilon_bound(held, "Linf", 4) >= epsilon_bound(held, "L1", 4)


def test_the_bound_of_linf_is_one() -> None:
    for seed in range(4):
        held = random_held(np.random.default_rng(seed), 4)
        assert 0.0 <= epsilon_bound(held, "Linf", 4) <= epsilon(held, "Linf", 4).radius + 1e-9


def test_the_bound_finds_good_grasps_good() -> None:
    rng = np.random.default_rng(1)
    found = []
    for _ in range(30):
        held = random_held(rng, 10)
        exact = epsilon(held).radius
        if exact > 0.05:
            found.append(epsilon_bound(held) / exact)
    assert len(found) > 20
    assert np.median(found) > 0.3


def test_torque_limited_ball_scales_with_the_limits() -> None:
    held = around_the_equator(np.random.default_rng(0), joints=4)
    radii = []
    for limit in (0.5, 1.0):
        limited = replace(held, dofs=replace(held.dofs, limits=np.full(4, limit)))
        radii.append(epsilon_within_torques(limited).radius)
        assert 0.0 <= epsilon_bound(limited, None) <= radii[-1] + 1e-9
    assert radii[0] > 0.01
    assert radii[1] == pytest.approx(2.0 * radii[0], rel=1e-5)


def test_inside_the_torque_limited_ball_everything_is_held_and_beyond_it_something_is_not() -> None:
    rng = np.random.default_rng(3)
    held = around_the_equator(rng, joints=4)
    held = replace(held, dofs=replace(held.dofs, limits=np.full(4, 0.3)))
    ball = epsilon_within_torques(held)
    assert ball.radius > 0.01
    for d in rng.normal(size=(20, 6)):
        assert least_effort(held, 0.999 * ball.radius * d / np.linalg.norm(d)) is not None
    # Round cones hold a little more than the polyhedra, so this is not at once beyond the ball.
    assert ball.weakest is not None
    assert least_effort(held, -1.3 * ball.radius * ball.weakest) is None


def test_nothing_is_steady_without_contacts_or_with_flat_ones() -> None:
    empty = held_by_contacts(make_contacts(np.empty((0, 3)), np.empty((0, 3))), np.zeros(3), 1.0)
    ends = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    pinch = held_by_contacts(make_contacts(ends, -ends, 0.5), np.zeros(3), 1.0)
    for held in (empty, pinch):
        assert epsilon(held).radius == epsilon_bound(held) == epsilon_within_torques(held).radius == 0.0


def test_an_unknown_norm_is_refused() -> None:
    with pytest.raises(CommandError, match=r"norm: expected one of L1, Linf, got 'L2'"):
        epsilon(around_the_equator(np.random.default_rng(0)), "L2")
