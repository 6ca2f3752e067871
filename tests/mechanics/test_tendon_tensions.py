"""Tensions for torques: antagonistic and N + 1 layouts, limits, what cannot be given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chain_hands import HandBuilder, along_x, three_links
from clench.core.exceptions import CommandError
from clench.mechanics.grasp.jacobian import degrees_of_freedom
from clench.mechanics.grasp.tendon_tensions import TendonDrive, tendon_drive
from clench.models.hand.reading.tendons import TendonMap

R_ANTAGONISTIC = np.array([[0.01, -0.01, 0.0, 0.0], [0.0, 0.0, 0.008, -0.008]])
R_N_PLUS_1 = np.array([[0.01, 0.01, -0.01, -0.01], [0.01, -0.01, 0.006, -0.006], [0.008, 0.0, -0.008, 0.002]])


def drive(arms: np.ndarray, low: float = 1.0, high: float = 100.0) -> TendonDrive:
    names = tuple(f"joint_{k}" for k in range(len(arms)))
    count = arms.shape[1]
    return TendonDrive(names, tuple(range(len(arms))), arms, np.full(count, low), np.full(count, high))


def test_antagonists_share_a_torque_in_closed_form() -> None:
    answer = drive(R_ANTAGONISTIC).tensions([0.1, -0.04])
    assert answer.feasible
    assert np.allclose(answer.tensions, [11.0, 1.0, 1.0, 6.0], atol=1e-9)
    assert np.allclose(answer.given, [0.1, -0.04], atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 100_000))
def test_every_torque_within_reach_is_given(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for arms in (R_ANTAGONISTIC, R_N_PLUS_1):
        layout = drive(arms)
        some = rng.uniform(1.0, 100.0, arms.shape[1])
        answer = layout.tensions(arms @ some)
        assert answer.feasible
        assert np.abs(answer.given - arms @ some).max() <= 1e-9
        assert answer.tensions.min() >= 1.0 - 1e-9
        assert answer.tensions.max() <= some.max() + 1e-7  # no other tensions have a smaller largest one


def test_n_plus_1_gives_both_signs_of_every_joint() -> None:
    layout = drive(R_N_PLUS_1)
    null = np.linalg.svd(R_N_PLUS_1)[2][-1]
    assert (null * np.sign(null[0]) > 0.0).all()  # pulling all tendons harder changes no torque
    for torque in np.vstack([np.eye(3), -np.eye(3)]) * 0.05:
        assert layout.tensions(torque).feasible


def test_torques_out_of_reach_are_named() -> None:
    answer = drive(R_ANTAGONISTIC, high=20.0).tensions([0.5, 0.01])
    assert not answer.feasible
    assert answer.infeasible == ("joint_0",)
    assert np.allclose(answer.given, [0.19, 0.01], atol=1e-9)  # the nearest that can be given
    one_way = drive(np.array([[0.01, 0.02]]), low=0.0, high=np.inf).tensions([-0.1])
    assert one_way.infeasible == ("joint_0",)
    assert np.allclose(one_way.tensions, 0.0, atol=1e-12)


def test_followers_add_to_their_leader() -> None:
    builder = HandBuilder().finger("index", [along_x(0.007, 0.05)] * 2, [0.05, 0.05])
    hand = builder.couple("index_0", "index_1", 0.5).hand()
    tendons = TendonMap(("index_0", "index_1"), ((0.01, -0.01), (0.008, -0.006)), (0.0, 0.0), (50.0, 50.0))
    hand = replace(hand, tendons=tendons)
    q = hand.open_angles()
    found = tendon_drive(hand, degrees_of_freedom(hand, q))
    assert found is not None
    assert found.names == ("index_0",)
    assert np.allclose(found.arms, [[0.014, -0.013]], atol=1e-15)
    assert np.allclose(found.tensions([0.07]).tensions, [5.0, 0.0], atol=1e-9)


def test_joints_without_tendons_are_left_out() -> None:
    hand = three_links()
    assert tendon_drive(hand, degrees_of_freedom(hand, np.zeros(3))) is None
    hand = replace(hand, tendons=TendonMap(("index_1",), ((0.01, -0.01),), (0.0, 0.0), (9.0, 9.0)))
    found = tendon_drive(hand, degrees_of_freedom(hand, np.zeros(3)))
    assert found is not None
    assert (found.names, found.columns) == (("index_1",), (1,))


def test_malformed_torques_are_refused() -> None:
    for bad in ([0.1], [0.1, np.nan], [0.1, 0.2, 0.3]):
        with pytest.raises(CommandError, match=r"torques: expected 2 finite numbers"):
            drive(R_ANTAGONISTIC).tensions(bad)
