"""Hand Jacobians against finite differences and virtual work, through coupling."""

from __future__ import annotations

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, three_links
from clench.core.pose import invert
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.jacobian import degrees_of_freedom, hand_jacobian

from .held_cases import directions


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
@pytest.mark.parametrize("model", ["point", "soft"])
def test_jacobian_is_the_derivative_of_the_contact_points(name: str, model: str) -> None:
    hand = clench.Hand.load(name)
    rng = np.random.default_rng(0)
    inside = np.array([0.4 * j.lower + 0.6 * j.upper for j in hand.joints])
    q = hand.coupled(inside)
    dofs = degrees_of_freedom(hand, q)
    links = [f.links[k] for f in hand.fingers for k in range(len(f.links))] + [hand.palm]
    contacts = make_contacts(
        rng.normal(size=(len(links), 3)) * 0.1, directions(rng, len(links)), model=model, links=links
    )
    J = hand_jacobian(hand, q, contacts, dofs).reshape(len(links), contacts.width, -1)
    step, before = 1e-6, hand.link_poses(q)
    for d, joint in enumerate(dofs.joints):
        moved = q.copy()
        moved[joint] += step
        after = hand.link_poses(hand.coupled(moved))
        for c, link in enumerate(links):
            T = after[link] @ invert(before[link])
            change = T[:3, :3] @ contacts.positions[c] + T[:3, 3] - contacts.positions[c]
            assert np.allclose(J[c, :3, d], contacts.frames[c].T @ change / step, atol=1e-6)
            if model == "soft":
                turn = np.array([T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]]) / 2.0 / step
                assert J[c, 3, d] == pytest.approx(contacts.normals[c] @ turn, abs=1e-6)
    assert not J[-1].any()  # the palm does not move


def test_robonaut_has_twelve_degrees_of_freedom_with_the_limits_of_their_leaders() -> None:
    hand = clench.Hand.load("robonaut2")
    dofs = degrees_of_freedom(hand, hand.open_angles())
    assert len(dofs.names) == 12
    assert np.isfinite(dofs.limits).all()
    leader = dofs.names.index("ring_proximal")
    moved = {hand.joints[j].name: r for j, r in enumerate(dofs.motion[:, leader]) if r}
    assert moved == {"ring_proximal": 1.0, "ring_medial": 1.0, "ring_distal": pytest.approx(0.9)}


def test_a_pushing_finger_needs_force_times_arm() -> None:
    hand = three_links()
    q = np.zeros(3)
    contacts = make_contacts([[0.08, 0.0, 0.0]], [[0.0, 0.0, 1.0]], links=[2])
    J = hand_jacobian(hand, q, contacts, degrees_of_freedom(hand, q))
    torques = J.T @ np.array([0.0, 0.0, 10.0])
    assert np.allclose(torques, [0.8, 0.3, 0.0], atol=1e-12)


def test_a_follower_at_its_limit_stands_still() -> None:
    builder = HandBuilder().finger("index", [along_x(0.007, 0.05)] * 2, [0.05, 0.05], upper=1.0)
    hand = builder.couple("index_0", "index_1", 2.0).hand()
    for angle, ratio in ((0.3, 2.0), (0.8, 0.0)):
        q = hand.coupled(np.array([angle, 0.0]))
        assert degrees_of_freedom(hand, q).motion.tolist() == [[1.0], [ratio]]
