"""Demands of cone programs: what is left out follows from what stays."""

from __future__ import annotations

import numpy as np
import pytest

from clench.mechanics.forces.actuation import HoldingProgram, least_effort
from clench.mechanics.forces.programs import ConeProgram, demand_limits, hardest_changes
from clench.mechanics.forces.squeeze import _may_be_held
from clench.mechanics.grasp.held import held_by_contacts
from clench.mechanics.grasp.loads import weight

from .held_cases import random_contacts, random_held


@pytest.mark.parametrize("model", ["point", "soft"])
def test_forces_that_survive_the_hardest_changes_survive_all(model: str) -> None:
    rng = np.random.default_rng(5)
    contacts = random_contacts(rng, 4, model)
    size = np.array([0.5, 0.5, 1.0, 0.1])[: contacts.width]  # about as far as cones reach
    changes = np.vstack(
        [np.zeros(4 * contacts.width), 0.3 * rng.normal(size=(12, 4 * contacts.width)) * np.tile(size, 4)]
    )
    needed = hardest_changes(contacts, changes)
    assert needed.any(axis=0).all()
    assert 0.2 < needed.mean() < 0.9  # some are left out
    survivors = 0
    pressing = np.eye(contacts.width)[2] * 2.5
    for forces in rng.normal(size=(4000, 4, contacts.width)) * size + pressing:
        slack = np.array([contacts.cone_slack(forces + c.reshape(4, -1)) for c in changes])
        for c in range(4):
            if slack[needed[:, c], c].min() >= 0.0:
                survivors += 1
                assert slack[:, c].min() >= -1e-9
    assert survivors > 500


def test_of_equal_changes_one_is_needed() -> None:
    contacts = random_contacts(np.random.default_rng(1), 2)
    needed = hardest_changes(contacts, np.tile(np.full(6, 0.1), (3, 1)))
    assert needed.sum(axis=0).tolist() == [1, 1]


def test_the_largest_torque_of_all_changes_is_limited() -> None:
    """The force stays below the limit under every change: in the rows, the change that adds most stands for all."""
    rng = np.random.default_rng(2)
    held = random_held(rng, 5, limit=0.3)
    changes, margin = 0.2 * rng.normal(size=(7, 15)), 0.6
    program = HoldingProgram(held, weight(0.1, [0.0, 0.0, -1.0])[0], 1.0, extra=1, tendons=False)
    spread = np.eye(program.cone.size)[15]
    program.cone.equal(spread[None], np.array([margin]))
    program.cone.cost[:15] = 1e-3 * rng.normal(size=15)
    program.demand_forces(np.zeros((1, 15)), changes, spread)
    x = program.cone.solve()
    assert x is not None
    torques = (x[:15] + margin * np.vstack([np.zeros(15), changes])) @ held.jacobian
    assert np.abs(torques).max() <= 0.3 * (1.0 + 1e-7)
    assert np.abs(torques).max() > np.abs(x[:15] @ held.jacobian).max()


def test_limits_are_demanded_in_every_case() -> None:
    program = ConeProgram(1, np.array([-1.0]))
    demand_limits(program, np.array([[2.0], [0.0]]), np.array([1.0, 1.0]), np.array([[0.0, 0.0], [0.4, 0.0]]))
    x = program.solve()
    assert x is not None
    assert x[0] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("model", ["point", "soft"])
def test_a_load_that_forces_hold_is_never_refused_and_most_others_are(model: str) -> None:
    rng, held_at_all, refused = np.random.default_rng(4), 0, 0
    for _ in range(60):
        held = random_held(rng, 3, model=model)
        load = rng.normal(size=6)
        plan = least_effort(held, load)
        if plan is not None:
            held_at_all += 1
            assert _may_be_held(held, load)
        refused += not _may_be_held(held, load)
    assert held_at_all >= 3
    assert refused > 0.6 * (60 - held_at_all)


def test_a_load_just_inside_the_cones_is_not_refused() -> None:
    """A force along the edge of a cone balances its opposite."""
    for model in ("point", "soft"):
        contacts = random_contacts(np.random.default_rng(8), 1, model)
        held = held_by_contacts(contacts, np.zeros(3), 1.0)
        for direction in np.random.default_rng(9).normal(size=(50, contacts.width - 1)):
            edge = direction / np.linalg.norm(direction) * contacts.reach[0]
            force = np.array([*edge[:2], 1.0, *edge[2:]])
            assert _may_be_held(held, -held.grasp_map @ force)
            beyond = np.array([*(2.2 * edge[:2]), 1.0, *(2.2 * edge[2:])])
            assert not _may_be_held(held, -held.grasp_map @ beyond)
        assert _may_be_held(held, np.zeros(6))
