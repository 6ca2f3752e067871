"""Preshapes of the thumb: inside its limits, the same again, better opposed than a random one."""

from __future__ import annotations

import numpy as np

import clench
from clench.models.hand.opposition import _best_opposition, _tips, opposing_preshapes


def test_they_are_inside_the_limits_and_the_same_again() -> None:
    hand = clench.Hand.load("robonaut2")
    found = opposing_preshapes(hand, 4, 7)
    assert found == opposing_preshapes(hand, 4, 7)
    assert found[0] == {}
    assert len(found) == 4
    for preshape in found[1:]:
        assert set(preshape) == {"thumb_roll", "thumb_proximal"}
        for name, angle in preshape.items():
            joint = hand.joints[hand.joint_index(name)]
            assert joint.lower <= angle <= joint.upper


def test_of_many_draws_the_best_are_kept() -> None:
    hand = clench.Hand.load("robonaut2")
    thumb, *others = hand.fingers

    def opposed(preshape: dict[str, float]) -> float:
        own = _tips(hand, thumb, preshape)
        return sum(max(0.0, _best_opposition(own, _tips(hand, finger))) for finger in others)

    scores = [opposed(p) for p in opposing_preshapes(hand, 4, 7)[1:]]
    assert scores == sorted(scores, reverse=True)
    rng = np.random.default_rng(1)
    turned = hand.joints[:2]
    drawn = [opposed({j.name: float(rng.uniform(j.lower, j.upper)) for j in turned}) for _ in range(40)]
    assert scores[-1] > np.median(drawn)


def test_a_thumb_that_cannot_be_turned() -> None:
    hand = clench.Hand.load("robonaut2")
    assert opposing_preshapes(hand, 1, 0) == [{}]
    thumbless = clench.Hand.load("robonaut2")
    object.__setattr__(thumbless, "fingers", thumbless.fingers[1:])
    assert opposing_preshapes(thumbless, 5, 0) == [{}]
